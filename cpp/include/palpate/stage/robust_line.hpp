// SPDX-License-Identifier: MIT
#pragma once

// Level, slope and noise of a few values, of which some are outliers.

#include <palpate/arithmetic.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// Size values in two halves, the earlier and the later one, each kept sorted. Without Line there is no slope, and all
/// are in the first half.
template <class Real, int Size, bool Line = true>
class RobustLine {
  static constexpr int half = Line ? Size / 2 : Size;

 public:
  struct Summary {
    Real mean, count;   // of the values near the median
    Real slope;         // from value to value, between the medians of the halves
    Real noise, floor;  // standard deviation of one value, and its lower limit
  };

  /// Add the value with this index, from 0.
  constexpr void add(int index, Real value) noexcept {
    const Real* const begin = values_ + (index < half ? 0 : half);
    Real* place = values_ + index;
    for (; place != begin && place[-1] > value; --place) {
      *place = place[-1];
    }
    *place = value;
  }

  constexpr Summary summary(Real clip) const noexcept {
    Summary found{};
    const Ranks ranks = merged();
    const Real lowest = least(ranks.median);
    found.floor = ranks.step > 2 * lowest && ranks.step < std::numeric_limits<Real>::max() ? ranks.step / 2 : lowest;
    // The quartiles of a normal distribution, each moved inwards by one value, differ by 1.25 standard deviations.
    const Real wide = (ranks.upper - ranks.lower) / Real(1.25);
    found.noise = wide > found.floor ? wide : found.floor;
    add_near(ranks.median, product(clip, found.noise), found);
    if constexpr (Line) {
      add_line(found);
    }
    return found;
  }

  /// The lower limit of the noise of data without visible noise: 1e-6 pF, or 2^-20 of a smaller level, so that it fits any
  /// unit.
  static constexpr Real least(Real level) noexcept {
    const Real relative = magnitude(level) / (1 << 20) + Real(1e-18);
    return relative < Real(1e-6) ? relative : Real(1e-6);
  }

  constexpr Real& value(int i) noexcept { return values_[i]; }

 private:
  struct Ranks {
    Real lower, median, upper, step;
  };

  // Of all values in order. A step between codes is 3.5 standard deviations of the rounding; half a step is a safe lower
  // limit of the noise.
  constexpr Ranks merged() const noexcept {
    Ranks ranks{0, 0, 0, std::numeric_limits<Real>::max()};
    Real before = 0;
    for (int k = 0, i = 0, j = half; k < Size; ++k) {
      const bool first = !Line || j == Size || (i < half && values_[i] <= values_[j]);
      const Real value = first ? values_[i++] : values_[j++];
      const Real difference = value - before;
      ranks.step = k > 0 && difference > 0 && difference < ranks.step ? difference : ranks.step;
      ranks.lower = k == Size / 4 ? value : ranks.lower;
      ranks.median = k == Size / 2 ? before / 2 + value / 2 : ranks.median;  // their sum may be too large
      ranks.upper = k == 3 * Size / 4 - 1 ? value : ranks.upper;
      before = value;
    }
    return ranks;
  }

  constexpr void add_near(Real median, Real limit, Summary& found) const noexcept {
    Real sum = 0;
    int count = 0;
    for (const Real value : values_) {
      const bool near = !(magnitude(value - median) > limit);
      sum += near ? value - median : Real(0);
      count += near;
    }
    found.count = static_cast<Real>(count);
    found.mean = median + sum / found.count;
  }

  // A difference above 10 standard deviations is no drift, but a touch or a jump.
  constexpr void add_line(Summary& found) const noexcept {
    const Real rise = middle(half) - middle(0), noise = (width(0) + width(half)) / 2;
    const bool drifts = magnitude(rise) < 10 * (noise > found.floor ? noise : found.floor);
    found.slope = drifts ? rise / Real(half) : Real(0);
  }

  constexpr Real middle(int begin) const noexcept {
    return values_[begin + half / 2 - 1] / 2 + values_[begin + half / 2] / 2;
  }
  // The same for a half, moved inwards by half a value: 1.14 standard deviations for 16 values.
  constexpr Real width(int begin) const noexcept {
    return (values_[begin + 3 * half / 4 - 1] - values_[begin + half / 4]) / Real(1.14);
  }

  Real values_[Size] = {};
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
