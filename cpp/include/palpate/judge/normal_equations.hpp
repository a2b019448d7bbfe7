// SPDX-License-Identifier: MIT
#pragma once

// Normal equations as sums of products, solved by the sweep operator.

#include <palpate/arithmetic.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// A symmetric matrix of the sums of products of `Columns` variables. After sweep() of some of them, with y another one:
/// at(i, y) is the coefficient of i, error(i) its variance for noise of variance 1, at(i, j) of two swept ones minus
/// their covariance, at(y, y) the residual sum of squares (Goodnight, The American Statistician 33, 1979).
template <class Real, int Columns>
class NormalEquations {
 public:
  constexpr void add(const Real (&values)[Columns]) noexcept {
    int k = 0;
    for (int i = 0; i < Columns; ++i) {
      for (int j = 0; j <= i; ++j, ++k) {
        sums_[k] += product(values[i], values[j]);
      }
    }
  }

  /// The sums of both; before either was swept.
  constexpr void join(const NormalEquations& other) noexcept {
    for (int k = 0; k < Columns * (Columns + 1) / 2; ++k) {
      sums_[k] += other.sums_[k];
    }
  }

  /// The sums with `by` more in each value of a column; column `one` is 1.
  constexpr void shift(int column, int one, Real by) noexcept {
    const Real before = at(column, one);
    for (int i = 0; i < Columns; ++i) {
      sums_[place(i, column)] += i == column ? Real(0) : product(by, at(i, one));
    }
    sums_[place(column, column)] += product(by, before + at(column, one));
  }

  /// The sums with a share of each deviation from the mean, by products; column `one` is 1.
  constexpr NormalEquations gathered(int one, Real share) const noexcept {
    NormalEquations made;
    for (int i = 0; i < Columns; ++i) {
      for (int j = 0; j <= i; ++j) {
        const Real of_mean = product(at(i, one), at(j, one)) / at(one, one);
        made.sums_[place(i, j)] = of_mean + product(share, at(i, j) - of_mean);
      }
    }
    return made;
  }

  constexpr Real at(int i, int j) const noexcept { return sums_[place(i, j)]; }
  constexpr Real error(int i) const noexcept { return -at(i, i); }

  /// False, without a change: the variable is a combination of those before it, as far as Real can tell.
  constexpr bool sweep(int k) noexcept {
    const Real pivot = at(k, k);
    if (!(pivot > std::numeric_limits<Real>::min())) {
      return false;
    }
    for (int i = 0; i < Columns; ++i) {
      for (int j = 0; j <= i; ++j) {
        if (i != k && j != k) {
          sums_[place(i, j)] -= product(at(i, k), at(k, j)) / pivot;
        }
      }
    }
    for (int i = 0; i < Columns; ++i) {
      sums_[place(i, k)] = i == k ? -1 / pivot : at(i, k) / pivot;
    }
    return true;
  }

 private:
  static constexpr int place(int i, int j) noexcept { return i >= j ? i * (i + 1) / 2 + j : j * (j + 1) / 2 + i; }

  Real sums_[Columns * (Columns + 1) / 2] = {};
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
