// SPDX-License-Identifier: MIT
#pragma once

// The ratio of any two signals, from windows that adapt: a CUSUM for what is large and fast, windows for what is small or slow.

#include <palpate/estimator/dyadic_windows.hpp>
#include <palpate/estimator/instrument.hpp>
#include <palpate/estimator/outlier_run.hpp>
#include <palpate/estimator/rls.hpp>
#include <palpate/estimator/short_memory.hpp>
#include <palpate/estimator/student.hpp>
#include <palpate/estimator/two_sided_cusum.hpp>
#include <palpate/estimator/unsuspected_noise.hpp>
#include <palpate/square_root.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// Settings of AdaptiveWindow, in standard deviations of the whitened innovations: see palpate.design.cusum.
template <class Real>
struct AdaptiveWindowSettings {
  Real drift = Real(0.75);        ///< slack of the CUSUM
  Real threshold = Real(11);      ///< its limit
  Real cut = Real(5);             ///< normal deviate of the difference at which older samples are cut
  Real clip = Real(3);            ///< limits an innovation in the CUSUM; one above it does not change the ratio
  Real smoothing = Real(0.0625);  ///< share of a new regressor in the instrument
  Real guard = Real(0);           ///< first samples after a change that a hand-over leaves out: filters smear them

  /// As FixedForgetting::visit_fields.
  static constexpr auto visit_fields = [](auto& s, auto&& visit) noexcept {
    visit("drift", s.drift, 0 <= s.drift && (s.drift < s.clip || !(s.clip > 0)), "0 <= drift < clip");
    visit("threshold", s.threshold, s.threshold > 0, "0 < threshold");
    visit("cut", s.cut, s.cut > 0, "0 < cut");
    visit("clip", s.clip, 1 <= s.clip && s.clip <= 100, "1 <= clip <= 100");
    visit("smoothing", s.smoothing, 0 < s.smoothing && s.smoothing <= 1, "0 < smoothing <= 1");
    visit("guard", s.guard, 0 <= s.guard && s.guard <= 100, "0 <= guard <= 100");
  };
};

/// The ratio r in y = r x + e, for any two signals, with a standard error, and two detectors of a change.
///
/// With x the regressor, w its instrument, and R the sum of w x over a window of the newest samples, r = sum of w y / R. Windows of all
/// sizes are compared as the samples come in: DyadicWindows. What changes the ratio faster than these can tell is found by a two-sided
/// CUSUM on the whitened innovations, in units of their own scale: no setting is in pF. At its alarm there is a hand-over: only the
/// samples since this CUSUM side was last 0 are left. A ratio that moves within a few samples is followed by a ShortMemory.
template <class Real, class Parameters = Kept<AdaptiveWindowSettings<Real>>, class Windows = DyadicWindows<Real>>
class AdaptiveWindow : public Parameters {
  static_assert(is_real<Real>, "palpate::AdaptiveWindow: Real must be float or double");

 public:
  using real_type = Real;  ///< float or double
  using Parameters::settings;
  static constexpr Real default_covariance = Real(1e10);  ///< of the initial ratio, which says nothing, 1/pF^2
  static constexpr int warm_up = 8;                       ///< samples before the detector starts
  static constexpr int transient = 3;              ///< first innovations, dominated by the error of the initial ratio
  static constexpr int first = 16;                 ///< samples in which nothing is suspected
  static constexpr Real still_usual = Real(0.98);  ///< of the usual information, for each sample with less
  static constexpr Real suspicion = 1;             ///< a side of the CUSUM above it: noise is not learned

  /// With the default settings.
  constexpr AdaptiveWindow() noexcept : AdaptiveWindow(Parameters()) {}
  /// With these settings, and a ratio until the first sample with a regressor.
  constexpr explicit AdaptiveWindow(const Parameters& parameters, Real ratio = Real(1)) noexcept
      : Parameters(parameters), ratio_(ratio), windows_(ratio) {}

