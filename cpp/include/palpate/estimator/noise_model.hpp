// SPDX-License-Identifier: MIT
#pragma once

// Noise model: scale and autocorrelation of the innovations.

#include <palpate/arithmetic.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// Autoregressive model of the innovations e(k): their mean square, their autocorrelation at lags 1 and 2, the forecast
/// rho e(k-1), the scale of the whitened innovations e(k) - rho e(k-1), and whether their mean shows that the ratio
/// drifts. All sums have exponential weights, and the count has the same weights.
template <class Real>
class NoiseModel {
 public:
  /// Fewest innovations for a standard error. So few cannot show a correlation over more samples than that, nor how far
  /// an oscillation cancels: so the long-run variance is limited to within this factor of the variance.
  static constexpr int fewest = 32;

  // Written out: without it compilers for microcontrollers make a new state on the stack first, and copy it.
  constexpr NoiseModel() noexcept {}

  /// The innovation minus its forecast.
  constexpr Real whitened(Real innovation) const noexcept { return innovation - product(rho_, before_); }

  /// Standard deviation of the whitened innovations: for a normal distribution sqrt(pi / 2) times the mean magnitude.
  /// This needs no square root.
  constexpr Real scale() const noexcept { return product(Real(1.2533141), mean_magnitude_); }

  /// Add the n-th whitened innovation, clipped; a memory of about 100, 2 / 0.02.
  constexpr void add_magnitude(Real clipped, Real n) noexcept {
    mean_magnitude_ += product(mean_share(n, Real(0.02)), magnitude(clipped) - mean_magnitude_);
  }

  /// Add an innovation, of a negative regressor or not; rho is estimated again after each of the `first` ones, then after
  /// every 8th.
  constexpr void add(Real innovation, bool negative, bool first) noexcept {
    follow_offset(innovation, negative);
    lag0_ = product(memory, lag0_) + product(innovation, innovation);
    lag1_ = product(memory, lag1_) + product(innovation, before_);
    lag2_ = product(memory, lag2_) + product(innovation, before_that_);
    count_ = product(memory, count_) + 1;
    remember(innovation);
    until_forecast_ -= 1;
    if (PALPATE_UNLIKELY(!(until_forecast_ > 0))) {
      until_forecast_ = first ? Real(1) : Real(8);
      rho_ = corrected(correlation(lag1_));
      keep_normal();
    }
  }

  /// The innovation that takes the place of an outlier: the forecast plus the clipped whitened innovation.
  constexpr Real limited_innovation(Real clipped) const noexcept { return product(rho_, before_) + clipped; }

  /// Add an outlier. If the ratio drifts, it may be a consequence of this.
  constexpr void skip(Real clipped, bool negative) noexcept {
    const Real innovation = limited_innovation(clipped);
    if (PALPATE_UNLIKELY(drifts())) {
      follow_offset(innovation, negative);
    }
    remember(innovation);
  }

  /// Start again after a hand-over: the next innovations are independent of the earlier ones.
  constexpr void restart() noexcept {
    before_ = before_that_ = offset_ = 0;
    allowed_ = allowed_offset;
  }

  /// Whether the innovations have an offset that their noise does not explain: the ratio drifts away from the estimate.
  constexpr bool drifts() const noexcept {
    return magnitude(offset_) > product(allowed_, roughness_) && count_ >= fewest_offset;
  }

  /// Whether what the press itself disturbs is past.
  constexpr bool mature() const noexcept { return count_ >= 3 * fewest_offset; }

  /// The ratio drifts: where it turns back, half of the offset shows the next drift, for some time.
  constexpr void expect_drift() noexcept {
    if (mature()) {
      allowed_ = allowed_offset / 2;
    }
  }

  /// While the ratio drifts: the least share of a new sample in the ratio. As the tracking signal of Trigg and Leach (Operational
  /// Research Quarterly 18, 1967), the share grows with the offset, in units of the roughness.
  constexpr Real least_share() const noexcept {
    constexpr Real most = Real(0.9);
    const Real excess = magnitude(offset_) / roughness_ - allowed_;
    return excess < most ? excess : most;
  }

  /// Whether long_run_variance() is valid.
  constexpr bool settled() const noexcept { return count_ >= fewest; }

  constexpr Real variance() const noexcept { return count_ > 0 ? lag0_ / count_ : Real(0); }

