// SPDX-License-Identifier: MIT
#pragma once

// The ratio over the swept depth: a line with an intercept, which a tilt of the probe does not change.

#include <palpate/estimate.hpp>
#include <palpate/judge/normal_equations.hpp>
#include <palpate/settings.hpp>
#include <palpate/square_root.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// The null stage: there is no level ratio, and no age.
template <class Real>
struct NoLevelRatio {
  static constexpr bool levels = false;  ///< there is no level ratio
  /// Nothing to forget.
  constexpr void reset() noexcept {}
  /// Nothing to forget.
  constexpr void restart() noexcept {}
};

/// Settings of LevelRatio.
template <class Real>
struct LevelRatioSettings {
  Real contact_exponent = Real(1);  ///< p: force ~ depth^p. 1: bumps with a flat end; 1.5: domes; 0: no level ratio
  Real age = Real(0);               ///< seconds from where the press has settled to the end of a touch; 0: no such end

  /// As FixedForgetting::visit_fields.
  static constexpr auto visit_fields = [](auto& s, auto&& visit) noexcept {
    const Real p = s.contact_exponent;
    visit("contact_exponent", s.contact_exponent, p == 0 || p == 1 || p == Real(1.5),
          "1 (flat bumps), 1.5 (domes), or 0 (no level ratio)");
    visit("age", s.age, s.age >= 0, "0 <= age");
  };
};

/// A probe held off by an angle presses one bump deeper by g: hard = r K (z + g)^p, soft = K (z - g)^p at depth z. So
///
///     hard^(1/p) = r^(1/p) soft^(1/p) + c
///
/// whatever g is. The hold alone cannot tell c from r; the rise sweeps the depth from 0, and the fall back to it.
///
/// The sums of the rise are kept by octaves of the soft channel, since the depth of the hold is not yet known: three of
/// them count, down to a quarter or an eighth of it; of the fall the pairs from a sixth on. The noise of the soft channel,
/// which makes a slope too small, is taken out of its sum of squares. The error has the scatter around the line; the
/// disagreement of rise and fall; a share of what the intercept changes, and of what the noise does.
template <class Real, class Settings = Kept<LevelRatioSettings<Real>>>
class LevelRatio : public Settings {
 public:
  using Settings::settings;
  static constexpr bool levels = true;  ///< there is a level ratio

  /// A new touch.
  constexpr void reset() noexcept {
    restart();
    settled_ = false;
    highest_ = top_ = 0;
  }

  /// After a hand-over: the samples before it are forgotten.
  constexpr void restart() noexcept { sums_[rise] = sums_[hold] = sums_[fall] = {}; }

  /// Add a pair, at a time in seconds; `held`: the touch takes samples, so that this is not yet the fall after it.
  constexpr void add(Real hard, Real soft, Real time, bool held) noexcept {
    if (!(hard > 0 && soft > 0 && settings.contact_exponent > 0 && is_finite(hard + soft))) {
      return;
    }
    if (!settled_) {
      add_to(octave_of(soft), hard, soft);
      follow(soft, time);
    } else if (soft > product(Real(0.75), highest_)) {
      add_to(held ? hold : places, hard, soft);
    } else if (6 * soft > highest_) {
      add_to(fall, hard, soft);
    }
  }

  /// Change of the soft channel where the press has settled; NaN: it has not.
  constexpr Real depth() const noexcept { return settled_ ? highest_ : not_a_number<Real>; }
  /// Seconds from the contact to the moment when it had settled.
  constexpr Real rise_time() const noexcept { return settled_ ? since_ : not_a_number<Real>; }

  /// Whether the press has settled, and is as old as a touch is to be.
  constexpr bool aged(Real time) const noexcept {
    return settings.age > 0 && settled_ && !(time - since_ < settings.age);
  }

