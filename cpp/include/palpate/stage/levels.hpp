// SPDX-License-Identifier: MIT
#pragma once

// Jumps, steps and channels that do not follow: a hand trembles, and a level that jumped has the idle noise.

#include <palpate/judgement.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// What a frame means for the tracker. From `moved` on both baselines are new.
enum class LevelChange : std::uint8_t {
  none,       ///< nothing
  saturated,  ///< a channel does not follow the other one in this touch
  moved,      ///< no touch is concerned
  dropped,    ///< only the jump of one channel began the touch
  jumped,     ///< the touch was a jump
  stepped,    ///< a channel jumped within the touch
  returned,   ///< the touch that was a jump was one
};

/// The null stage.
struct NoLevels {
  static constexpr bool watches = false;  ///< levels
  /// As the function of Levels of this name.
  static constexpr void forget() noexcept {}
};

/// Watches both channels at rest and pressed, frame by frame.
///
/// The channels are still after 0.8 s and 5 frames in which both stayed near their means. Then each one is at its level or
/// off it. One alone jumped, as no probe has a ratio of 30. Both: they jumped, or a stage presses. That is pending until
/// they fall, or until no stage holds for so long; it is no stage where the presses of the session trembled.
///
/// A channel does not follow if it stays at its highest value, and the other one moves: it should move by a quarter as much,
/// or at least have its noise. The test is a CUSUM, as that of Contact: where both turn, one of them is late.
template <class Real, class Time>
class Levels {
  using List = Judgements<Real, Time>;
  static constexpr std::uint32_t few = 5;         // frames: of a new level, of a press
  static constexpr Real still = Real(0.8);        // s, of a new level
  static constexpr Real longest = Real(10);       // s, of a still press of a stage
  static constexpr std::uint32_t patience = 300;  // frames, of the same
  static constexpr std::uint8_t rarely = 8;       // frames, until the levels are followed again
  static constexpr Real early = Real(0.3);        // s: a channel that left so long before the press jumped before it

  struct Side {
    Real rest = 0, noise = 0;                   // the level without contact
    Real last = not_a_number<Real>, moved = 0;  // the value; its change
    Real code = 0, finest = Real(0.02);         // the smallest change of all; below this: a larger one is a jump
    Real limit = 0;                             // 12 noises, or 2.5 codes
    Real now = 0, height = 0;                   // from the level; the largest one of the press
    Real least_jump = 0;                        // a part of the last press
    Real mean = 0;                              // of the run
    Real stuck = 0;                             // CUSUM
    std::uint32_t equal = 0;                    // values in a row
    Time left;                                  // its level
    bool near = true, told = false;             // at its level; that it is stuck
    std::uint8_t stands = 0;                    // still presses with equal values

    constexpr void set(Real new_noise, Real new_code) noexcept {
      noise = new_noise;
      code = new_code;
      const Real least = product(Real(2.5), code);
      limit = 12 * noise > least ? 12 * noise : least;
    }
    constexpr Real off() const noexcept { return mean - rest; }
    constexpr bool out() const noexcept { return magnitude(now) > limit; }
    constexpr bool strays() const noexcept { return magnitude(last - mean) > limit / 2; }
    // The level has changed by another amount than this; within a press it may drift.
    constexpr bool differs(Real change) const noexcept {
      return magnitude(off() - change) > limit + product(Real(0.05), height) + least_jump;
    }
    constexpr bool alone(const Side& other) const noexcept {
      return differs(0) && 30 * magnitude(other.off()) < magnitude(off());
    }
    template <class Baseline>
    constexpr bool agrees(const Baseline& baseline) const noexcept {
      return near && magnitude(baseline.level() - rest) <= limit;
    }
    template <class Baseline>
    constexpr void follow(const Baseline& baseline) noexcept {
      const Real least = product(Real(0.3), code), seen = baseline.noise();
      rest = baseline.level();
      const Real slow = noise > 0 && seen > noise ? noise + noise / 32 : seen;  // up: it may be measured in a press
      set(slow > least ? slow : least, code);
    }

