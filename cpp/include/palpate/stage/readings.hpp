// SPDX-License-Identifier: MIT
#pragma once

// The last readings of both channels with their times: what the alignment stages have in common.
// Times are integer ticks of any unit; only their differences become Real.

#include <cstdint>
#include <palpate/arithmetic.hpp>
#include <palpate/settings.hpp>
#include <utility>

namespace palpate {

/// Both channels at one time; valid is false if there is no pair.
template <class Real>
struct Pair {
  Real hard;
  Real soft;
  bool valid;
  bool matched = false;  // both channels with the same response
};

/// Times are integers: a time in float32 is too inexact after a minute.
template <class Ticks>
inline constexpr bool is_ticks = std::is_integral_v<Ticks> && sizeof(Ticks) >= 4;

/// Ticks of 64 bits are nanoseconds, others are microseconds.
template <class Ticks>
inline constexpr Ticks ticks_per_second = static_cast<Ticks>(sizeof(Ticks) >= 8 ? 1000000000 : 1000000);

/// later - earlier, computed with unsigned ticks, which may wrap.
template <class Ticks>
constexpr auto ticks_between(Ticks later, Ticks earlier) noexcept {
  using Unsigned = std::make_unsigned_t<Ticks>;
  const auto wrapped = static_cast<Unsigned>(static_cast<Unsigned>(later) - static_cast<Unsigned>(earlier));
  return static_cast<std::make_signed_t<Ticks>>(wrapped);
}
template <class Real, class Ticks>
constexpr Real seconds_between(Ticks later, Ticks earlier) noexcept {
  return static_cast<Real>(ticks_between(later, earlier)) / static_cast<Real>(ticks_per_second<Ticks>);
}

/// The last Order soft readings, oldest first, and the last Hards hard ones, newest first.
template <class Real, class Ticks, int Order, int Hards = Order / 2 + 1>
class LastReadings {
  static_assert(is_ticks<Ticks>, "palpate::Align: Ticks must be an integer of 32 or 64 bits");

 public:
  static constexpr int half = Order / 2;

  /// Takes one reading of each channel; NaN: a missing reading. Returns whether there is a soft one, and all Order.
  constexpr bool add(Ticks at_hard, Ticks at_soft, Real new_hard, Real new_soft) noexcept {
    if (is_finite(new_soft)) {
      push_soft(at_soft, new_soft);
    }
    if (is_finite(new_hard)) {
      push_hard(at_hard, new_hard);
    }
    return is_finite(new_soft) && soft_filled == Order;
  }

  constexpr void reset() noexcept { soft_filled = hard_filled = 0; }

  /// The newest hard reading between the two soft ones in the middle; -1: there is none.
  constexpr int middle() const noexcept {
    for (int i = 0; i < hard_filled && i <= half; ++i) {
      if (difference(hard_time[i], soft_time[half - 1]) > 0 && !(difference(hard_time[i], soft_time[half]) > 0)) {
        return i;
      }
    }
    return -1;
  }

  /// Ticks from one soft reading in the middle to the other.
  constexpr auto gap() const noexcept { return ticks_between(soft_time[half], soft_time[half - 1]); }

  /// The soft channel at a time: Lagrange interpolation through all Order values.
  constexpr Real soft_at(Ticks time) const noexcept {
    return interpolated(time, std::make_integer_sequence<int, Order>());
  }

  // In units of 2^24 ticks: this scaling is exact, and near 1 for milliseconds in nanoseconds, so that products of five
  // stay in the range of float.
  static constexpr Real difference(Ticks later, Ticks earlier) noexcept {
    return product(static_cast<Real>(ticks_between(later, earlier)), Real(1) / Real(16777216));
  }

  Ticks soft_time[Order] = {};
  Real soft[Order] = {};
  Ticks hard_time[Hards] = {};
  Real hard[Hards] = {};
  std::uint8_t soft_filled = 0, hard_filled = 0;

 private:
  constexpr void push_soft(Ticks time, Real value) noexcept {
    if (soft_filled > 0 && !(difference(time, soft_time[Order - 1]) > 0)) {
      reset();  // the time decreased, or did not change: start again
    }
    for (int i = 1; i < Order; ++i) {
      soft_time[i - 1] = soft_time[i];
      soft[i - 1] = soft[i];
    }
    soft_time[Order - 1] = time;
    soft[Order - 1] = value;
    soft_filled = static_cast<std::uint8_t>(soft_filled + (soft_filled < Order));
  }

  constexpr void push_hard(Ticks time, Real value) noexcept {
    for (int i = Hards - 1; i > 0; --i) {
      hard_time[i] = hard_time[i - 1];
      hard[i] = hard[i - 1];
    }
    hard_time[0] = time;
    hard[0] = value;
    hard_filled = static_cast<std::uint8_t>(hard_filled + (hard_filled < Hards));
  }

  // Folds over the sequence I are unrolled by every compiler; loops would take three times as long.
  template <int... I>
  constexpr Real interpolated(Ticks time, std::integer_sequence<int, I...> all) const noexcept {
    const Real node[] = {difference(soft_time[I], soft_time[half])...};
    const Real at = difference(time, soft_time[half]);
    Real sum = 0;
    ((sum += term<I>(node, at, all)), ...);
    return sum;
  }

  template <int I, int... J>
  constexpr Real term(const Real (&node)[Order], Real at, std::integer_sequence<int, J...>) const noexcept {
    Real above = soft[I], below = 1;
    ((above = J == I ? above : product(above, at - node[J])), ...);
    ((below = J == I ? below : product(below, node[I] - node[J])), ...);
    return above / below;
  }
};

}  // namespace palpate