  /// Variance of the mean of many innovations, times their number. It is that of an AR(2) process if the second
  /// coefficient is significant (tremor: an oscillation cancels), otherwise of an AR(1) process. Yule-Walker:
  ///   AR(2): gamma(0) (1 - f1 r1 - f2 r2) / (1 - f1 - f2)^2,   AR(1): gamma(0) (1 + r1) / (1 - r1).
  /// With `aliases` a fast oscillation may look slow, and then it does not cancel: the AR(1) process is used instead.
  constexpr Real long_run_variance(bool aliases) const noexcept {
    const Real variance = lag0_ / count_;
    const Real r1 = correlation(lag1_), r2 = correlation(lag2_);
    const Real rest = 1 - product(r1, r1);
    const Real partial = rest > 0 ? (r2 - product(r1, r1)) / rest : Real(0);  // correlation at lag 2, given lag 1
    // If the second coefficient is 0, n partial^2 is chi-squared with one degree of freedom: 1 % is above 6.63.
    if (aliases || product(count_, product(partial, partial)) < Real(6.63)) {
      return product(variance, (1 + rho_) / (1 - rho_));
    }
    const Real c1 = corrected(r1), c2 = limited(r2 + bias(r1)), spread = 1 - product(c1, c1);
    const Real first = product(c1, 1 - c2) / spread, second = (c2 - product(c1, c1)) / spread;
    const Real gap = 1 - first - second;
    const Real factor = (1 - product(first, c1) - product(second, c2)) / product(gap, gap);
    const Real most = fewest, least = 1 / most;
    return product(variance, !(gap > 0) || factor > most ? most : factor > least ? factor : least);
  }

  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    for (Real* value : {&mean_magnitude_, &lag0_, &lag1_, &lag2_, &count_, &before_, &before_that_, &rho_, &offset_,
                        &roughness_, &until_forecast_, &allowed_}) {
      visit(*value);
    }
  }

 private:
  // Of the mean of e(k) over 31 innovations (2 / 0.0625 - 1), in units of the roughness, the mean of |e(k) - e(k-1)|: 2 is
  // 5 standard deviations of this mean for the noise that the matched pair leaves, 13 for white noise, and 4 for an AR(1)
  // with rho = 0.7. A noise that is correlated more than this is partly taken for a drift.
  static constexpr Real allowed_offset = Real(2);
  static constexpr Real fewest_offset = 16;
  static constexpr Real memory = Real(0.995);  // of the sums

  // Data without noise: what decays would come below the smallest normal number, where arithmetic takes ten times as long.
  // Until the next forecast it decays by less than a factor of 2. Larger numbers stay as they are.
  PALPATE_INLINE constexpr void keep_normal() noexcept {
    constexpr Real least = std::numeric_limits<Real>::min() * 1024;
    mean_magnitude_ += least;
    lag0_ += least;
    lag1_ += least;
    lag2_ += least;
    offset_ += least;
    roughness_ += least;
  }

  // A larger ratio gives innovations of the regressor's sign.
  PALPATE_INLINE constexpr void follow_offset(Real innovation, bool negative) noexcept {
    if (PALPATE_UNLIKELY(allowed_ < allowed_offset)) {
      allowed_ += Real(1) / 64;
    }
    offset_ += product((PALPATE_UNLIKELY(negative) ? -innovation : innovation) - offset_, Real(0.0625));
    roughness_ += product(magnitude(innovation - before_) - roughness_, Real(0.03125));
  }

  constexpr void remember(Real innovation) noexcept {
    before_that_ = before_;
    before_ = innovation;
  }

  constexpr Real correlation(Real lag) const noexcept { return lag0_ > 0 ? lag / lag0_ : Real(0); }

  // A correlation estimated from n values after subtracting their mean is too low by (1 + 3 r1) / n (Kendall,
  // Biometrika 41, 1954).
  constexpr Real bias(Real r1) const noexcept { return (1 + product(Real(3), r1)) / count_; }
  constexpr Real corrected(Real r1) const noexcept { return limited(r1 + bias(r1)); }

  // (1 + r) / (1 - r) from 1 / fewest to fewest.
  static constexpr Real limited(Real r) noexcept {
    constexpr Real limit = Real(fewest - 1) / Real(fewest + 1);
    return r > limit ? limit : r < -limit ? -limit : r;
  }

  Real mean_magnitude_ = 0;  // of whitened innovations, clipped
  Real lag0_ = 0, lag1_ = 0, lag2_ = 0, count_ = 0;
  Real before_ = 0, before_that_ = 0;  // e(k-1), e(k-2)
  Real rho_ = 0;
  Real offset_ = 0, roughness_ = 0, allowed_ = allowed_offset;
  Real until_forecast_ = 5;  // innovations; at first as many as Handover has before its detector starts
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
