// SPDX-License-Identifier: MIT
#pragma once

// The estimator for a probe in a hand: what the paper's lacks, see the classes below.

#include <limits>
#include <palpate/constant.hpp>
#include <palpate/noise.hpp>
#include <palpate/rls.hpp>

namespace palpate {

/// One side of Page's CUSUM on signed news z in units of its scale, with everything that was seen since it was last 0:
/// the maximum-likelihood guess of when the change came, if one came (Page 1954; Basseville and Nikiforov 1993).
template <class Real>
struct Since {
  Real statistic = 0;
  Real weighted_output = 0, information = 0, squares = 0, count = 0;

  // Selects, not a branch: whether noise is above 0 cannot be predicted.
  constexpr void update(Real step, Real weight, Real output, Real regressor) noexcept {
    const Real sum = statistic + step;
    const bool keep = sum > 0;
    statistic = keep ? sum : Real(0);
    weighted_output = keep ? weighted_output + product(weight, output) : Real(0);
    information = keep ? information + product(weight, regressor) : Real(0);
    squares = keep ? squares + product(weight, weight) : Real(0);
    count = keep ? count + 1 : Real(0);
  }

  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    Real* own[] = {&statistic, &weighted_output, &information, &squares, &count};
    for (Real* value : own) {
      visit(*value);
    }
  }
};

/// Settings of Handover. drift and threshold in standard deviations of the news: see palpate.design.cusum.
template <class Real>
struct HandoverSettings {
  Real steady = Real(0.995);           // forgetting factor
  Real drift = Real(0.75);             // slack of the CUSUM
  Real threshold = Real(8);            // its limit
  Real clip = Real(3);                 // news beyond it counts as this to the CUSUM, and not at all to the ratio
  Real smoothing = Real(0.0625);       // share of a new regressor in the instrument
  Real min_information = Real(1e-12);  // 1 / max_covariance

  template <class Visit>
  static constexpr void visit_fields(Visit&& visit) noexcept {
    visit("steady", &HandoverSettings::steady);
    visit("drift", &HandoverSettings::drift);
    visit("threshold", &HandoverSettings::threshold);
    visit("clip", &HandoverSettings::clip);
    visit("smoothing", &HandoverSettings::smoothing);
    visit("min_information", &HandoverSettings::min_information);
  }
};

/// Recursive instrumental variables with a change detector that knows when the change came.
///
/// With x the regressor, w the mean of the regressors before it (the instrument), e = output - x r:
///   R' = lambda R + w x,  r' = r + (w / R') e.
/// Where w = x this is least squares. The noise of x is not in w, so r is not drawn to 0 by it; nor does tremor, which
/// x carries with a slightly smaller amplitude after the alignment, bias r (Soderstrom and Stoica 1983). The detector
/// is a two-sided CUSUM on the news of e, in units of its own scale: no setting in pF. At an alarm the estimate is
/// handed over to the samples since that side's CUSUM was last 0: the old ratio is forgotten at once.
template <class Real, class Parameters = Kept<HandoverSettings<Real>>>
class Handover : public Parameters {
  static_assert(is_real<Real>, "palpate::Handover: Real must be float or double");

 public:
  using real_type = Real;
  using Parameters::settings;
  static constexpr Real default_covariance = Real(1e10);
  static constexpr int warm_up = 8;            // samples before the detector watches
  static constexpr int transient = 3;          // first innovations, which speak of the initial ratio
  static constexpr int forecast_interval = 8;  // samples for which rho stays as it is, later in a touch
  static constexpr int trustworthy = 16;       // samples since the last change for a standard error

  constexpr explicit Handover(const Parameters& parameters = Parameters(), Real ratio = Real(1),
                              Real covariance = default_covariance) noexcept
      : Parameters(parameters), ratio_(ratio), information_(Real(1) / covariance) {}

  constexpr Step<Real> update(Real output, Real regressor) noexcept {
    const Real innovation = output - product(regressor, ratio_);
    if (PALPATE_UNLIKELY(!(in_range(output) && in_range(regressor) && in_range(innovation)))) {
      return refusal(ratio_, innovation, alarm());
    }
    const Real weight = leads(instrument_, regressor) ? instrument_ : regressor;
    Since<Real> up = alarm() ? Since<Real>() : up_;
    Since<Real> down = alarm() ? Since<Real>() : down_;
    const Real news = noise_.news(innovation);
    const bool watching = seen_ >= warm_up;
    const Real scale = least_scale(noise_.scale(), output);
    const Real limit = product(settings.clip, scale);
    const Real clipped = !watching ? news : news > limit ? limit : news < -limit ? -limit : news;
    const bool outlier = watching && magnitude(news) > limit;
    if (watching) {
      const Real z = clipped / scale;
      up.update(z - settings.drift, weight, output, regressor);
      down.update(-z - settings.drift, weight, output, regressor);
    }
    return conclude({output, regressor, innovation, clipped, weight, outlier}, up, down);
  }

  constexpr void reset(Real ratio = Real(1), Real covariance = default_covariance) noexcept {
    *this = Handover(static_cast<const Parameters&>(*this), ratio, covariance);
  }

