// SPDX-License-Identifier: MIT
#pragma once

// What the innovations say about themselves: their scale, and how each resembles the ones before it.

#include <palpate/arithmetic.hpp>

namespace palpate {

/// Square root by Newton's iteration on arithmetic alone: the same bits at compile time, on a host and without an FPU.
/// 0 for what is negative; infinity and NaN stay what they are.
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

/// Innovations e(k) as an autoregression: their mean square, their autocorrelation at lags 1 and 2, and the scale of
/// what each adds to the forecast rho e(k-1). Exponentially weighted, with the weight's own sum.
template <class Real>
struct InnovationNoise {
  /// The fewest innovations that a standard error may rest on. So few tell no correlation that lasts longer than they
  /// do, and no tone that cancels itself better: the long-run variance stays within this factor of the variance.
  static constexpr int fewest = 32;

  Real scale_share = Real(0.02);  // of a new sample in the scale: a memory of about 100 samples
  Real mean_magnitude = 0;        // of e(k) - rho e(k-1), clipped
  Real lag0 = 0, lag1 = 0, lag2 = 0, weight = 0;
  Real before = 0, before_that = 0;  // e(k-1), e(k-2)
  Real rho = 0;
  Real offset = 0, roughness = 0;  // running means of e(k) and of |e(k) - e(k-1)|, over 32 samples

  /// What the forecast leaves of an innovation.
  constexpr Real news(Real innovation) const noexcept { return innovation - product(rho, before); }

  /// Standard deviation of the news: sqrt(pi / 2) times the mean magnitude for a normal distribution. No square root.
  constexpr Real scale() const noexcept { return product(Real(1.2533141), mean_magnitude); }

  constexpr void add_magnitude(Real clipped_news, Real count) noexcept {
    Real share = scale_share;
    if (PALPATE_UNLIKELY(product(count, scale_share) < 1)) {
      share = 1 / count;
    }
    mean_magnitude += product(share, magnitude(clipped_news) - mean_magnitude);
  }

  constexpr void add(Real innovation, Real forgetting) noexcept {
    lag0 = product(forgetting, lag0) + product(innovation, innovation);
    lag1 = product(forgetting, lag1) + product(innovation, before);
    lag2 = product(forgetting, lag2) + product(innovation, before_that);
    weight = product(forgetting, weight) + 1;
    remember(innovation);
  }

  /// Whether the ratio drifts away from the estimate: e(k) keeps an offset that no correlated noise of this roughness
  /// has. An AR(1) with rho = 0.8 has an offset of 0.6 standard deviations of its steps; this asks for 2.
  constexpr bool lags(Real innovation) noexcept {
    offset += product(innovation - offset, Real(0.03125));
    roughness += product(magnitude(innovation - before) - roughness, Real(0.03125));
    return magnitude(offset) > product(Real(2.5), roughness);
  }

  constexpr void remember(Real innovation) noexcept {
    before_that = before;
    before = innovation;
  }

  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    Real* own[] = {&mean_magnitude, &lag0, &lag1, &lag2, &weight, &before, &before_that, &rho, &offset, &roughness};
    for (Real* value : own) {
      visit(*value);
    }
  }

  constexpr void update_forecast() noexcept { rho = corrected(correlation(lag1)); }

  /// Variance of a long mean of innovations, times their number: that of an AR(2) process where the second
  /// coefficient is significant (tremor: a tone cancels itself), of an AR(1) process elsewhere. By Yule and Walker,
  ///   AR(2): gamma(0) (1 - f1 r1 - f2 r2) / (1 - f1 - f2)^2,   AR(1): gamma(0) (1 + r1) / (1 - r1).
  constexpr Real long_run_variance() const noexcept {
    const Real variance = lag0 / weight;
    const Real r1 = correlation(lag1), r2 = correlation(lag2);
    const Real rest = 1 - product(r1, r1);
    const Real partial = rest > 0 ? (r2 - product(r1, r1)) / rest : Real(0);  // correlation at lag 2, given lag 1
    // n partial^2 is chi-squared with one degree of freedom where there is no second coefficient: 1 % is above 6.63.
    if (product(weight, product(partial, partial)) < Real(6.63)) {
      return product(variance, (1 + rho) / (1 - rho));
    }
    const Real c1 = corrected(r1), c2 = limited(r2 + bias(r1)), spread = 1 - product(c1, c1);
    const Real first = product(c1, 1 - c2) / spread, second = (c2 - product(c1, c1)) / spread;
    const Real gap = 1 - first - second;
    const Real factor = (1 - product(first, c1) - product(second, c2)) / product(gap, gap);
    const Real most = fewest, least = 1 / most;
    return product(variance, !(gap > 0) || factor > most ? most : factor > least ? factor : least);
  }

 private:
  constexpr Real correlation(Real lag) const noexcept { return lag0 > 0 ? lag / lag0 : Real(0); }

  // A correlation estimated from n values, their mean taken out, is low by (1 + 3 r1) / n (Kendall, Biometrika 41, 1954).
  constexpr Real bias(Real r1) const noexcept { return (1 + product(Real(3), r1)) / weight; }
  constexpr Real corrected(Real r1) const noexcept { return limited(r1 + bias(r1)); }

  // (1 + r) / (1 - r) from 1 / fewest to fewest.
  static constexpr Real limited(Real r) noexcept {
    constexpr Real limit = Real(fewest - 1) / Real(fewest + 1);
    return r > limit ? limit : r < -limit ? -limit : r;
  }
};

}  // namespace palpate