    constexpr void read(Time time, Real value, Real known) noexcept {
      const bool first = !(last == last);
      moved = first ? Real(0) : value - last;
      const Real size = magnitude(moved);
      if (PALPATE_UNLIKELY(known > 0 || (size > 0 && size < finest))) {
        set(noise, known > 0 ? known : size);
        finest = code;
      }
      equal = moved == 0 && !first ? equal + 1 : 0;
      last = value;
      now = value - rest;
      left = near ? time : left;
      near = magnitude(now) <= limit / 2;
    }
    // In a press. Returns whether it has not followed the other one, for the first time.
    constexpr bool press(const Side& other, bool aligned) noexcept {
      height = magnitude(now) > height ? magnitude(now) : height;
      if (PALPATE_LIKELY(!(now > height - limit))) {  // it follows, or falls
        stuck = 0;
        return false;
      }
      const Real due =
          aligned ? product(positive_part(magnitude(other.moved) - 3 * other.noise), now / other.now) : Real(0);
      const Real own = code > 0 && noise > 2 * code ? noise : Real(0);  // its noise is seen
      const Real size = (due + own - 4 * magnitude(moved) - code / 2) / (noise + code);
      stuck = positive_part(stuck + (size > 3 ? Real(3) : size));
      const bool found = stuck > 12 && !told;
      told = told || found;
      return found;
    }
    constexpr bool high() const noexcept { return now > product(Real(0.8), height); }
    constexpr void close() noexcept {
      least_jump = height > 0 ? height / 256 : least_jump;
      height = stuck = 0;
      told = false;
    }
  };

 public:
  static constexpr bool watches = true;  ///< levels

  /// Begin anew: what comes next may be another probe, and in contact.
  constexpr void forget() noexcept { *this = {}; }

  /// Takes a frame, after the detector, whose baselines it moves; `begun`: a touch begins with it.
  template <class Detector, class Codes>
  constexpr LevelChange take(Time time, Real hard, Real soft, bool begun, Detector& detector, const Codes& codes,
                             List& list) noexcept {
    hard_.read(time, hard, codes.hard.coarse(hard_.noise));
    soft_.read(time, soft, codes.soft.coarse(soft_.noise));
    touched_ = touched_ || begun;
    follow(detector);
    if (PALPATE_LIKELY(!known_ || (hard_.near && soft_.near))) {
      if (count_ > 0) {
        close(list);
        count_ = 0;
      }
      return LevelChange::none;
    }
    run(time);
    const bool stuck = press(time, list);
    const bool decides = !decided_ && detector.ready() && count_ >= few && seconds(begin_, time) >= still;
    const LevelChange change = decides ? decide(time, list) : LevelChange::none;
    if (change == LevelChange::none) {
      return stuck && touched_ ? LevelChange::saturated : change;
    }
    move(detector);
    return change;
  }

 private:
  static constexpr Real seconds(Time from, Time to) noexcept { return to.template seconds_since<Real>(from); }

  // While nothing is touched the detector knows the levels, unless they have jumped.
  template <class Detector>
  constexpr void follow(const Detector& d) noexcept {
    frames_ = static_cast<std::uint8_t>((frames_ + 1) % rarely);
    if (PALPATE_LIKELY(frames_ != 0 && known_)) {
      return;
    }
    const bool agree = !known_ || (hard_.agrees(d.hard_baseline) && soft_.agrees(d.soft_baseline));
    if (agree && d.ready() && d.gate.idle()) {
      hard_.follow(d.hard_baseline);
      soft_.follow(d.soft_baseline);
      known_ = true;
    }
  }

  // The baselines of the detector are the means of the run.
  template <class Detector>
  constexpr void move(Detector& detector) noexcept {
    const auto values = static_cast<Real>(count_);
    detector.gate.reset();
    detector.hard_baseline.move(hard_.mean, values);
    detector.soft_baseline.move(soft_.mean, values);
    touched_ = false;
  }

  constexpr void run(Time time) noexcept {
    if (count_ == 0 || hard_.strays() || soft_.strays()) {
      count_ = 0;
      begin_ = time;
      decided_ = false;
    }
    count_ += 1;
    if (count_ == 1) {
      hard_.mean = hard_.last;
      soft_.mean = soft_.last;
      return;
    }
    const Real share = 1 / static_cast<Real>(count_);
    hard_.mean += product(share, hard_.last - hard_.mean);
    soft_.mean += product(share, soft_.last - soft_.mean);
  }

  // Returns whether a channel has not followed.
  constexpr bool press(Time time, List& list) noexcept {
    waited_ += 1;
    if (!(hard_.out() && soft_.out())) {
      return false;
    }
    aligned_ = seconds(last_, time) <= Real(0.04);  // slower ones show another part of the tremor
    last_ = time;
    if (pressed_ == 0) {
      together_ = sharp_ = time;
      rises_ = hard_.now > 0;
      rough_ = sharpest_ = 0;
      calm_ = 1;
    }
    pressed_ += 1;
    rough_ += (magnitude(hard_.moved) - rough_) / 8;
    calm_ = pressed_ > 16 && rough_ < product(calm_, hard_.now) ? rough_ / hard_.now : calm_;
    const Real turn = magnitude(product(hard_.moved, soft_.now) - product(soft_.moved, hard_.now));
    if ((hard_.high() || soft_.high()) && turn > sharpest_) {
      sharpest_ = turn;
      sharp_ = time;
    }
    const bool hard = follows(hard_, soft_, Channel::hard, time, list);
    const bool soft = follows(soft_, hard_, Channel::soft, time, list);
    return hard || soft;
  }
  constexpr bool follows(Side& side, const Side& other, Channel channel, Time time, List& list) const noexcept {
    const bool stuck = side.press(other, aligned_);
    if (stuck) {
      list.add(Judged::saturated, channel, time, side.last);
    }
    return stuck;
  }

