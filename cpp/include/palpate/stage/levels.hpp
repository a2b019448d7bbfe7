// SPDX-License-Identifier: MIT
#pragma once

// Jumps, steps and channels that do not follow: a hand trembles, and a level that jumped has the idle noise.

#include <palpate/judgement.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// What a frame means for the tracker. After `saturated` the baselines are new.
enum class LevelChange : std::uint8_t {
  none,       ///< nothing
  saturated,  ///< of the touch: a channel does not follow
  moved,      ///< of no touch
  dropped,    ///< the touch was a jump of one channel
  jumped,     ///< the touch was a jump
  stepped,    ///< a channel jumped within the touch
  returned,   ///< the touch that was a jump was one
};

/// The null stage.
struct NoLevels {
  static constexpr bool watches = false;  ///< levels
};

/// Watches both channels at rest and pressed, frame by frame.
///
/// A run: frames that stay within half a limit of their mean, in both channels. After 0.8 s and 5 frames the channels are
/// still: then each one is at its level, or off it. One alone jumped, as no probe has a ratio of 30. Both: a stage
/// presses, or both jumped; pending until they fall, or until no stage holds for so long.
template <class Real, class Time>
class Levels {
  static constexpr int few = 5;                  // frames
  static constexpr Real still_s = Real(0.8);     // of a new level
  static constexpr Real brief_s = Real(0.2);     // a hand is never still for so long
  static constexpr Real early_s = Real(0.3);     // a channel left so long before the press: it jumped before it
  static constexpr Real pending_s = Real(10);    // the longest still press of a stage
  static constexpr std::uint32_t pending = 300;  // the same, frames
  static constexpr Real ratios = Real(30);       // no probe has such a ratio
  static constexpr Real drifted = Real(0.05);    // share of a press that its baselines may drift
  static constexpr int pile = 6;                 // frames at the highest reading
  static constexpr std::uint8_t touches = 2;     // with the same highest reading, for a remark
  using List = Judgements<Real, Time>;

  struct Side {
    Real rest = 0, noise = 0;                  // the level without contact
    Real last = not_a_number<Real>, code = 0;  // the last value; the smallest change
    Real mean = 0, now = 0, height = 0;        // of the run; from the level; the highest of the press
    Real top = std::numeric_limits<Real>::lowest(), low = 0, high = 0;  // highest value; range since it stays there
    Real other_low = 0, other_high = 0;                                 // range of the other channel meanwhile
    int piled = 0;                                                      // frames meanwhile
    std::uint8_t stood = 0;                                             // presses that stayed there
    Time left, reached;  // when it left its level; when it reached the highest value
    bool near = true, told = false, stays = false;

    constexpr Real limit() const noexcept {
      const Real of_noise = 12 * noise, of_code = product(Real(2.5), code);
      return of_noise > of_code ? of_noise : of_code;
    }
    constexpr bool out() const noexcept { return magnitude(now) > limit(); }
    constexpr Real off() const noexcept { return mean - rest; }
    constexpr bool inside(Real value) const noexcept { return magnitude(value - mean) <= limit() / 2; }
    constexpr bool away(bool pressed) const noexcept {
      const Real share = pressed ? product(drifted, height) : Real(0), least = limit();
      return magnitude(off()) > (share > least ? share : least);
    }
    constexpr bool alone(const Side& other, bool pressed) const noexcept {
      return away(pressed) && ratios * magnitude(other.off()) < magnitude(off());
    }
    constexpr bool is(Real before) const noexcept {
      return magnitude(off() - before) <= limit() + product(drifted, magnitude(before));
    }

    constexpr void read(Time time, Real value) noexcept {
      const Real change = magnitude(value - last);
      code = change > 0 && (code == 0 || change < code) ? change : code;
      last = value;
      now = value - rest;
      const bool was_near = near;
      near = magnitude(now) <= limit() / 2;
      left = was_near && !near ? time : left;
    }
    template <class Baseline>
    constexpr bool agrees(const Baseline& baseline) const noexcept {
      return magnitude(baseline.level() - rest) <= limit();
    }
    template <class Baseline>
    constexpr void follow(const Baseline& baseline) noexcept {
      const Real least = product(Real(0.3), code);
      rest = baseline.level();
      noise = baseline.noise() > least ? baseline.noise() : least;
    }

