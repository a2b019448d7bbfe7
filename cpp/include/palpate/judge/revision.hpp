// SPDX-License-Identifier: MIT
#pragma once

// The baseline after a touch: what the baseline did during the touch, and what that did to the ratio.

#include <palpate/arithmetic.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// What the baseline after a touch says about it.
enum class Revision : std::uint8_t {
  none,      ///< it is not known
  drift,     ///< the ratio is corrected for the change of the baseline
  creep,     ///< a channel recovers after the release: the ratio is not corrected
  baseline,  ///< the baseline before the touch was measured in contact: the ratio is not corrected
};

/// With D the straight line between the baselines before and after, taken at the mean time of the samples,
///   r' = r - (D_hard - r D_soft) / x,   x the mean regressor.
/// If the baselines differ by less than three standard deviations, D is their mean with the smallest variance.
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

  /// The baselines before the touch, when those after it are about to be measured.
  template <class Baseline>
  constexpr void keep(const Baseline& hard, const Baseline& soft, std::size_t start) noexcept {
    hard_ = {hard.level(), hard.variance(), hard.age(), hard.noise()};
    soft_ = {soft.level(), soft.variance(), soft.age(), soft.noise()};
    start_ = start;
    waits_ = true;
  }
  constexpr void drop() noexcept { waits_ = false; }
  constexpr bool waits() const noexcept { return waits_; }

  template <class Baseline>
  constexpr Result result(const Baseline& hard, const Baseline& soft, std::size_t reading, Real ratio,
                          Real mean) noexcept {
    waits_ = false;
    const Real rise_hard = hard.level() - hard_.level, rise_soft = soft.level() - soft_.level;
    const Real rise = product(ratio, rise_soft) - rise_hard, rise2 = product(rise, rise);
    const Real before = hard_.variance + product(product(ratio, ratio), soft_.variance);
    const Real after = hard.variance() + product(product(ratio, ratio), soft.variance());
    const bool drifted = rise2 > 9 * (before + after);
    // Without a drift the mean of both baselines with the smallest variance.
    const Real part = drifted ? when(reading, hard.age()) : before / (before + after);
    Result found;
    found.shift = product(part, rise) / mean;
    found.significant = rise2 > 64 * (before + after);
    const Real fall = -(rise_hard + rise_soft), height = product(ratio + 1, mean), rest = 1 - part;
    found.open = product(found.shift, found.shift);
    const bool creeps = recovers(hard, rise_hard, hard_) || recovers(soft, rise_soft, soft_);
    // A choice: after a fall by a twentieth of the press the baseline before it was no baseline; smaller falls are a drift,
    // and corrected.
    found.kind = fall > product(Real(0.05), height) ? Revision::baseline : creeps ? Revision::creep : Revision::drift;
    found.variance = before;
    if (found.kind == Revision::drift) {
      found.variance = product(product(rest, rest), before) + product(product(part, part), after);
      // What both errors do not explain is drift or noise that is slow.
      const Real excess = rise2 > before + after ? rise2 - before - after : Real(0);
      found.open = drifted ? open_after_drift(found) : product(product(part, rest), excess) / product(mean, mean);
    }
    return found;
  }

 private:
  struct Before {
    Real level, variance, age, noise;
  };

  // Half of the correction is open for a jump, which was a change of the ratio, and for a walk; a quarter for an exponential,
  // where it is large enough for a flag. Both are squared.
  PALPATE_INLINE constexpr Real open_after_drift(const Result& found) const noexcept {
    return changed_ || !found.significant ? found.open / 4 : found.open / 16;
  }

  // The part of the line at the mean time of the samples.
  constexpr Real when(std::size_t reading, Real age) const noexcept {
    const Real touch = static_cast<Real>(last_ - start_) - mean_age_ + hard_.age;
    const Real all = static_cast<Real>(reading - start_) - age + hard_.age;
    return touch < all ? touch / all : Real(1);
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
