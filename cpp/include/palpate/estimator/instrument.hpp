// SPDX-License-Identifier: MIT
#pragma once

// What a sample is weighted by, in place of its regressor.

#include <palpate/arithmetic.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// Instrument of a regressor x: the running mean of the regressors before it, which is independent of the noise of x
/// (Soderstrom and Stoica 1983).
template <class Real>
struct InstrumentalVariable {
  Real mean = 0;

  /// The weight w of a sample: the mean if it is a forecast of x; otherwise x itself (least squares).
  ///
  /// With a mean of the other sign, or of a very different size, the sum of w x could cancel and the ratio diverge. So
  /// w x > 0 always, R' = lambda R + w x is a sum of positive terms, and 0 < (w / R') x <= 1: an error of the ratio
  /// never grows; and since w < 4 x, one sample changes the ratio by at most 4 e / w. (4 and 8 give the same errors in
  /// all scenarios; 2 excludes useful means, and increases the error by a quarter under strong tremor.)
  constexpr Real weight(Real regressor) const noexcept {
    const Real w = magnitude(mean), x = magnitude(regressor);
    return product(mean, regressor) > 0 && w < 4 * x && x < 4 * w ? mean : regressor;
  }

  /// Add the n-th regressor.
  constexpr void add(Real regressor, Real n, Real smoothing) noexcept {
    mean += product(mean_share(n, smoothing), regressor - mean);
  }
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
