// SPDX-License-Identifier: MIT
#pragma once

// What the samples of a touch say beside its ratio, and what was known before a change that may not be confirmed.

#include <palpate/stage/align.hpp>
#include <palpate/stage/fit.hpp>
#include <palpate/stage/level_ratio.hpp>
#include <palpate/stage/revision.hpp>

namespace palpate {

/// What a tracker with a fit learns from the samples of a touch.
template <class Real, class FitStage, class LevelStage>
struct Evidence {
  FitStage fit;         ///< the test of the model
  Reviser<Real> times;  ///< of the samples
  LevelStage level;     ///< the ratio over the swept depth
};

/// The state before a hand-over, or before the ratio begins to drift, until the change is confirmed: when `confirmed`
/// seconds have passed and the mean depth since then is not less than before, by 1.5 %. A change that is not was an effect of the lift, or it
/// came too late to be measured: then the ratio before it is the result; after a drift only if the touch ends in a lift.
/// Such a wait ends after the longest lift.
template <class Real, class Ticks, class Estimator, class Collected>
class Unconfirmed {
  static constexpr Real longest = Real(2.5);  // seconds

 public:
  Estimator estimator;  ///< before the change, with the noise of then
  Collected evidence;   ///< before the change

  constexpr void reset() noexcept { waits_ = alarmed_ = false; }
  /// Whether a change waits.
  constexpr bool waits() const noexcept { return waits_; }
  /// Whether the result is the one before the change: after a hand-over if it has more samples than the one after it.
  constexpr bool holds(const Estimator& after) const noexcept {
    return waits_ && (alarmed_ ? !(estimator.count() < after.count()) : !down_);
  }

  /// The estimate and the evidence before a change. Of several, the first one counts.
  constexpr void keep(Ticks time, const Estimator& now, const typename Estimator::Estimate& before,
                      const Collected& collected, bool alarm) noexcept {
    alarmed_ = alarm || (waits_ && alarmed_);
    if (!waits_) {
      estimator = now;
      estimator.restore(before);
      evidence = collected;
      begin_ = time;
    }
    last_ = time;
    squares_ = count_ = 0;
    waits_ = true;
  }

  /// After each sample. Returns whether this confirms a hand-over.
  constexpr bool follow(Ticks time, Real regressor, Real confirmed) noexcept {
    if (PALPATE_UNLIKELY(waits_)) {
      squares_ += product(regressor, regressor);
      count_ += 1;
      const Real before = estimator.information() / estimator.count();  // mean square
      down_ = !(squares_ / count_ < product(Real(0.97), before));
      const Real least = alarmed_ ? confirmed : 2 * confirmed;  // a drift is slow
      waits_ = !(down_ && seconds_between<Real>(time, last_) >= least) && seconds_between<Real>(time, begin_) < longest;
      return !waits_ && alarmed_;
    }
    return false;
  }

 private:
  Ticks begin_ = 0, last_ = 0;    // of the first and of the last change
  Real squares_ = 0, count_ = 0;  // of the regressors since the last one
  bool waits_ = false, alarmed_ = false, down_ = false;
};

/// The step of a channel's codes: of what all differences between its readings are multiples (Euclid's algorithm). It is
/// proven by three of them, of several codes or within a touch; neither a press from one number to another nor a ramp, of
/// equal differences, is a proof.
template <class Real>
class CodeStep {
  static constexpr std::uint8_t proven = 3, fine = 255;  // fine: below a few millionths of a reading

 public:
  constexpr void add(Real value, bool held) noexcept {
    const Real change = value - last_;
    last_ = value;
    if (PALPATE_UNLIKELY(times_ != fine && is_finite(change))) {
      if (const Real difference = magnitude(change); difference > 0) {
        const Real least = product(magnitude(value) + difference, Real(1e-6));
        refine(difference, least, magnitude(change - change_) > least, held);
      }
      change_ = change;
    }
  }
  /// The step, if noise does not move the readings from code to code; else 0: the noise contains the rounding.
  constexpr Real coarse(Real noise) const noexcept {
    return times_ == proven && !(noise > product(Real(0.51), step_)) ? step_ : Real(0);
  }

 private:
  PALPATE_COLD constexpr void refine(Real difference, Real least, bool differs, bool held) noexcept {
    const Real before = step_;
    step_ = difference;
    for (Real rest = before < 1000 * difference ? before : Real(0); rest > least;) {
      const Real codes = step_ / rest,
                 left = step_ - product(rest, static_cast<Real>(static_cast<int>(codes + Real(0.5))));
      step_ = rest;
      rest = magnitude(left);
    }
    if (!(step_ > 8 * least)) {
      times_ = fine;
    } else if (before - step_ > least || before == 0 || (!differs && times_ < proven)) {
      times_ = 0;
    } else {
      times_ = static_cast<std::uint8_t>(times_ + (times_ < proven && (held || difference > step_ + least)));
    }
  }

  Real last_ = 0, change_ = 0, step_ = 0;
  std::uint8_t times_ = 0;
};

/// What a tracker with a fit keeps for it; nothing without.
template <class Real, class Ticks, class Estimator, class FitStage, class LevelStage, bool fits = FitStage::fits>
struct Fitting {
  using Collected = Evidence<Real, FitStage, LevelStage>;
  Collected evidence;
  Unconfirmed<Real, Ticks, Estimator, Collected> unconfirmed;
  CodeStep<Real> hard_step, soft_step;
  Ticks begin = 0;  // of the touch
  Fitted<Real> fitted;
  typename Reviser<Real>::Result revision;
  Levelled<Real> levelled, earlier, after;  // the last two: on the other side of a change
  Real first_error = 0;
  bool tilted = false;    // the ratio and the level ratio differ
  bool lifted = false;    // the result is the one before a change that was not confirmed
  bool drifts = false;    // the ratio, at the last sample
  bool together = false;  // both channels are read at once

  static constexpr auto estimate_of(const Estimator& estimator) noexcept { return estimator.estimate(); }
};
template <class Real, class Ticks, class Estimator, class FitStage, class LevelStage>
struct Fitting<Real, Ticks, Estimator, FitStage, LevelStage, false> {
  static constexpr int estimate_of(const Estimator&) noexcept { return 0; }
};

}  // namespace palpate
