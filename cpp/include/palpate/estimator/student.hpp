// SPDX-License-Identifier: MIT
#pragma once

// How large a Student statistic may be: from basic arithmetic, so that all processors have the same bits.

#include <palpate/arithmetic.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {
namespace detail {

/// exp(x) - 1 for x >= 0, to 1e-11: a series for x / 2^n, then doubled by e(2 y) = e(y) (e(y) + 2).
template <class Real>
constexpr Real exponential_minus_1(Real x) noexcept {
  int doublings = 0;
  for (; x > Real(0.25) && doublings < 16; x /= 2) {
    ++doublings;
  }
  Real sum = 1;
  for (int k = 9; k > 1; --k) {
    sum = 1 + product(product(x, 1 / Real(k)), sum);
  }
  sum *= x;
  for (; doublings > 0; --doublings) {
    sum *= sum + 2;
  }
  return sum;
}

/// Square of the Student statistic that is as rare as a normal deviate of this square (Wallace, Annals of Mathematical
/// Statistics 30, 1959).
template <class Real>
constexpr Real student_square(Real normal_square, Real degrees_of_freedom) noexcept {
  const Real n = degrees_of_freedom, share = (product(Real(8), n) + 3) / (product(Real(8), n) + 1);
  return product(n, exponential_minus_1(product(product(share, share), normal_square) / n));
}

}  // namespace detail
}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
