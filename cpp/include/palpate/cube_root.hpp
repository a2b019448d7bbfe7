// SPDX-License-Identifier: MIT
#pragma once

// The cube root: by basic arithmetic only, so the same bits from every processor, and at compile time.

#include <palpate/arithmetic.hpp>

namespace palpate {

/// Cube root of a finite value above 0, to a few units in the last place.
///
/// Powers of 8 are taken out of it, which is exact. Halley's iteration r (r^3 + 2 v) / (2 r^3 + v) has the error
/// 2/3 e^3: from 10 % at most on, 7e-4, 2e-10, below a unit.
template <class Real>
constexpr Real cube_root(Real value) noexcept {
  const Real large = detail::taken_out<4096, 16>(value, Real(1) / 4096);
  const Real small = detail::taken_out<8, 2>(value, Real(1));
  Real root = Real(0.9) + value / 7;
  for (int i = 0; i < 3; ++i) {
    const Real cube = product(product(root, root), root);
    root = product(root, (cube + 2 * value) / (2 * cube + value));
  }
  return product(large * small, root);
}

}  // namespace palpate