  /// The level ratio beside the ratio of the hold, at the end of a touch, for a variance of the noise of `soft`; `revised`: the
  /// fall is known, and counts.
  constexpr Estimate<Real> result(Real ratio, Real noise, bool revised) const noexcept {
    Estimate<Real> found;
    const bool falls = revised && !(settings.age > 0) && number(fall) >= fewest;
    if (!settled_ || number(hold) < fewest || (number(rise) < fewest && !falls)) {
      return found;
    }
    const Line up = line(true, false, noise), all = line(true, falls, noise);
    if (!(all.slope > 0)) {
      return found;
    }
    const Real p = settings.contact_exponent, level = to_power(all.slope);
    const Real apart = falls && number(rise) >= fewest ? up.slope - line(false, true, noise).slope : Real(0);
    // Choices: 2 % of what the intercept changes is in doubt with both sides of a press, 5 % with one; the variance of the
    // line counts 3 or 9 times, as the pairs of a press do not scatter independently. Smaller ones give more flags of a
    // tilt, larger ones a wider error.
    const Real shift = product(falls ? Real(0.02) : Real(0.05), (level - ratio) / level);
    const Real own = product(falls ? Real(3) : Real(9), all.variance) + product(apart, apart) / 4;
    const Real own_share = own / product(all.slope, all.slope) + product(all.noise, all.noise) / 16;
    const Real square = product(product(p, p), own_share) + product(shift, shift);
    if (square < Real(0.01)) {  // a choice: an error below a tenth; a larger limit shows level ratios that say less
      found = {level, product(level, square_root(square))};
    }
    return found;
  }

 private:
  static constexpr int one = 0, x = 1, y = 2, columns = 3;
  // While the press rises the places are octaves of the soft channel, the highest one first.
  static constexpr int rise = 0, hold = 1, fall = 2, places = 3;
  static constexpr int fewest = 3;
  using Pairs = NormalEquations<Real, columns>;
  struct Line {
    Real slope, variance, noise;  // the last: share of the sum of squares
  };

  constexpr Real number(int place) const noexcept { return sums_[place].at(one, one); }

  /// x^(1/p)
  constexpr Real root(Real value) const noexcept {
    if (!(settings.contact_exponent > 1)) {
      return value;
    }
    const Real third = cube_root(value);
    return product(third, third);
  }
  constexpr Real to_power(Real slope) const noexcept {
    return settings.contact_exponent > 1 ? product(slope, square_root(slope)) : slope;
  }

  constexpr void add_to(int place, Real hard, Real soft) noexcept {
    if (place < places) {
      const Real from = root(soft), to = root(hard);
      first_ = number(rise) + number(hold) + number(fall) > 0 ? first_ : to / from;
      sums_[place].add({Real(1), from, to - product(first_, from)});
    }
  }

  constexpr int octave_of(Real soft) noexcept {
    top_ = top_ > 0 ? top_ : 2 * soft;
    for (; soft >= top_; top_ *= 2) {
      for (int i = places - 1; i > 0; --i) {
        sums_[i] = sums_[i - 1];
      }
      sums_[0] = {};
    }
    int octave = 0;
    for (Real edge = top_ / 2; octave < places && soft < edge; edge /= 2) {
      ++octave;
    }
    return octave;
  }

  // The press has settled if it has grown by less than a tenth for a tenth of a second.
  constexpr void follow(Real soft, Real time) noexcept {
    if (soft > product(Real(1.1), highest_)) {
      highest_ = soft;
      since_ = time;
    } else if (time - since_ > Real(0.1)) {
      settled_ = true;
      since_ = time;
      for (int i = 1; i < places; ++i) {
        sums_[rise].join(sums_[i]);
        sums_[i] = {};
      }
    }
  }

  // With the hold, and one side or both. What the depth varies in the hold counts a quarter: a tremor of the hand moves
  // force and angle together. The scatter has all of it.
  constexpr Line line(bool up, bool down, Real noise) const noexcept {
    constexpr Real quarter = Real(0.25);
    Pairs all = sums_[hold], swept = all.gathered(one, quarter);
    for (const int side : {rise, fall}) {
      if (side == rise ? up : down) {
        all.join(sums_[side]);
        swept.join(sums_[side]);
      }
    }
    const Real n = all.at(one, one), least = product(Real(5e-4), all.at(x, x));  // else there is no sweep
    all.sweep(one);
    swept.sweep(one);
    const Real spread = swept.at(x, x), mean = swept.at(one, x);
    if (!(spread > least && swept.sweep(x))) {
      return {};
    }
    // In the coordinate of the contact, at the mean depth.
    const Real of_x = settings.contact_exponent > 1 ? 4 * noise / (9 * mean) : noise;
    const Real share = product(n - product(1 - quarter, number(hold)), of_x) / spread, kept = 1 - share;
    if (!(share < Real(0.3))) {
      return {};
    }
    const Real more = swept.at(x, y);
    const Real rest = all.at(y, y) - product(more, 2 * all.at(x, y) - product(more, all.at(x, x)));
    const Real variance = positive_part(rest) / (n - 2) * swept.error(x);
    return {first_ + (more + product(first_, share)) / kept, variance / product(kept, kept), share};
  }

  Pairs sums_[places] = {};
  Real first_ = 0, highest_ = 0, top_ = 0, since_ = 0;
  bool settled_ = false;
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
