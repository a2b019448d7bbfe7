// SPDX-License-Identifier: MIT
#pragma once

// The baseline after a touch: what the baseline did during the touch, and what that did to the ratio.

#include <palpate/estimate.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// What the baseline after a touch says about it.
enum class Revision : std::uint8_t {
  none,      ///< it is not known
  drift,     ///< the ratio is corrected for the change of the baseline
  creep,     ///< a channel recovers after the release: the ratio is not corrected
  baseline,  ///< the baseline before the touch was measured in contact: the ratio is not corrected
};

/// What a touch itself shows of how its baselines moved: its drift, and a ratio that a constant offset does not change.
template <class Real>
struct TouchEvidence {
  Real drift = 0;          ///< change of the output during `length`, share of it
  Real drift_error = 0;    ///< standard error of the drift; 0: not known
  Real length = 0;         ///< of the samples that show the drift, readings
  Estimate<Real> level{};  ///< ratio over the swept depth

  /// Whether the level ratio is so far from one ratio and so near to another one.
  constexpr bool decides(Real far, Real near) const noexcept {
    return far > 3 * level.standard_error && far > 3 * near;
  }
};

/// With D the straight line between the baselines before and after, taken at the mean time of the samples,
///   r' = r - (D_hard - r D_soft) / x,   x the mean regressor.
/// If the baselines differ by less than three standard deviations, D is their mean with the smallest variance. Without a drift, what
/// both errors do not explain is left open.
///
/// A baseline may also step when the probe makes contact or is lifted, since hand and cable move then. A change that is even
/// gives a drift within the touch; the share of it that is missing was a step. D of a step is all of it at the contact and 0 at the
/// release. The level ratio decides which if it is near to one of the two; else D is half of it, and the rest is left open.
template <class Real>
class Reviser {
 public:
  struct Result {
    Revision kind = Revision::none;
    Real shift = 0, variance = 0, open = 0;  // of the ratio; of the baselines at that time; left open, of the ratio
    bool significant = false;                // the shift
  };

  constexpr void begin(std::size_t reading) noexcept {
    mean_age_ = 0;
    last_ = reading;
    changed_ = waits_ = false;
  }

  /// After each sample: the mean age of the samples in readings, with the weights of the estimator, whose sum is `count`;
  /// `counts`: this sample is one of them. Those that a hand-over kept count as the last readings.
  constexpr void follow(std::size_t reading, Real count, bool change, bool counts) noexcept {
    const Real older = mean_age_ + static_cast<Real>(reading - last_);
    mean_age_ = change ? (count - 1) / 2 : counts ? product(older, 1 - 1 / count) : older;
    changed_ = changed_ || change;
    last_ = reading;
  }

  /// The baselines before the touch, when those after it are about to be measured; `slow`: variances by slow noise.
  template <class Baseline>
  constexpr void keep(const Baseline& hard, const Baseline& soft, Real slow_hard, Real slow_soft,
                      std::size_t start) noexcept {
    hard_ = {hard.level(), hard.variance(), hard.age(), hard.noise(), slow_hard};
    soft_ = {soft.level(), soft.variance(), soft.age(), soft.noise(), slow_soft};
    start_ = start;
    waits_ = true;
  }
  constexpr void drop() noexcept { waits_ = false; }
  constexpr bool waits() const noexcept { return waits_; }

  template <class Baseline>
  constexpr Result result(const Baseline& hard, const Baseline& soft, std::size_t reading, Real ratio, Real mean,
                          const TouchEvidence<Real>& evidence) noexcept {
    waits_ = false;
    const Real rise_hard = hard.level() - hard_.level, rise_soft = soft.level() - soft_.level;
    const Real rise = product(ratio, rise_soft) - rise_hard, rise2 = product(rise, rise);
    const Real ratio2 = product(ratio, ratio), slow = hard_.slow + product(ratio2, soft_.slow);
    const Real first = hard_.variance + product(ratio2, soft_.variance);
    const Real second = hard.variance() + product(ratio2, soft.variance());
    const Real before = first + slow, after = second + slow;
    const bool drifted = rise2 > 9 * (before + after);
    Result found;
    found.kind = kind_of(hard, soft, rise_hard, rise_soft, product(ratio + 1, mean));
    found.significant = rise2 > 64 * (before + after);
    found.variance = before;
    const Line line = when(reading, hard.age());
    const Real without_step = rise2 > 9 * (first + second) ? line.middle : first / (first + second);
    const bool steps = found.kind == Revision::drift && drifted;
    const Share share = steps ? with_steps(line, rise / mean, ratio, evidence) : Share{without_step, Real(0)};
    const Real part = share.part, rest = 1 - part, open = product(share.open, rise / mean);
    found.shift = product(part, rise) / mean;
    found.open = product(found.shift, found.shift);
    if (found.kind == Revision::drift) {
      found.variance = product(product(rest, rest), before) + product(product(part, part), after);
      found.open = drifted ? open_after_drift(found) + product(open, open)
                           : product(product(part, rest), positive_part(rise2 - before - after)) / product(mean, mean);
    }
    return found;
  }

