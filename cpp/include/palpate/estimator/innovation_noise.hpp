// SPDX-License-Identifier: MIT
#pragma once

// What the innovations say about themselves: their scale, and how each resembles the ones before it.

#include <palpate/estimator/instrument.hpp>

namespace palpate {

/// Innovations e(k) as an autoregression: their mean square, their autocorrelation at lags 1 and 2, the forecast
/// rho e(k-1), and the scale of what it leaves, the whitened innovations. Sums are exponentially weighted, with the
/// count weighted alike.
template <class Real>
class InnovationNoise {
 public:
  /// The fewest innovations that a standard error may rest on. So few tell no correlation that lasts longer than they
  /// do, and no tone that cancels itself better: the long-run variance stays within this factor of the variance.
  static constexpr int fewest = 32;

  /// The first forecast is made from so many innovations.
  constexpr explicit InnovationNoise(Real first_forecast = 5) noexcept : until_forecast_(first_forecast) {}

  /// What the forecast leaves of an innovation.
  constexpr Real whitened(Real innovation) const noexcept { return innovation - product(rho_, before_); }

  /// Standard deviation of whitened innovations: sqrt(pi / 2) times the mean magnitude for a normal distribution. No
  /// square root.
  constexpr Real scale() const noexcept { return product(Real(1.2533141), mean_magnitude_); }

  /// The n-th whitened innovation, clipped; a memory of about 100.
  constexpr void add_magnitude(Real clipped, Real n) noexcept {
    mean_magnitude_ += product(mean_share(n, Real(0.02)), magnitude(clipped) - mean_magnitude_);
  }

  /// An innovation; rho is estimated anew once in `interval` of them. Returns whether the ratio drifts away from the
  /// estimate.
  constexpr bool add(Real innovation, Real forgetting, Real interval) noexcept {
    const bool drifts = follow_offset(innovation);
    lag0_ = product(forgetting, lag0_) + product(innovation, innovation);
    lag1_ = product(forgetting, lag1_) + product(innovation, before_);
    lag2_ = product(forgetting, lag2_) + product(innovation, before_that_);
    count_ = product(forgetting, count_) + 1;
    remember(innovation);
    until_forecast_ -= 1;
    if (PALPATE_UNLIKELY(!(until_forecast_ > 0))) {
      until_forecast_ = interval;
      rho_ = corrected(correlation(lag1_));
    }
    return drifts;
  }

  /// In the place of an outlier: its forecast, and what it counts as beyond that.
  constexpr void skip(Real clipped) noexcept { remember(product(rho_, before_) + clipped); }

  /// The ratio is a new one: what comes next does not resemble what was.
  constexpr void restart() noexcept { before_ = before_that_ = offset_ = 0; }

  /// The ratio has been brought half-way to where the innovations have no offset.
  constexpr void halve_offset() noexcept { offset_ /= 2; }

  /// Whether long_run_variance() means something.
  constexpr bool settled() const noexcept { return count_ >= fewest; }

  /// Variance of a long mean of innovations, times their number: that of an AR(2) process where the second
  /// coefficient is significant (tremor: a tone cancels itself), of an AR(1) process elsewhere. By Yule and Walker,
  ///   AR(2): gamma(0) (1 - f1 r1 - f2 r2) / (1 - f1 - f2)^2,   AR(1): gamma(0) (1 + r1) / (1 - r1).
  constexpr Real long_run_variance() const noexcept {
    const Real variance = lag0_ / count_;
    const Real r1 = correlation(lag1_), r2 = correlation(lag2_);
    const Real rest = 1 - product(r1, r1);
    const Real partial = rest > 0 ? (r2 - product(r1, r1)) / rest : Real(0);  // correlation at lag 2, given lag 1
    // n partial^2 is chi-squared with one degree of freedom where there is no second coefficient: 1 % is above 6.63.
    if (product(count_, product(partial, partial)) < Real(6.63)) {
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
    Real* own[] = {&mean_magnitude_, &lag0_, &lag1_,   &lag2_,      &count_,         &before_,
                   &before_that_,    &rho_,  &offset_, &roughness_, &until_forecast_};
    for (Real* value : own) {
      visit(*value);
    }
  }

 private:
  // The ratio drifts where e(k) keeps an offset that no correlated noise of this roughness has. Both are running means
  // over 32 innovations, the roughness of |e(k) - e(k-1)|, 0.8 standard deviations of a step. An AR(1) with rho = 0.8
  // has an offset of 0.6 standard deviations of its steps; this asks for 2.
  constexpr bool follow_offset(Real innovation) noexcept {
    offset_ += product(innovation - offset_, Real(0.03125));
    roughness_ += product(magnitude(innovation - before_) - roughness_, Real(0.03125));
    return magnitude(offset_) > product(Real(2.5), roughness_);
  }

  constexpr void remember(Real innovation) noexcept {
    before_that_ = before_;
    before_ = innovation;
  }

  constexpr Real correlation(Real lag) const noexcept { return lag0_ > 0 ? lag / lag0_ : Real(0); }

  // A correlation estimated from n values, their mean taken out, is low by (1 + 3 r1) / n (Kendall, Biometrika 41, 1954).
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
  Real offset_ = 0, roughness_ = 0;
  Real until_forecast_;  // innovations
};

}  // namespace palpate
