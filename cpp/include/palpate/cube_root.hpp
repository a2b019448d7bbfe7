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
  Real scale = 1;
  for (; value < Real(1) / 4096; value *= 4096) {
    scale /= 16;
  }
  for (; value > 4096; value /= 4096) {
    scale *= 16;
  }
  for (; value < 1; value *= 8) {
    scale /= 2;
  }
  for (; value > 8; value /= 8) {
    scale *= 2;
  }
  Real root = Real(0.9) + value / 7;
  for (int i = 0; i < 3; ++i) {
    const Real cube = product(product(root, root), root);
    root = product(root, (cube + 2 * value) / (2 * cube + value));
  }
  return product(scale, root);
}

}  // namespace palpate
