// SPDX-License-Identifier: MIT
#pragma once

// The estimator of the scene handheld: instrumental variables, two-sided CUSUM, hand-over at an alarm.

#include <palpate/estimator/instrument.hpp>
#include <palpate/estimator/noise_model.hpp>
#include <palpate/estimator/rls.hpp>
#include <palpate/estimator/two_sided_cusum.hpp>
#include <palpate/square_root.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// Settings of Handover. drift, threshold and clip are in standard deviations of the whitened innovations: see
/// palpate.design.cusum.
template <class Real>
struct HandoverSettings {
  Real steady = Real(0.9995);          ///< forgetting factor while the ratio does not drift
  Real drift = Real(0.75);             ///< slack of the CUSUM
  Real threshold = Real(10);           ///< its limit: more than a spike, smeared by the filters, can add
  Real clip = Real(3);                 ///< limits an innovation in the CUSUM; one above it does not change the ratio
  Real smoothing = Real(0.0625);       ///< share of a new regressor in the instrument
  Real guard = Real(5);                ///< first samples after a change that a hand-over leaves out: filters smear them
  Real min_information = Real(1e-12);  ///< 1 / max_covariance: the limit where the regressor is 0

  /// As FixedForgetting::visit_fields.
  static constexpr auto visit_fields = [](auto& s, auto&& visit) noexcept {
    visit("steady", s.steady, 0 < s.steady && s.steady <= 1, "0 < steady <= 1");
    visit("drift", s.drift, 0 <= s.drift && (s.drift < s.clip || !(s.clip > 0)), "0 <= drift < clip");
    visit("threshold", s.threshold, s.threshold > 0, "0 < threshold");
    visit("clip", s.clip, 0 < s.clip && s.clip <= 100, "0 < clip <= 100");
    visit("smoothing", s.smoothing, 0 < s.smoothing && s.smoothing <= 1, "0 < smoothing <= 1");
    visit("guard", s.guard, 0 <= s.guard && s.guard <= 100, "0 <= guard <= 100");
    visit("min_information", s.min_information, s.min_information > 0, "0 < min_information");
  };
};

/// Recursive instrumental variables with a change detector that estimates the time of the change.
///
/// With x the regressor, w its instrument, the mean of the regressors before it, and e = output - x r:
///
///     R' = lambda R + w x
///     r' = r + (w / R') e
///
/// With w = x this is least squares. w is independent of the noise of x, so this noise does not bias r towards 0; nor
/// does tremor, which has a slightly smaller amplitude in x after the alignment. Where the mean is no forecast of x, as
/// around 0, w is x, and r too small by the share of the noise in the mean square of x. The detector is a two-sided CUSUM on
/// the whitened innovations, in units of their own scale: no setting is in pF. At an alarm there is a hand-over: the
/// estimate is computed from the samples since this CUSUM side was last 0, and the old ratio is forgotten at once. A
/// drift is too slow for this: it shows as an offset of the innovations, and the larger it is, the more is forgotten.
///
/// Another `Detector` has the same members as TwoSidedCusum: docs/write_your_own.md.
template <class Real, class Parameters = Kept<HandoverSettings<Real>>, class Detector = TwoSidedCusum<Real>>
class Handover : public Parameters {
  static_assert(is_real<Real>, "palpate::Handover: Real must be float or double");
  static_assert(detail::has<detail::FindsChanges, Detector> && detail::has<detail::VisitsState, Detector>,
                "palpate::Handover: a Detector needs a constructor without parameters, add(z, drift, guard, sample), "
                "statistic(), larger(), which is a CusumSide, and visit_state(visit)");

 public:
  using real_type = Real;  ///< float or double
  using Parameters::settings;
  static constexpr Real default_covariance = Real(1e10);  ///< of the initial ratio: as good as unknown, 1/pF^2
  static constexpr int warm_up = 8;                       ///< samples before the detector starts
  static constexpr int transient = 3;     ///< first innovations, dominated by the error of the initial ratio
  static constexpr int trustworthy = 16;  ///< fewest samples since the last change for a standard error

  /// With the default settings.
  constexpr Handover() noexcept : Handover(Parameters()) {}
  /// With these settings, an initial ratio and its covariance, 1/pF^2.
  constexpr explicit Handover(const Parameters& parameters, Real ratio = Real(1),
                              Real covariance = default_covariance) noexcept
      : Parameters(parameters), ratio_(ratio), sums_{Real(1) / covariance} {}