  /// One sample. What is not finite is refused, and so are magnitudes from 1e16 (float) or 1e140 (double) on. A regressor below
  /// 1e-18 (float) or 1e-139 (double) counts as 0.
  PALPATE_INLINE constexpr Step<Real> update(Real output, Real given) noexcept {
    const Real regressor = PALPATE_LIKELY(magnitude(given) >= least_regressor) || !is_finite(given) ? given : Real(0);
    const Real innovation = output - product(regressor, ratio_);
    if (PALPATE_UNLIKELY(!(acceptable(output, regressor) && in_range(innovation)))) {
      return detail::refusal(ratio_, innovation, alarm());
    }
    const WeightedSample<Real> sample{instrument_.weight(regressor), output, regressor};
    if (PALPATE_UNLIKELY(!windows_.excited())) {
      begin(sample);
    }
    taken_ += 1;
    if (PALPATE_UNLIKELY(!tells(sample))) {
      return pass(innovation);
    }
    return follow(sample, innovation);
  }

  /// Forget all samples; the settings stay. The covariance of the ratio has no effect: the first sample replaces it.
  constexpr void reset(Real ratio = Real(1), Real = default_covariance) noexcept {
    *this = AdaptiveWindow(static_cast<const Parameters&>(*this), ratio);
  }

