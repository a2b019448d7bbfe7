// SPDX-License-Identifier: MIT
#pragma once

// What stands in for the regressor where its noise would bias the ratio.

#include <palpate/arithmetic.hpp>

namespace palpate {

/// Share of the n-th value in a running mean: 1 / n, the mean of all of them, until that is below `smoothing`; an
/// exponential memory of about 1 / smoothing values from then on.
template <class Real>
constexpr Real mean_share(Real n, Real smoothing) noexcept {
  if (PALPATE_UNLIKELY(product(n, smoothing) < 1)) {
    return 1 / n;
  }
  return smoothing;
}

/// Instrumental variable of one regressor x: the running mean of the regressors before it. The noise of x is not in it
/// (Soderstrom and Stoica 1983).
template <class Real>
class Instrument {
 public:
  /// The weight w of a sample: the mean, where it is a forecast of x; x itself, least squares, elsewhere.
  ///
  /// A mean that says nothing of x, or the opposite, would make w x cancel, and the ratio run away. So w x > 0 always,
  /// R' = lambda R + w x is a sum of positive terms, and 0 < (w / R') x <= 1: an error of the ratio never grows; and as
  /// w < 4 x, one sample moves the ratio by 4 e / w at most. (4 and 8 give the same errors on every scenario; 2 leaves
  /// out means that serve, and costs a quarter under strong tremor.)
  constexpr Real weight(Real regressor) const noexcept {
    const Real w = magnitude(mean_), x = magnitude(regressor);
    return product(mean_, regressor) > 0 && w < 4 * x && x < 4 * w ? mean_ : regressor;
  }

  /// The n-th regressor.
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