  /// One sample: the changes of both channels from their baselines, pF. What is not finite is refused, and so are
  /// magnitudes from 1e16 (float) or 1e140 (double) on.
  PALPATE_INLINE constexpr Step<Real> update(Real output, Real regressor) noexcept {
    const Real innovation = output - product(regressor, ratio_);
    if (PALPATE_UNLIKELY(!(in_range(output) && in_range(regressor) && in_range(innovation)))) {
      return detail::refusal(ratio_, innovation, alarm());
    }
    const WeightedSample<Real> sample{instrument_.weight(regressor), output, regressor};
    const Judged judged = judge(innovation, output);
    const bool drifts = noise_.drifts();
    const Counted counted = counts_as(innovation, judged, drifts);
    Next next = followed(sample, counted);
    if (PALPATE_UNLIKELY(judged.outlier && !drifts)) {
      next = {ratio_, sums_, Real(0)};
    }
    if (PALPATE_UNLIKELY(!is_finite(next.ratio))) {
      return detail::refusal(ratio_, innovation, alarm());
    }
    watch(judged, innovation, sample);
    const bool change = alarm() && !run_.differ();
    if (PALPATE_UNLIKELY(alarm())) {
      next = after_alarm(change, sample, next);
    }
    keep(next);
    learn(innovation, judged, regressor < 0, change);
    instrument_.add(regressor, seen_, settings.smoothing);
    catch_up(counted.innovation, next.gain, drifts, change);
    return {ratio(), innovation, next.gain, change, true, judged.outlier, drifts};
  }

  /// Forget all samples; the settings stay.
  constexpr void reset(Real ratio = Real(1), Real covariance = default_covariance) noexcept {
    ratio_ = ratio;
    cusum_ = {};
    sums_ = {Real(1) / covariance};
    instrument_ = {};
    seen_ = lag_ = lead_ = 0;
    noise_ = {};
    run_ = {};
  }

  /// The ratio and the sums from which it was computed, without the noise.
  struct Snapshot {
    Real ratio;       ///< the estimate r
    Sums<Real> sums;  ///< of the samples
  };
  /// The present one.
  constexpr Snapshot snapshot() const noexcept { return {ratio_, sums_}; }
  /// Go back to such an estimate; the noise stays.
  constexpr void restore(const Snapshot& snapshot) noexcept {
    ratio_ = snapshot.ratio;
    lag_ = lead_ = 0;
    sums_ = snapshot.sums;
  }

