// SPDX-License-Identifier: MIT
#pragma once

// The baselines of both channels and the gate: from readings to the begin and the end of a touch.

#include <palpate/stage/baseline.hpp>
#include <palpate/stage/contact.hpp>
#include <palpate/time.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// What a reading began or ended.
enum class Event : std::uint8_t {
  none,      ///< nothing
  begun,     ///< a touch
  released,  ///< the probe
  idle,      ///< the release is over; the baselines will be measured again
  measured,  ///< the baselines
};

/// The baselines and the gate of a Tracker. They take the readings before the alignment, for two
/// reasons: a baseline then measures the noise of its channel, and the gate does not wait for the
/// alignment.
template <class Real, class Time, class BaselineStage, class ContactStage>
class ContactDetector {
  using Signed = typename Time::Signed;

 public:
  BaselineStage hard_baseline;  ///< of the hard channel
  BaselineStage soft_baseline;  ///< of the soft channel
  ContactStage gate;            ///< the begin and the end of a touch

  /// Whether both baselines are measured.
  constexpr bool ready() const noexcept { return hard_baseline.ready() && soft_baseline.ready(); }
  /// How often the baseline was measured again: its first values were disturbed, the channels fell far below it, or a
  /// contact did not end.
  constexpr std::uint32_t retaken() const noexcept { return retaken_; }

 protected:
  /// Takes one reading; `running`: a touch takes samples; the noise is at least `least`, a Real, or 0.
  template <class Least>
  constexpr Event take(Time time, Real hard, Real soft, bool running, Least least) noexcept {
    const Real moved = (hard - hard_baseline.expected()) + (soft - soft_baseline.expected()), seen = noise();
    const Real spread = std::is_same_v<Least, Real> && seen < Real(least) ? Real(least) : seen;
    if (!(hard_baseline.ready() && soft_baseline.ready())) {
      return gate.update_between(moved, spread) ? begin_early() : collect(time, hard, soft);
    }
    const bool was_idle = gate.idle(), was_in_contact = gate.contact();
    gate.update(moved, spread, waited(time, running));
    if (gate.contact() && !(ContactStage::releases ? was_in_contact : running)) {
      hard_baseline.rewind();
      soft_baseline.rewind();
      return Event::begun;
    }
    if (gate.idle() && !was_idle && !gate.fell()) {
      measure_again();
      since_ = time.later(rest_of_release(time.since(since_)));
      settles_ = true;
      return Event::idle;
    }
    maintain(hard, soft);
    if (was_in_contact && !gate.contact()) {
      since_ = time;
      return Event::released;
    }
    return Event::none;
  }

  /// Takes readings of which one or both have no value.
  constexpr Event take_one(Real hard, Real soft) noexcept {
    const bool was_ready = ready();
    if (gate.idle() && !gate.suspects() && !settles_) {
      alone(hard_baseline, hard);
      alone(soft_baseline, soft);
    }
    return ready() && !was_ready ? Event::measured : Event::none;
  }

  /// Measure the baselines again.
  constexpr void tare() noexcept {
    gate.reset();
    settles_ = false;
    measure_again();
  }

 private:
  // sqrt(a^2 + b^2), at most 4 % too small and 12 % too large: enough for a threshold.
  constexpr Real noise() const noexcept {
    const Real a = hard_baseline.noise(), b = soft_baseline.noise();
    return a > b ? a + product(Real(0.42), b) : b + product(Real(0.42), a);
  }

  /// Seconds since a touch took samples, or the probe was released.
  constexpr Real waited(Time time, bool running) noexcept {
    if (!ContactStage::recovers || running || gate.idle()) {
      since_ = time;
      return Real(0);
    }
    return time.template seconds_since<Real>(since_);
  }

  constexpr void measure_again() noexcept {
    hard_baseline.reset();
    soft_baseline.reset();
  }

  // The last tenth of a release takes half as long again as the fall to it, for a force of depth^1.5.
  static constexpr Signed rest_of_release(Signed fall) noexcept {
    const Signed rest = fall > Time::second ? Time::second : fall < 0 ? 0 : fall + fall / 2;
    return rest > Time::second / 10 ? rest : Time::second / 10;
  }

  constexpr Event collect(Time time, Real hard, Real soft) noexcept {
    const auto rest = since_.since(time);
    settles_ = settles_ && rest > 0 && rest <= 2 * Time::second;
    if (settles_) {
      return Event::none;
    }
    collect_in(hard_baseline, hard);
    collect_in(soft_baseline, soft);
    return ready() ? Event::measured : Event::none;
  }
  // A touch that begins before a new baseline is measured uses the old one.
  PALPATE_INLINE constexpr Event begin_early() noexcept {
    hard_baseline.keep();
    soft_baseline.keep();
    return Event::begun;
  }
  static constexpr void collect_in(BaselineStage& baseline, Real value) noexcept {
    if (!baseline.ready()) {
      baseline.collect(value);
    }
  }

  // The other channel has no value.
  static constexpr void alone(BaselineStage& baseline, Real value) noexcept {
    if (is_finite(value)) {
      baseline.ready() ? baseline.follow(value) : baseline.collect(value);
    }
  }

  // The baselines without contact; they are measured again if a channel fell below them, or they were disturbed.
  PALPATE_INLINE constexpr void maintain(Real hard, Real soft) noexcept {
    if (gate.fell() || (gate.idle() && (hard_baseline.disturbed() || soft_baseline.disturbed()))) {
      retaken_ += 1;
      tare();
    } else if (gate.idle()) {
      follow(hard, soft);
    }
  }

  constexpr void follow(Real hard, Real soft) noexcept {
    hard_baseline.follow(hard);
    soft_baseline.follow(soft);
    if (!gate.suspects()) {
      hard_baseline.mark();
      soft_baseline.mark();
    }
  }

  Time since_;  // when a touch last took samples, or the release; while the baselines are measured: its end
  std::uint32_t retaken_ = 0;
  bool settles_ = false;  // a release is not yet over
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
