// SPDX-License-Identifier: MIT
#pragma once

// A change of the ratio that may be an effect of the lift, until it is confirmed.

#include <palpate/time.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// The state before a hand-over, or before the ratio begins to drift, until the change is confirmed: when `confirmed`
/// seconds have passed, and the mean depth since then is not less than before, by 1.5 %. A change that is not confirmed
/// was an effect of the lift, or came too late to be measured: the ratio before it is the result, after a drift only if
/// the touch ends in a lift. The wait ends after the longest lift.
template <class Real, class Time, class Estimator, class Snapshot, class Evidence>
class PendingChange {
  // Seconds: the slowest lift of bench.accuracy.presses takes 2.
  static constexpr Real longest = Real(2.5);

 public:
  Estimator estimator;  ///< before the change, with the noise of then
  Evidence evidence;    ///< before the change

  constexpr void reset() noexcept { waits_ = alarmed_ = false; }
  /// Whether a change waits.
  constexpr bool waits() const noexcept { return waits_; }
  /// Whether the result is the one before the change: after a hand-over if it has more samples than the one after it.
  constexpr bool holds(const Estimator& after) const noexcept {
    return waits_ && (alarmed_ ? !(estimator.count() < after.count()) : !down_);
  }

  /// Keep the estimate and the evidence before a change. Of several, the first one counts.
  constexpr void keep(Time time, const Estimator& now, const Snapshot& before, const Evidence& collected,
                      bool alarm) noexcept {
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
  constexpr bool follow(Time time, Real regressor, Real confirmed) noexcept {
    if (PALPATE_UNLIKELY(waits_)) {
      squares_ += product(regressor, regressor);
      count_ += 1;
      const Real before = estimator.information() / estimator.count();  // mean square
      // Of depths, 1.5 %: 0.985^2. A choice: nearer to 1 tremor keeps a true change waiting, further away a slow lift
      // confirms a wrong one.
      down_ = !(squares_ / count_ < product(Real(0.97), before));
      const Real least = alarmed_ ? confirmed : 2 * confirmed;  // a drift is slow
      waits_ = !(down_ && time.template seconds_since<Real>(last_) >= least) &&
               time.template seconds_since<Real>(begin_) < longest;
      return !waits_ && alarmed_;
    }
    return false;
  }

 private:
  Time begin_, last_;             // of the first and of the last change
  Real squares_ = 0, count_ = 0;  // of the regressors since the last one
  bool waits_ = false, alarmed_ = false, down_ = false;
};

/// For an estimator that follows a ratio that moves, and cannot go back: the state of the last hold, a copy after every few samples
/// in which the ratio does not move. If it moves in the last few samples of a touch, and the hold is not longer ago than a lift takes,
/// the hold is the result: this was an effect of the lift, or came too late to be measured.
template <class Estimator, class Evidence>
class LastHold {
  static constexpr std::uint8_t few = 16;   // samples, with which nothing is tested
  static constexpr std::uint8_t lift = 48;  // samples: longer than a second, with those of the hold since the copy

 public:
  Estimator estimator;  ///< of the hold
  Evidence evidence;    ///< of the hold

  constexpr void reset() noexcept {
    since_ = age_ = 0;
    known_ = false;
  }
  /// Whether the ratio moved after the hold, and still does.
  constexpr bool waits() const noexcept { return known_ && since_ < few; }
  /// Whether the result is the hold.
  constexpr bool holds(const Estimator&) const noexcept { return waits() && age_ < lift; }
  /// After each sample: whether the ratio moves.
  PALPATE_INLINE constexpr void follow(bool moves, const Estimator& now, const Evidence& collected) noexcept {
    since_ = static_cast<std::uint8_t>(moves ? 0 : since_ + 1);
    age_ = static_cast<std::uint8_t>(age_ + (age_ < lift));
    if (PALPATE_UNLIKELY(since_ == few || since_ == 2 * few)) {
      estimator = now;
      evidence = collected;
      known_ = true;
      since_ = few;
      age_ = 0;
    }
  }

 private:
  std::uint8_t since_ = 0, age_ = 0;  // samples since it moved, up to twice `few`; since the copy, up to `lift`
  bool known_ = false;
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