  // The press is over.
  constexpr void close(List& list) noexcept {
    if (pressed_ >= few) {
      raised_ = raised_ || rises_;
      falls_ = static_cast<std::uint8_t>(falls_ + (falls_ < 3));
      if (falls_ == 2 && !raised_) {
        list.add(Judged::falling, Channel::both, together_, -hard_.height, -soft_.height);
      }
      hand_ = calm_ < hand_ ? calm_ : hand_;
    }
    hard_.close();
    soft_.close();
    pressed_ = 0;
    touched_ = pending_ = false;
  }

  // The channels are still: at their levels, or at new ones, or it is pending.
  constexpr LevelChange decide(Time time, List& list) noexcept {
    LevelChange change = LevelChange::none;
    if (hard_.alone(soft_)) {
      change = one(hard_, Channel::hard, list);
    } else if (soft_.alone(hard_)) {
      change = one(soft_, Channel::soft, list);
    } else if (hard_.differs(0) || soft_.differs(0)) {
      change = both(time, list);
      if (pending_) {
        return LevelChange::none;
      }
    }
    close(list);
    hard_.rest = hard_.mean;
    soft_.rest = soft_.mean;
    decided_ = true;
    return change;
  }

  constexpr LevelChange one(const Side& side, Channel channel, List& list) const noexcept {
    const bool pressed = pressed_ >= few, step = pressed && seconds(side.left, together_) < early;
    list.add(step ? Judged::step : Judged::jumped, channel, step ? sharp_ : side.left, side.off());
    return !touched_ ? LevelChange::moved
           : step    ? LevelChange::stepped
           : pressed ? LevelChange::jumped
                     : LevelChange::dropped;
  }

  constexpr LevelChange both(Time time, List& list) noexcept {
    const Real hard = hard_.off(), soft = soft_.off();
    if (taken_ && !hard_.differs(-hard_jump_) && !soft_.differs(-soft_jump_)) {
      list.add(Judged::was_touch, Channel::both, hard_.left, hard, soft);
      taken_ = pending_ = false;
      return LevelChange::returned;
    }
    if (!raised_ && hard < 0 && soft < 0) {  // the first level was measured in contact
      pending_ = false;
      return LevelChange::none;
    }
    if (!pending_ || hard_.differs(hard_jump_) || soft_.differs(soft_jump_)) {
      begin_pending(hard, soft, list);
    }
    const bool calm = hard < 0 || (hand_ < 1 && product(hand_, hard) > 8 * hard_.noise);
    pending_ = !calm && !(seconds(since_, time) >= longest && waited_ >= patience);
    if (!pending_) {
      taken_ = true;
      list.add(Judged::jumped, Channel::both, since_, hard, soft);
    }
    return touched_ ? LevelChange::jumped : LevelChange::moved;
  }
  constexpr void begin_pending(Real hard, Real soft, List& list) noexcept {
    taken_ = false;
    hard_jump_ = hard;
    soft_jump_ = soft;
    since_ = hard_.left;
    waited_ = 0;
    ask(hard_, Channel::hard, list);
    ask(soft_, Channel::soft, list);
  }
  // A channel whose values are all equal in the second still press may be saturated.
  constexpr void ask(Side& side, Channel channel, List& list) const noexcept {
    side.stands = static_cast<std::uint8_t>(side.stands + (side.equal + 1 >= count_ && side.stands < 3));
    if (side.stands == 2) {
      side.stands = 3;
      list.add(Judged::still, channel, begin_, side.last);
    }
  }

  Side hard_, soft_;
  Real hard_jump_ = 0, soft_jump_ = 0;        // of both: pending, or the last one
  Real hand_ = 1;                             // the least tremor of all presses, a share; 1: not known
  Real rough_ = 0, calm_ = 0, sharpest_ = 0;  // of the press: changes of hard; their least share; the largest turn
  Time last_, together_, sharp_;  // of the press: the last frame, the first one, the one with the largest turn
  Time begin_, since_;            // of the run, and of the pending jump
  std::uint32_t count_ = 0, pressed_ = 0, waited_ = 0;      // frames: of the run, of the press, since it is pending
  std::uint8_t frames_ = 0;                                 // since the levels were followed
  std::uint8_t falls_ = 0;                                  // presses, up to 3
  bool known_ = false, decided_ = false;                    // the levels; about the run
  bool touched_ = false, rises_ = false, aligned_ = false;  // in this press: a touch has begun; both rose
  bool raised_ = false;                                     // a press has raised both
  bool pending_ = false, taken_ = false;                    // a jump of both
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