 private:
  struct Before {
    Real level, variance, age, noise, slow;
  };

  // A choice: after a fall by a twentieth of the press the baseline before it was no baseline; smaller falls are a drift,
  // and corrected.
  template <class Baseline>
  constexpr Revision kind_of(const Baseline& hard, const Baseline& soft, Real rise_hard, Real rise_soft,
                             Real height) const noexcept {
    if (-(rise_hard + rise_soft) > product(Real(0.05), height)) {
      return Revision::baseline;
    }
    const bool creeps = recovers(hard, rise_hard, hard_) || recovers(soft, rise_soft, soft_);
    return creeps ? Revision::creep : Revision::drift;
  }

  // Half of the correction is open for a jump, which was a change of the ratio, and for a walk; a quarter for an exponential,
  // where it is large enough for a flag. Both are squared.
  PALPATE_INLINE constexpr Real open_after_drift(const Result& found) const noexcept {
    return changed_ || !found.significant ? found.open / 4 : found.open / 16;
  }

  /// The line between the baselines: the place of the mean time of the samples on it, and its length in readings.
  struct Line {
    Real middle, all;
  };
  /// Of the change of the baselines: what is corrected, and what is left open.
  struct Share {
    Real part, open;
  };

  constexpr Line when(std::size_t reading, Real age) const noexcept {
    const Real touch = static_cast<Real>(last_ - start_) - mean_age_ + hard_.age;
    const Real all = static_cast<Real>(reading - start_) - age + hard_.age;
    return {touch < all ? touch / all : Real(1), all};
  }

  // `whole`: of the ratio, if the baselines had changed at the contact. Half of the expected drift shows an even change: the age of
  // a baseline that drifts is known no better. The level ratio decides between the two steps: it must be more than 3
  // standard errors away from one of them, and 3 times as near to the other one. After a tilt it is far from both.
  static constexpr Share with_steps(const Line& line, Real whole, Real ratio,
                                    const TouchEvidence<Real>& evidence) noexcept {
    const Real half = product(evidence.length, whole) / (-2 * product(ratio, line.all));
    const bool known = evidence.drift_error > 0 && half != 0;
    if (known && evidence.drift / half < -3 * evidence.drift_error / magnitude(half)) {
      return {line.middle, Real(0.5)};  // the object or the probe drifts, and the level ratio does, too
    }
    const Real even = known ? limited(evidence.drift / half) : Real(1), step = 1 - even;
    const Real error = known ? limited(evidence.drift_error / magnitude(2 * half)) : Real(1);
    const Real open = step > error ? step : error;
    const Real release = product(even, line.middle), contact = release + step;
    const Real off = evidence.level.ratio - ratio;
    const Real from_release = magnitude(off - product(release, whole));
    const Real from_contact = magnitude(off - product(contact, whole));
    if (evidence.decides(from_contact, from_release)) {
      return {release, open / 6};
    }
    if (evidence.decides(from_release, from_contact)) {
      return {contact, open / 6};
    }
    return {release + step / 2, open / 2};
  }

  static constexpr Real limited(Real share) noexcept {
    const Real least = positive_part(share);
    return least > 1 ? Real(1) : least;
  }

  // The slope after the touch is against the rise, by more than 4 of its standard errors.
  template <class Baseline>
  constexpr bool recovers(const Baseline& after, Real rise, const Before& before) const noexcept {
    const Real fall = after.recovery();  // from the median of the earlier 16 values to that of the later ones
    // The standard error of the difference of two medians of 16 is sqrt(2) sqrt(pi / 2) / sqrt(16) = 0.443 of the noise.
    return product(fall, rise) < 0 && magnitude(fall) > product(Real(1.77), before.noise) &&
           product(rise, rise) > 16 * (after.variance() + before.variance);
  }

  Before hard_{}, soft_{};
  Real mean_age_ = 0;
  std::size_t last_ = 0, start_ = 0;
  bool waits_ = false;
  bool changed_ = false;  // the ratio, in the touch
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
