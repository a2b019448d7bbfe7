// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/arithmetic.hpp>

namespace palpate {

/// Square root by Newton's iteration, with basic arithmetic only: the same bits at compile time, on a host and without
/// an FPU. 0 for a negative value; infinity and NaN stay unchanged.
template <class Real>
constexpr Real square_root(Real value) noexcept {
  if (!(value > 0) || !is_finite(value)) {
    return value < 0 ? Real(0) : value;
  }
  Real scale = 1;
  for (; value < Real(1) / 65536; value *= 65536) {
    scale /= 256;
  }
  for (; value > 65536; value /= 65536) {
    scale *= 256;
  }
  for (; value < 1; value *= 4) {
    scale /= 2;
  }
  for (; value > 4; value /= 4) {
    scale *= 2;
  }
  Real root = Real(0.7) + value / 3;  // at most 3.4 % off in [1, 4]; then 6e-4, 2e-7, 2e-14, below an eps
  for (int i = 0; i < 4; ++i) {
    root = (root + value / root) / 2;
  }
  return product(scale, root);
}

}  // namespace palpate