  /// Whether a state that was not computed here, but set by visit_state, can be one.
  constexpr bool possible() const noexcept { return windows_.possible() && noise_.possible() && statistic() >= 0; }
  /// As Rls::visit_state.
  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    visit(ratio_), visit(earlier_), visit(alarm_), visit(taken_), visit(seen_), visit(changed_),
        visit(usual_information_), visit(mean_square_), visit(claimed_output_), visit(claimed_regressor_),
        visit(instrument_.mean);
    cusum_.visit_state(visit);
    noise_.visit_state(visit);
    run_.visit_state(visit);
    memory_.visit_state(visit);
    windows_.visit_state(visit);
  }

  /// The estimate r.
  constexpr Real ratio() const noexcept { return ratio_; }
  /// R, the sum of w x over the window, pF^2.
  constexpr Real information() const noexcept { return windows_.information(); }
  /// 1 / R, 1/pF^2, infinite before the first regressor; unscaled: see standard_error().
  constexpr Real covariance() const noexcept {
    return windows_.excited() ? windows_.covariance() : std::numeric_limits<Real>::infinity();
  }
  /// The larger CUSUM side, in standard deviations of the whitened innovations.
  constexpr Real statistic() const noexcept { return cusum_.statistic(); }
  /// Whether the last sample showed a change: by the CUSUM, by the windows, or as one of many outliers in a row.
  constexpr bool alarm() const noexcept { return alarm_ > 0; }
  /// Samples since the last change began, about; all samples, if there was none.
  constexpr Real since_change() const noexcept { return taken_ - changed_; }
  /// Variance of the innovations, pF^2; 0 before the first one that is counted.
  constexpr Real innovation_variance() const noexcept { return noise_.variance(); }
  /// Samples from which the ratio was computed, about.
  constexpr Real count() const noexcept { return memory_.is_read() ? Real(1) : information() / mean_square_; }
  /// How far the ratio moves from sample to sample; 0 where it is at rest.
  constexpr Real motion() const noexcept { return memory_.is_read() || windows_.moves() ? memory_.trend() : Real(0); }
  /// Mean of the last regressors, pF.
  constexpr Real mean_regressor() const noexcept { return instrument_.mean; }
  /// Mean square of the regressors, pF^2.
  constexpr Real mean_square() const noexcept { return mean_square_; }
  /// Whether there may be a standard error.
  constexpr bool settled() const noexcept { return windows_.excited(); }
  /// Standard error of the ratio: +-1.96 of it is the 95 % interval, which is wider than normal where few blocks show the noise. NaN
  /// until four of them do.
  constexpr Real standard_error() const noexcept {
    const Real rounded = product(std::numeric_limits<Real>::epsilon(), ratio_) / 2;
    const Real square = (memory_.is_read() ? of_memory() : of_windows()) + product(rounded, rounded);
    return square >= 0 && is_finite(square) ? square_root(square) : not_a_number<Real>;
  }

 private:
  static constexpr bool is_float = std::is_same_v<Real, float>;
  static constexpr Real largest =
      is_float ? Real(1e16) : Real(1e140);  // sums of products of two such numbers stay finite
  static constexpr Real least_regressor = is_float ? Real(1e-18) : Real(1e-139);
  static constexpr Real normal_square = Real(3.8416);  // 1.96^2

  /// A whitened innovation, limited; the innovation that belongs to it; whether the ratio may not depend on it.
  struct Judged {
    Real limited, counted, scale;
    bool watched, outlier;
  };

  static constexpr Real information_of(const WeightedSample<Real>& sample) noexcept {
    return product(sample.weight, sample.regressor);
  }
  /// Whether a sample says something of the ratio: its regressor is at least an eighth of the usual one. Others, as between two
  /// pulses, are noise over noise.
  constexpr bool tells(const WeightedSample<Real>& sample) const noexcept {
    const Real information = information_of(sample);
    return information > 0 && 64 * information >= usual_information_;
  }
  /// Leave out a sample that says nothing; but many of them are the usual ones.
  constexpr Step<Real> pass(Real innovation) noexcept {
    usual_information_ = normal_or_0(product(still_usual, usual_information_));
    after_alarm();
    return {ratio_, innovation, Real(0), false, true, false, memory_.is_read()};
  }

  static constexpr bool in_range(Real value) noexcept { return magnitude(value) < largest; }
  constexpr bool acceptable(Real output, Real regressor) const noexcept {
    return in_range(output) && in_range(regressor) && in_range(output - product(windows_.held(), regressor)) &&
           in_range(output - product(windows_.ratio(), regressor));
  }

  /// The first sample with a regressor.
  constexpr void begin(const WeightedSample<Real>& sample) noexcept {
    if (sample.regressor != 0) {
      windows_.expect(sample.output / sample.regressor);
      memory_.restart(windows_.ratio(), 0);
    }
  }

  // The scale is the mean of few magnitudes at first, and may be much too small.
  constexpr Real scale_of(const WeightedSample<Real>& sample) const noexcept {
    Real scale = noise_.scale();
    if (PALPATE_UNLIKELY(seen_ < 64 && seen_ >= warm_up)) {
      scale = product(scale, 1 + 3 / (seen_ - (transient - 1)));
    }
    // Data without noise still have rounding errors: a few eps of the output.
    const Real predicted = product(ratio_, sample.regressor);
    const Real size = magnitude(sample.output) > magnitude(predicted) ? magnitude(sample.output) : magnitude(predicted);
    const Real least = product(size, is_float ? Real(1e-6) : Real(1e-15));
    return scale > least ? scale : least;
  }

  PALPATE_INLINE constexpr Judged judge(Real innovation, const WeightedSample<Real>& sample) const noexcept {
    const Real whitened = noise_.whitened(innovation), scale = scale_of(sample), limit = product(settings.clip, scale);
    const bool watched = seen_ >= warm_up;
    if (PALPATE_LIKELY(!watched || !(magnitude(whitened) > limit))) {
      return {whitened, innovation, scale, watched, false};
    }
    const Real limited = whitened > 0 ? limit : -limit;
    return {limited, noise_.of_whitened(limited), scale, true, is_outlier(whitened, limit, sample)};
  }
  /// A sample may be as far from the ratio of those before it as that is uncertain.
  constexpr bool is_outlier(Real whitened, Real limit, const WeightedSample<Real>& sample) const noexcept {
    const Real leverage = leverage_of(sample);
    const bool far = windows_.excited() && product(whitened / limit, whitened / limit) > 1 + leverage;
    return far && !(leverage >= 1 && is_confirmed(limit, sample));
  }
  /// Information of a sample, as a share of that of all before it.
  constexpr Real leverage_of(const WeightedSample<Real>& sample) const noexcept {
    return product(information_of(sample), windows_.covariance());
  }
  /// Whether it has the ratio of the last outlier that had more information than all before it. One alone may be a false reading, two that
  /// agree are the first pulses after noise.
  constexpr bool is_confirmed(Real limit, const WeightedSample<Real>& sample) const noexcept {
    if (claimed_regressor_ == 0) {
      return false;
    }
    const Real expected = product(claimed_output_ / claimed_regressor_, sample.regressor);
    return magnitude(sample.output - expected) <= 2 * limit;
  }

  /// The detector starts again.
  PALPATE_INLINE constexpr void after_alarm() noexcept {
    if (PALPATE_UNLIKELY(alarm())) {
      cusum_ = {};
      alarm_ = 0;
    }
  }
  /// The detector, and outliers in a row. A larger ratio gives innovations of the
  /// regressor's sign.
  PALPATE_INLINE constexpr void watch(const Judged& judged, Real innovation,
                                      const WeightedSample<Real>& sample) noexcept {
    after_alarm();
    if (PALPATE_LIKELY(judged.watched)) {
      const Real z = judged.scale > 0 ? judged.limited / judged.scale : Real(0);
      cusum_.add(PALPATE_UNLIKELY(sample.regressor < 0) ? -z : z, settings.drift, settings.guard, sample);
    }
    run_.add(innovation, sample, judged.outlier);
  }

  /// Judge a sample, follow it, and learn the noise.
  PALPATE_INLINE constexpr Step<Real> follow(const WeightedSample<Real>& sample, Real innovation) noexcept {
    const Judged judged = judge(innovation, sample);
    const WeightedSample<Real> before = run_.last();
    watch(judged, innovation, sample);
    seen_ += 1;
    remember(sample, judged);
    take(judged, sample, before);
    learn(judged, sample);
    note_claim(judged, sample);
    memory_.choose(sample.regressor, before.regressor, seen_);
    instrument_.add(sample.regressor, seen_, settings.smoothing);
    ratio_ = memory_.is_read() ? memory_.ratio() : windows_.ratio();
    const Real gain = judged.outlier ? Real(0) : product(sample.weight, windows_.covariance());
    return {ratio_, innovation, gain, alarm(), true, judged.outlier, memory_.is_read()};
  }

  /// Add the sample to the short memory. Of outliers the third in a row, as a slide may begin.
  PALPATE_INLINE constexpr void remember(const WeightedSample<Real>& sample, const Judged& judged) noexcept {
    if (PALPATE_UNLIKELY(judged.outlier && !(run_.count() > 2) && !memory_.is_read())) {
      return;
    }
    const Real most =
        judged.watched ? product(product(Real(100), judged.scale), judged.scale) : product(largest, largest);
    memory_.add(sample, windows_.ratio(), most, seen_);
  }

  /// Hand over at an alarm; otherwise add the sample to the windows, unless it is an outlier.
  PALPATE_INLINE constexpr void take(const Judged& judged, const WeightedSample<Real>& sample,
                                     const WeightedSample<Real>& before) noexcept {
    if (PALPATE_UNLIKELY(cusum_.statistic() > settings.threshold) || PALPATE_UNLIKELY(run_.is_slide())) {
      take_change(judged, sample, before);
    } else if (PALPATE_LIKELY(!judged.outlier)) {
      add(sample);
    }
  }
  PALPATE_INLINE constexpr void add(const WeightedSample<Real>& sample) noexcept {
    if (PALPATE_UNLIKELY(windows_.add(sample, !memory_.is_read(), product(settings.cut, settings.cut)))) {
      alarm_ = 1;
      changed_ = taken_ - windows_.samples();
    }
    const Real information = information_of(sample);
    count_usual(information);
    mean_square_ += product(product(information, windows_.covariance()), information - mean_square_);
  }
  /// The usual information: a mean, in which a sample with more counts more. After noise the first pulses are the usual ones at once, but
  /// one sample alone does not make all others unusual.
  PALPATE_INLINE constexpr void count_usual(Real information) noexcept {
    if (PALPATE_UNLIKELY(information > 64 * usual_information_)) {
      usual_information_ = usual_information_ > 0 ? 32 * usual_information_ : information;
      return;
    }
    const Real share = information / (information + 16 * usual_information_);
    usual_information_ += product(share, information - usual_information_);
  }
  /// An alarm by outliers that differ is a burst of noise: the detector starts again.
  constexpr void take_change(const Judged& judged, const WeightedSample<Real>& sample,
                             const WeightedSample<Real>& before) noexcept {
    if (run_.is_burst()) {
      cusum_ = {};
      return;
    }
    if (run_.is_slide() && is_finite(settings.threshold)) {
      CusumSide<Real> last_two = alone(sample);
      last_two.age = 2;
      last_two.weighted_output += product(before.weight, before.output);
      last_two.sums.information += product(before.weight, before.regressor);
      hand_over(last_two, sample);
    } else if (cusum_.statistic() > settings.threshold) {
      hand_over(cusum_.larger(), sample);
    } else if (!judged.outlier) {
      add(sample);
    }
  }
  /// The ratio from the samples since the change, sum(w y) / sum(w x); at least from the last one.
  constexpr void hand_over(const CusumSide<Real>& side, const WeightedSample<Real>& sample) noexcept {
    const CusumSide<Real> since = side.sums.information > 0 ? side : alone(sample);
    const Real ratio = since.weighted_output / since.sums.information;
    alarm_ = 1;
    if (is_finite(ratio)) {
      note_change(windows_.ratio(), ratio);
      windows_.restart(ratio, since.sums.information);
      memory_.restart(ratio, since.sums.information);
      changed_ = taken_ - side.age;
      run_.begin_anew();
    }
  }

  /// A ratio that comes back was no change: the noise learns what waits. Otherwise an offset of the output, which looks like a larger
  /// ratio and like a smaller one in turn, would be an alarm at each change of the regressor's sign.
  constexpr void note_change(Real before, Real after) noexcept {
    if (2 * magnitude(after - earlier_) < magnitude(after - before)) {
      noise_.accept(seen_ - transient);
    }
    earlier_ = before;
  }

  /// Update the noise model: not while a change is suspected.
  PALPATE_INLINE constexpr void learn(const Judged& judged, const WeightedSample<Real>& sample) noexcept {
    if (PALPATE_UNLIKELY(alarm())) {
      noise_.forget_waiting();
    } else if (PALPATE_LIKELY(seen_ > transient)) {
      learn_from(judged, sample.regressor < 0);
    }
    noise_.remember(PALPATE_UNLIKELY(alarm()) ? Real(0) : judged.counted);
  }
  PALPATE_INLINE constexpr void learn_from(const Judged& judged, bool negative) noexcept {
    const bool suspected = seen_ >= first && cusum_.statistic() > suspicion;
    noise_.add(judged.limited, judged.counted, (judged.limited > 0) != negative, judged.outlier, suspected,
               seen_ - transient);
  }

  constexpr void note_claim(const Judged& judged, const WeightedSample<Real>& sample) noexcept {
    if (PALPATE_UNLIKELY(judged.outlier && leverage_of(sample) >= 1)) {
      claimed_output_ = sample.output;
      claimed_regressor_ = sample.regressor;
    }
  }

  constexpr Real of_windows() const noexcept {
    const RatioVariance<Real> variance = windows_.variance();
    if (!(variance.degrees_of_freedom >= Windows::fewest)) {
      return not_a_number<Real>;
    }
    const Real widening = detail::student_square(normal_square, variance.degrees_of_freedom) / normal_square;
    return product(variance.noise, widening) + variance.moved;
  }
  /// Of the ratio of the short memory: as large as what it did not predict, by the larger one of the last regressor and their mean.
  constexpr Real of_memory() const noexcept {
    const Real last = magnitude(run_.last().regressor), mean = magnitude(instrument_.mean);
    const Real regressor = last > mean ? last : mean;
    return memory_.miss() / regressor / regressor;
  }

  Real ratio_, earlier_ = 0;  // now; before the last change
  Real alarm_ = 0;
  Real taken_ = 0, seen_ = 0, changed_ = 0;          // samples; those that say something; those before the last change
  Real usual_information_ = 0;                       // of a sample
  Real mean_square_ = 0;                             // the same in the window: the mean, weighted with the information
  Real claimed_output_ = 0, claimed_regressor_ = 0;  // of the last outlier with more information than all before it
  InstrumentalVariable<Real> instrument_;
  TwoSidedCusum<Real> cusum_{};
  UnsuspectedNoise<Real> noise_;
  OutlierRun<Real> run_;
  ShortMemory<Real> memory_;
  Windows windows_;
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
