// SPDX-License-Identifier: MIT
#pragma once

// Level, slope and noise of a few values, of which some are outliers.

#include <palpate/arithmetic.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// At most Size values in two halves, the earlier and the later one, each sorted. Without Line there is no slope, and
/// all are in the first half. Timed: their number is known at the end.
template <class Real, int Size, bool Line = true, bool Timed = false>
class RobustLine {
 public:
  struct Summary {
    Real mean, count;   // of the values near the median
    Real slope;         // from value to value, between the medians of the halves
    Real noise, floor;  // standard deviation of one value, and its lower limit
  };

  /// Add the value with this index, from 0.
  constexpr void add(int index, Real value) noexcept {
    if constexpr (Timed) {
      values_[index] = value;
    } else {
      sort_in(index, value, Line ? Size / 2 : Size);
    }
  }

  /// Of the first `size` values, 4 or more.
  constexpr Summary summary(Real clip, int size) noexcept {
    const int half = Line ? size / 2 : size;
    if constexpr (Timed) {
      for (int i = 0; i < size; ++i) {
        sort_in(i, values_[i], half);
      }
    }
    Summary found{};
    const Ranks ranks = merged(size, half);
    const Real lowest = least(ranks.median);
    found.floor = ranks.step > 2 * lowest && ranks.step < std::numeric_limits<Real>::max() ? ranks.step / 2 : lowest;
    // The quartiles of a normal distribution, each moved inwards by one value, differ by 1.25 standard deviations; of
    // 5 values by 1. And few values may agree by chance.
    const Real wide = (ranks.upper - ranks.lower) / Real(1.25),
               few = 1 + (Real(Size) / static_cast<Real>(size) - 1) / 6;
    const Real known = Timed ? product(wide, few) : wide;
    found.noise = known > found.floor ? known : found.floor;
    add_near(ranks.median, product(clip, found.noise), size, found);
    if constexpr (Line) {
      add_line(size, found);
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

  constexpr void sort_in(int index, Real value, int half) noexcept {
    const Real* const begin = values_ + (index < half ? 0 : half);
    Real* place = values_ + index;
    for (; place != begin && place[-1] > value; --place) {
      *place = place[-1];
    }
    *place = value;
  }

  // Of all values in order. A step between codes is 3.5 standard deviations of the rounding; half a step is a safe lower
  // limit of the noise.
  constexpr Ranks merged(int size, int half) const noexcept {
    Ranks ranks{0, 0, 0, std::numeric_limits<Real>::max()};
    Real before = 0;
    for (int k = 0, i = 0, j = half; k < size; ++k) {
      const bool first = !Line || j == size || (i < half && values_[i] <= values_[j]);
      const Real value = first ? values_[i++] : values_[j++];
      const Real difference = value - before;
      ranks.step = k > 0 && difference > 0 && difference < ranks.step ? difference : ranks.step;
      ranks.lower = k == size / 4 ? value : ranks.lower;
      const Real other = size % 2 == 0 ? before : value;
      ranks.median = k == size / 2 ? other / 2 + value / 2 : ranks.median;  // their sum may be too large
      ranks.upper = k == size - 1 - size / 4 ? value : ranks.upper;
      before = value;
    }
    return ranks;
  }

  constexpr void add_near(Real median, Real limit, int size, Summary& found) const noexcept {
    Real sum = 0;
    int count = 0;
    for (int i = 0; i < size; ++i) {
      const bool near = !(magnitude(values_[i] - median) > limit);
      sum += near ? values_[i] - median : Real(0);
      count += near;
    }
    found.count = static_cast<Real>(count);
    found.mean = median + sum / found.count;
  }

  // A difference above 10 standard deviations is no drift, but a touch or a jump. Between the middles of the halves there
  // is half the size, also of an odd one.
  constexpr void add_line(int size, Summary& found) const noexcept {
    const int early = size / 2, late = size - early;
    const Real rise = middle(early, late) - middle(0, early), noise = (width(0, early) + width(early, late)) / 2;
    const bool drifts = magnitude(rise) < 10 * (noise > found.floor ? noise : found.floor);
    found.slope = drifts ? rise / (static_cast<Real>(size) / 2) : Real(0);
  }

  constexpr Real middle(int begin, int size) const noexcept {
    return values_[begin + (size - 1) / 2] / 2 + values_[begin + size / 2] / 2;
  }
  // The same for a half, moved inwards by half a value: 1.14 standard deviations for 16 values.
  constexpr Real width(int begin, int size) const noexcept {
    return (values_[begin + size - 1 - size / 4] - values_[begin + size / 4]) / Real(1.14);
  }

  Real values_[Size] = {};
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
