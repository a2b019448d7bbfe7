// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/arithmetic.hpp>

namespace palpate {

/// Share of the n-th value in a running mean. First 1 / n, which gives the mean of all values; as soon as that is below
/// `smoothing`, `smoothing`, which gives an exponential memory of about 1 / smoothing values.
template <class Real>
constexpr Real mean_share(Real n, Real smoothing) noexcept {
  if (PALPATE_UNLIKELY(product(n, smoothing) < 1)) {
    return 1 / n;
  }
  return smoothing;
}

}  // namespace palpate