    // Whether it stays at its highest value while the other one moves so far that it should have moved, too.
    constexpr bool saturates(Time time, const Side& other) noexcept {
      const Real band = limit() / 4;
      if (last > top + band) {
        top = last;
        piled = stood = 0;
      }
      const bool pressed = now > limit() && other.now > other.limit();
      if (!pressed || last < top - 2 * band) {
        piled = 0;
        told = told && pressed;
        stays = stays && pressed;
        return false;
      }
      if (piled == 0) {
        low = high = last;
        other_low = other_high = other.last;
        reached = time;
      }
      piled += 1;
      low = last < low ? last : low;
      high = last > high ? last : high;
      other_low = other.last < other_low ? other.last : other_low;
      other_high = other.last > other_high ? other.last : other_high;
      const Real moves = positive_part(other_high - other_low - 5 * other.noise);
      const Real own = 2 * (high - low + noise) + product(Real(1.5), code);
      // A channel that is not at its end has its noise, whatever the other one does.
      const bool dead = piled >= 2 * pile && noise > 2 * code && high - low < noise;
      const bool found = !told && piled >= pile && (dead || product(moves, now / other.now) > own);
      told = told || found;
      return found;
    }
    // Whether several presses stayed there.
    constexpr bool stands(Time time) noexcept {
      if (piled == 0 || told || stays || high - low > code ||
          !(time.template seconds_since<Real>(reached) >= still_s)) {
        return false;
      }
      stays = true;
      stood = static_cast<std::uint8_t>(stood + (stood <= touches));
      return stood == touches;
    }
  };

 public:
  static constexpr bool watches = true;  ///< levels

  /// Level of a channel, after a change of the baselines.
  constexpr Real hard_level() const noexcept { return hard_.mean; }
  /// The same of the soft channel.
  constexpr Real soft_level() const noexcept { return soft_.mean; }
  /// Number of its frames.
  constexpr Real level_count() const noexcept { return static_cast<Real>(count_); }

  /// A touch begins.
  constexpr void touch_begun() noexcept { touched_ = true; }

  /// Takes a frame; the detector has taken it.
  template <class Detector>
  constexpr LevelChange take(Time time, Real hard, Real soft, const Detector& detector, List& judgements) noexcept {
    hard_.read(time, hard);
    soft_.read(time, soft);
    if (!follow(detector)) {
      return LevelChange::none;
    }
    run(time, hard, soft);
    press(time, judgements);
    const bool told = does_not_follow(time, hard_, soft_, Channel::hard, judgements) |
                      does_not_follow(time, soft_, hard_, Channel::soft, judgements);
    const bool still = count_ >= few && time.template seconds_since<Real>(begin_) >= still_s;
    const LevelChange change = still && !decided_ ? decide(time, judgements) : LevelChange::none;
    return change == LevelChange::none && told && touched_ ? LevelChange::saturated : change;
  }

 private:
  // The tracker follows the levels while nothing is touched; false: they were never known.
  template <class Detector>
  constexpr bool follow(const Detector& d) noexcept {
    const bool rests = d.ready() && d.gate.idle() && !d.gate.suspects();
    if (rests && (!known_ || (hard_.agrees(d.hard_baseline) && soft_.agrees(d.soft_baseline)))) {
      hard_.follow(d.hard_baseline);
      soft_.follow(d.soft_baseline);
      known_ = true;
    }
    return known_;
  }

  constexpr void run(Time time, Real hard, Real soft) noexcept {
    if (count_ == 0 || !hard_.inside(hard) || !soft_.inside(soft)) {
      count_ = 0;
      begin_ = time;
      decided_ = false;
    }
    count_ += 1;
    const Real share = 1 / static_cast<Real>(count_);
    hard_.mean += product(share, hard - hard_.mean);
    soft_.mean += product(share, soft - soft_.mean);
  }

  constexpr void press(Time time, List& judgements) noexcept {
    pending_frames_ += 1;
    if (hard_.out() && soft_.out()) {
      if (both_ == 0) {
        together_ = time;
        hard_.height = soft_.height = longest_s_ = 0;
        rises_ = false;
      }
      both_ += 1;
      hard_.height = larger(hard_.height, magnitude(hard_.now));
      soft_.height = larger(soft_.height, magnitude(soft_.now));
      longest_s_ = larger(longest_s_, time.template seconds_since<Real>(begin_));
      rises_ = rises_ || (hard_.now > 0 && soft_.now > 0);
    } else if (hard_.near && soft_.near) {
      close(time, judgements);
    }
  }
  static constexpr Real larger(Real a, Real b) noexcept { return a > b ? a : b; }