  /// As Rls::visit_state.
  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    Real* own[] = {&ratio_, &information_, &squares_, &weight_, &instrument_, &seen_, &until_forecast_};
    for (Real* value : own) {
      visit(*value);
    }
    up_.visit_state(visit);
    down_.visit_state(visit);
    noise_.visit_state(visit);
  }

  constexpr Real ratio() const noexcept { return ratio_; }
  constexpr Real information() const noexcept { return information_; }
  constexpr Real covariance() const noexcept { return Real(1) / information_; }
  constexpr Real statistic() const noexcept {
    return up_.statistic > down_.statistic ? up_.statistic : down_.statistic;
  }
  constexpr bool alarm() const noexcept { return statistic() > settings.threshold; }
  /// Sum of the weights lambda^k of the samples that the ratio rests on.
  constexpr Real weight() const noexcept { return weight_; }
  /// Whether standard_error() means something: enough samples, in all and since the last change.
  constexpr bool settled() const noexcept { return noise_.weight >= InnovationNoise<Real>::fewest && weight_ >= trustworthy; }

  /// Variance of the ratio, s^2 sum(w^2) / R^2 with s^2 the long-run variance of the innovations; only where settled().
  /// Knows of noise and tremor, not of the baseline's error (Tracker adds that).
  constexpr Real variance() const noexcept {
    return product(noise_.long_run_variance(), squares_ / information_) / information_;
  }
  /// NaN where the squares of the innovations are too small, or too large, for Real.
  constexpr Real standard_error() const noexcept {
    const Real square = variance();
    return square > 0 && is_finite(square) ? square_root(square) : std::numeric_limits<Real>::quiet_NaN();
  }

 private:
  struct Sample {
    Real output, regressor, innovation, clipped, weight;
    bool outlier;
  };

  // Products of two such numbers, summed over any touch, stay finite.
  static constexpr bool in_range(Real value) noexcept {
    constexpr Real limit = std::is_same_v<Real, float> ? Real(1e16) : Real(1e140);
    return magnitude(value) < limit;
  }

  // An instrument that says nothing of x, or the opposite, would make w x cancel, and the ratio run away: least squares
  // then. So w x > 0 always, R' is a sum of positive terms, and 0 < (w / R') x <= 1: an error of r never grows; and as
  // w < 4 x, one sample moves the ratio by 4 e / w at most. (4 and 8 give the same errors on every scenario; 2 leaves
  // out mean regressors that serve, and costs a quarter under strong tremor.)
  static constexpr bool leads(Real instrument, Real regressor) noexcept {
    const Real w = magnitude(instrument), x = magnitude(regressor);
    return product(instrument, regressor) > 0 && w < 4 * x && x < 4 * w;
  }

  // Data without noise still round: a few eps of the output.
  static constexpr Real least_scale(Real scale, Real output) noexcept {
    const Real least = product(magnitude(output) + Real(1e-18), std::is_same_v<Real, float> ? Real(1e-6) : Real(1e-15));
    return scale > least ? scale : least;
  }

  constexpr Step<Real> conclude(const Sample& s, const Since<Real>& up, const Since<Real>& down) noexcept {
    const Since<Real>& side = up.statistic > down.statistic ? up : down;
    const bool change = side.statistic > settings.threshold;
    const bool take = !change && !s.outlier;
    Real information = information_, gain = 0;
    if (PALPATE_UNLIKELY(change)) {
      information = limited(side.information);
    } else if (take) {
      information = limited(product(settings.steady, information_) + product(s.weight, s.regressor));
      gain = s.weight / information;
    }
    const Real ratio = change ? side.weighted_output / information : ratio_ + product(gain, s.innovation);
    if (PALPATE_UNLIKELY(!is_finite(ratio))) {
      return refusal(ratio_, s.innovation, alarm());
    }
    ratio_ = ratio;
    information_ = information;
    if (change) {
      squares_ = side.squares;
      weight_ = side.count;
    } else if (take) {
      weigh(s.weight);
    }
    up_ = up;
    down_ = down;
    learn(s, change);
    return {ratio, s.innovation, gain, change, true};
  }

  constexpr void weigh(Real weight) noexcept {
    squares_ = product(product(settings.steady, settings.steady), squares_) + product(weight, weight);
    weight_ = product(settings.steady, weight_) + 1;
  }

  constexpr void learn(const Sample& s, bool change) noexcept {
    seen_ += 1;
    if (seen_ > transient) {
      noise_.add_magnitude(s.clipped, seen_ - transient);
      if (s.outlier) {
        noise_.remember(product(noise_.rho, noise_.before) + s.clipped);
      } else {
        const bool lags = noise_.lags(s.innovation);
        noise_.add(s.innovation, settings.steady);
        until_forecast_ -= 1;
        if (PALPATE_UNLIKELY(!(until_forecast_ > 0))) {
          until_forecast_ = seen_ < 4 * forecast_interval ? 1 : forecast_interval;
          noise_.update_forecast();
        }
        if (PALPATE_UNLIKELY(lags && weight_ > trustworthy)) {
          forget_half();
        }
      }
    }
    if (PALPATE_UNLIKELY(change)) {
      noise_.before = noise_.before_that = noise_.offset = 0;
    }
    Real share = settings.smoothing;
    if (PALPATE_UNLIKELY(product(seen_, share) < 1)) {
      share = 1 / seen_;
    }
    instrument_ += product(share, s.regressor - instrument_);
  }

  // A ratio that drifts slowly: a shorter memory, until the lag is gone.
  constexpr void forget_half() noexcept {
    information_ = limited(information_ / 2);
    weight_ /= 2;
    squares_ /= 4;
    noise_.offset /= 2;
  }

  constexpr Real limited(Real information) const noexcept {
    return information > settings.min_information ? information : settings.min_information;
  }

  PALPATE_COLD static constexpr Step<Real> refusal(Real ratio, Real innovation, bool alarm) noexcept {
    return {ratio, innovation, Real(0), alarm, false};
  }

  Real ratio_;
  Since<Real> up_, down_;
  Real information_;
  Real squares_ = 0, weight_ = 0, instrument_ = 0, seen_ = 0;
  Real until_forecast_ = warm_up - transient;
  InnovationNoise<Real> noise_;
};

}  // namespace palpate
