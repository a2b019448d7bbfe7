// SPDX-License-Identifier: MIT
#pragma once

// Instrumental variable: the weight of a sample in place of the regressor, whose noise would bias the ratio.

#include <palpate/estimator/running_mean.hpp>

namespace palpate {

/// Instrument of a regressor x: the running mean of the regressors before it, which is independent of the noise of x
/// (Soderstrom and Stoica 1983).
template <class Real>
class Instrument {
 public:
  /// The weight w of a sample: the mean if it is a forecast of x; otherwise x itself (least squares).
  ///
  /// With a mean of the other sign, or of a very different size, the sum of w x could cancel and the ratio diverge. So
  /// w x > 0 always, R' = lambda R + w x is a sum of positive terms, and 0 < (w / R') x <= 1: an error of the ratio
  /// never grows; and since w < 4 x, one sample changes the ratio by at most 4 e / w. (4 and 8 give the same errors in
  /// all scenarios; 2 excludes useful means, and increases the error by a quarter under strong tremor.)
  constexpr Real weight(Real regressor) const noexcept {
    const Real w = magnitude(mean_), x = magnitude(regressor);
    return product(mean_, regressor) > 0 && w < 4 * x && x < 4 * w ? mean_ : regressor;
  }

  /// Add the n-th regressor.
  constexpr void add(Real regressor, Real n, Real smoothing) noexcept {
    mean_ += product(mean_share(n, smoothing), regressor - mean_);
  }

  constexpr Real mean() const noexcept { return mean_; }

  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    visit(mean_);
  }

 private:
  Real mean_ = 0;
};

}  // namespace palpate