  // The press is over.
  constexpr void close(Time time, List& judgements) noexcept {
    if (both_ >= few) {
      raised_ = raised_ || rises_;
      falls_ = static_cast<std::uint8_t>(falls_ + (!raised_ && falls_ < 3));
      if (falls_ == 2 && !raised_) {
        judgements.add(Judged::falling, Channel::both, together_, -hard_.height, -soft_.height);
        falls_ = 3;
      }
      const Real height = hard_.height + soft_.height;
      if (time.template seconds_since<Real>(together_) >= still_s && longest_s_ < brief_s) {
        hand_ = hand_ == 0 || height < hand_ ? height : hand_;
      }
    }
    both_ = 0;
    touched_ = pending_ = false;
  }

  constexpr LevelChange decide(Time time, List& judgements) noexcept {
    const bool pressed = both_ > 0;
    if (!hard_.away(pressed) && !soft_.away(pressed)) {
      close(time, judgements);
      return settle(LevelChange::none);
    }
    if (hard_.alone(soft_, pressed)) {
      return one(hard_, Channel::hard, judgements);
    }
    if (soft_.alone(hard_, pressed)) {
      return one(soft_, Channel::soft, judgements);
    }
    return both(time, judgements);
  }

  // The channels are at their new levels.
  constexpr LevelChange settle(LevelChange change) noexcept {
    hard_.rest = hard_.mean;
    soft_.rest = soft_.mean;
    decided_ = true;
    touched_ = pending_ = false;
    both_ = 0;
    return change;
  }

  constexpr LevelChange one(Side& side, Channel channel, List& judgements) noexcept {
    const bool pressed = both_ >= few, early = together_.template seconds_since<Real>(side.left) > early_s;
    const bool step = pressed && !early;
    judgements.add(step ? Judged::step : Judged::jumped, channel, side.left, side.off());
    return settle(!touched_ ? LevelChange::moved
                  : step    ? LevelChange::stepped
                  : pressed ? LevelChange::jumped
                            : LevelChange::dropped);
  }

  constexpr LevelChange both(Time time, List& judgements) noexcept {
    if (taken_ && hard_.is(-taken_hard_) && soft_.is(-taken_soft_)) {
      judgements.add(Judged::was_touch, Channel::both, hard_.left, hard_.off(), soft_.off());
      taken_ = false;
      return settle(LevelChange::returned);
    }
    if (!raised_ && hard_.off() < 0 && soft_.off() < 0) {  // the first level was measured in contact
      return settle(LevelChange::none);
    }
    if (!(pending_ && hard_.is(taken_hard_) && soft_.is(taken_soft_))) {
      pending_ = true;
      taken_ = false;
      taken_hard_ = hard_.off();
      taken_soft_ = soft_.off();
      since_ = hard_.left;
      pending_frames_ = 0;
    }
    const bool calm = hand_ > 0 && magnitude(hard_.off() + soft_.off()) >= hand_;
    const bool lasts = time.template seconds_since<Real>(since_) >= pending_s && pending_frames_ >= pending;
    if (!calm && !lasts) {
      return LevelChange::none;
    }
    judgements.add(Judged::jumped, Channel::both, since_, hard_.off(), soft_.off());
    taken_ = true;
    return settle(touched_ ? LevelChange::jumped : LevelChange::moved);
  }

  constexpr bool does_not_follow(Time time, Side& side, const Side& other, Channel channel, List& judgements) noexcept {
    const bool saturates = side.saturates(time, other);
    if (saturates || side.stands(time)) {
      judgements.add(saturates ? Judged::saturated : Judged::still, channel, side.reached, side.last);
    }
    return saturates;
  }

  Side hard_, soft_;
  Real taken_hard_ = 0, taken_soft_ = 0;                     // of both: what is pending, or the last jump
  Real hand_ = 0;                                            // the lowest press that was never still
  Real longest_s_ = 0;                                       // the longest run of a press
  Time begin_, together_, since_;                            // of the run; both left their levels; the pending change
  std::uint32_t count_ = 0, both_ = 0, pending_frames_ = 0;  // frames: of the run; both away; since it is pending
  std::uint8_t falls_ = 0;                                   // presses in which both fell
  bool known_ = false, decided_ = false;
  bool touched_ = false;  // a touch has begun in this press
  bool raised_ = false;   // a press has raised both channels
  bool rises_ = false;    // this press has
  bool pending_ = false, taken_ = false;
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