  /// As Rls::visit_state.
  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    visit(ratio_), visit(sums_.information), visit(sums_.squares), visit(sums_.count);
    cusum_.visit_state(visit);
    visit(instrument_.mean);
    noise_.visit_state(visit);
    visit(seen_), visit(run_.last), visit(run_.regressor), visit(run_.size), visit(run_.steps);
    visit(lag_), visit(lead_);
  }

  /// The estimate r; while it drifts, without the lag of the recursion.
  constexpr Real ratio() const noexcept { return ratio_ + lead_; }
  /// R, the weighted sum of w x, pF^2.
  constexpr Real information() const noexcept { return sums_.information; }
  /// 1 / R, 1/pF^2; unscaled: see standard_error().
  constexpr Real covariance() const noexcept { return Real(1) / sums_.information; }
  /// The larger CUSUM side, in standard deviations of the whitened innovations.
  constexpr Real statistic() const noexcept { return cusum_.statistic(); }
  /// Whether the last sample led to a hand-over.
  constexpr bool alarm() const noexcept { return statistic() > settings.threshold; }
  /// Sum of lambda^k over the samples from which the ratio was computed.
  constexpr Real count() const noexcept { return sums_.count; }
  /// Whether standard_error() is valid: enough samples, in total and since the last change.
  constexpr bool settled() const noexcept { return noise_.settled() && sums_.count >= trustworthy; }

  /// Variance of the innovations; 0 before the first one that is counted.
  constexpr Real innovation_variance() const noexcept { return noise_.variance(); }
  /// Sum of the squared weights over the square of their information: the variance of the ratio for white noise of
  /// variance 1.
  constexpr Real leverage() const noexcept { return sums_.squares / sums_.information / sums_.information; }
  /// Variance of the mean of many innovations, times their number, pF^2; only if settled(). With `aliases` no oscillation
  /// cancels.
  constexpr Real long_run_variance(bool aliases = false) const noexcept { return noise_.long_run_variance(aliases); }
  /// Mean square of the regressors, pF^2.
  constexpr Real mean_square() const noexcept { return sums_.information / sums_.count; }
  /// Mean of the last regressors, pF.
  constexpr Real mean_regressor() const noexcept { return instrument_.mean; }
  /// Standard error of the ratio, s sqrt(sum(w^2)) / R with s^2 the long-run variance of the innovations; only if settled(). It includes
  /// noise, tremor and its own rounding, which in float32 is larger than a noise of 13 eps of the output, not the error of the baseline
  /// (Tracker adds that). NaN if the squares of the innovations are too small or too large for Real.
  constexpr Real standard_error() const noexcept {
    const Real square = product(long_run_variance(), sums_.squares / sums_.information) / sums_.information;
    return square > 0 && is_finite(square) ? square_root(square + rounding()) : not_a_number<Real>;
  }

 private:
  /// A whitened innovation, and whether it is too large to be noise.
  struct Judged {
    Real clipped, scale;
    bool watched, outlier;
  };
  /// How an innovation counts.
  struct Counted {
    Real innovation, forgetting;
  };
  /// Outliers in a row: after a change of the ratio they are as large as their regressors, in a burst of noise they are not.
  struct OutlierRun {
    Real last = 0, regressor = 0;  // the last one
    Real size = 0, steps = 0;      // sums of magnitudes, and of steps, times a regressor, half of each before

    constexpr void add(Real innovation, Real now, bool outlier) noexcept {
      const Real step = product(innovation, regressor) - product(last, now);
      steps = outlier && size > 0 ? steps / 2 + magnitude(step) : Real(0);
      size = outlier ? size / 2 + magnitude(product(innovation, now)) : Real(0);
      last = innovation;
      regressor = now;
    }
    constexpr bool differ() const noexcept { return 3 * steps > size; }
  };
  struct Next {
    Real ratio;
    Sums<Real> sums;
    Real gain;
  };

  // Each update rounds the ratio: an error of variance u^2 / 12, u <= eps r, which is forgotten as the samples are. Of n
  // samples with lambda = 1 the sum of (j / n)^2 is left, n / 3; in the long run the sum of lambda^2j, half the count.
  constexpr Real rounding() const noexcept {
    const Real step = product(std::numeric_limits<Real>::epsilon(), ratio_);
    return product(product(step, step), sums_.count) / 24;
  }

  // Sums of products of two such numbers stay finite over any touch.
  static constexpr bool in_range(Real value) noexcept {
    constexpr Real limit = std::is_same_v<Real, float> ? Real(1e16) : Real(1e140);
    return magnitude(value) < limit;
  }

  // The scale is the mean of few magnitudes at first, and may be much too small. With 3 / n the first 64 samples have as
  // few false alarms as palpate.design.cusum promises: bench.accuracy.must_hold.
  constexpr Real scale_of(Real output) const noexcept {
    Real scale = noise_.scale();
    if (PALPATE_UNLIKELY(seen_ < 64 && seen_ >= warm_up)) {
      scale = product(scale, 1 + 3 / (seen_ - (transient - 1)));
    }
    // Data without noise still have rounding errors: a few eps of the output.
    const Real least = product(magnitude(output) + Real(1e-18), std::is_same_v<Real, float> ? Real(1e-6) : Real(1e-15));
    return scale > least ? scale : least;
  }

  constexpr Judged judge(Real innovation, Real output) const noexcept {
    const Real whitened = noise_.whitened(innovation), scale = scale_of(output);
    const Real limit = product(settings.clip, scale);
    const bool watched = seen_ >= warm_up, outlier = watched && magnitude(whitened) > limit;
    if (PALPATE_UNLIKELY(outlier)) {
      return {whitened > 0 ? limit : -limit, scale, watched, true};
    }
    return {whitened, scale, watched, false};
  }

  /// The detector, and outliers in a row. The detector starts again after an alarm. A larger ratio gives innovations of the
  /// regressor's sign.
  PALPATE_INLINE constexpr void watch(const Judged& judged, Real innovation,
                                      const WeightedSample<Real>& sample) noexcept {
    if (PALPATE_UNLIKELY(alarm())) {
      cusum_ = {};
    }
    if (PALPATE_LIKELY(judged.watched)) {
      const Real z = judged.clipped / judged.scale;
      cusum_.add(PALPATE_UNLIKELY(sample.regressor < 0) ? -z : z, settings.drift, settings.guard, sample);
    }
    if (PALPATE_UNLIKELY(judged.outlier) || PALPATE_UNLIKELY(run_.size > 0)) {
      run_.add(innovation, sample.regressor, judged.outlier);
    }
  }

  /// How the innovation counts: as itself, unless it is an outlier or the ratio drifts.
  PALPATE_INLINE constexpr Counted counts_as(Real innovation, const Judged& judged, bool drifts) const noexcept {
    Counted counted{innovation, settings.steady};
    if (PALPATE_UNLIKELY(judged.outlier) || PALPATE_UNLIKELY(drifts)) {
      counted = unusual(counted, judged, drifts);
    }
    return counted;
  }

  /// An outlier does not change the ratio. But if the ratio drifts, it may be real: it counts as far as noise could go.
  constexpr Counted unusual(const Counted& usual, const Judged& judged, bool drifts) const noexcept {
    return {judged.outlier ? noise_.limited_innovation(judged.clipped) : usual.innovation,
            drifts ? drifting() : usual.forgetting};
  }

  /// R' = lambda R + w x,  r' = r + (w / R') e.
  constexpr Next followed(const WeightedSample<Real>& s, const Counted& counted) const noexcept {
    const Real forgetting = counted.forgetting;
    const Real added = product(s.weight, s.regressor), left = product(forgetting, sums_.information);
    const Real information = added > 0 ? left + added : bounded(left);
    const Real gain = s.weight / information;
    const Real squares = product(product(forgetting, forgetting), sums_.squares) + product(s.weight, s.weight);
    return {
        ratio_ + product(gain, counted.innovation), {information, squares, product(forgetting, sums_.count) + 1}, gain};
  }

  /// Forgetting factor with which a sample as large as the last ones has at least the share K that the drift needs:
  /// lambda R = (1 / K - 1) mean(x)^2.
  constexpr Real drifting() const noexcept {
    const Real most = recent_square() * (1 / noise_.least_share() - 1) / sums_.information;
    return most < settings.steady ? most : settings.steady;
  }

  /// Square of the mean of the last regressors; where their signs differ, the mean of squares.
  constexpr Real recent_square() const noexcept {
    const Real one_sign = product(instrument_.mean, instrument_.mean), any = sums_.squares / sums_.count;
    return one_sign > any ? one_sign : any;
  }

  /// The lag, while there is one.
  PALPATE_INLINE constexpr void catch_up(Real innovation, Real gain, bool drifts, bool change) noexcept {
    if (PALPATE_UNLIKELY(drifts || lag_ != 0)) {
      follow_lag(innovation, gain, drifts && !change);
    }
  }

  /// While the ratio drifts, r is behind it: the innovations have a mean, of which the next share K = (w / R') x is not yet
  /// corrected. It is taken over as many of them as K is of one.
  constexpr void follow_lag(Real innovation, Real gain, bool drifts) noexcept {
    if (drifts) {
      noise_.expect_drift();
    }
    const Real mean = instrument_.mean, given = product(gain, mean);
    const Real share = given < 1 ? positive_part(given) : Real(1);
    const Real lag = lag_ + product(share, innovation - lag_), lead = product(1 - share, lag) * mean / recent_square();
    const bool known = drifts && noise_.mature() && is_finite(ratio_ + lead);
    lag_ = known ? lag : Real(0);
    lead_ = known ? lead : Real(0);
  }

  /// A change hands over. An alarm by outliers that differ is a burst of noise: the detector starts again.
  constexpr Next after_alarm(bool change, const WeightedSample<Real>& sample, const Next& usual) noexcept {
    if (!change) {
      cusum_ = {};
      return usual;
    }
    return handed_over(cusum_.larger(), sample, usual);
  }

  /// Hand-over: the ratio from the samples since the change, sum(w y) / sum(w x); at least from the last one. Beyond the
  /// range of Real: as without a change.
  constexpr Next handed_over(const CusumSide<Real>& side, const WeightedSample<Real>& s,
                             const Next& usual) const noexcept {
    const CusumSide<Real> since = side.sums.count > 0 ? side : alone(s);
    const Real ratio = since.weighted_output / since.sums.information;
    return is_finite(ratio) ? Next{ratio, since.sums, Real(0)} : usual;
  }

  PALPATE_INLINE constexpr void keep(const Next& next) noexcept {
    ratio_ = next.ratio;
    sums_ = next.sums;
  }

  /// Update the noise model, which starts again at a change.
  PALPATE_INLINE constexpr void learn(Real innovation, const Judged& judged, bool negative, bool change) noexcept {
    seen_ += 1;
    if (PALPATE_LIKELY(seen_ > transient)) {
      noise_.add_magnitude(judged.clipped, seen_ - transient);
      if (PALPATE_UNLIKELY(judged.outlier)) {
        noise_.skip(judged.clipped, negative);
      } else {
        noise_.add(innovation, negative, seen_ < 32);
      }
    }
    if (PALPATE_UNLIKELY(change)) {
      noise_.restart();
    }
  }

  constexpr Real bounded(Real information) const noexcept {
    const Real least = sums_.information < settings.min_information ? sums_.information : settings.min_information;
    return information > least ? information : least;
  }

  Real ratio_;
  Detector cusum_{};
  Sums<Real> sums_;
  InstrumentalVariable<Real> instrument_;
  Real seen_ = 0;
  NoiseModel<Real> noise_;
  OutlierRun run_{};
  Real lag_ = 0, lead_ = 0;  // while the ratio drifts: the mean innovation, and what it adds to the ratio
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
