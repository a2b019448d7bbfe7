// SPDX-License-Identifier: MIT
#pragma once

// One converter reads the two channels one after the other: the soft channel is interpolated to the times of the hard
// channel.
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
};

/// The null stage: both values unchanged.
template <class Real, class Ticks>
struct NoAlign {
  using ticks_type = Ticks;
  constexpr Pair<Real> feed(Ticks, Ticks, Real hard, Real soft) noexcept {
    return {hard, soft, is_finite(hard) && is_finite(soft)};
  }
  constexpr void reset() noexcept {}
};

/// Times are integers: a time in float32 is too inexact after a minute.
template <class Ticks>
inline constexpr bool is_ticks = std::is_integral_v<Ticks> && sizeof(Ticks) >= 4;

template <class Ticks>
struct AlignSettings {
  // Longest time between two soft values for an interpolation: 1 s, if ticks of 64 bits are nanoseconds and others are
  // microseconds.
  Ticks max_gap = static_cast<Ticks>(sizeof(Ticks) >= 8 ? 1000000000 : 1000000);

  template <class Visit>
  static constexpr void visit_fields(Visit&& visit) noexcept {
    visit("max_gap", &AlignSettings::max_gap);
  }
};

/// Lagrange interpolation through Order soft values around a hard one, with their real times; Order 2, 4 or 6. The
/// delay is Order / 2 - 1 pairs (one more if the soft channel is read first). For Order 4 the relative error of a sine
/// whose phase changes by a between two soft values is 1 - (9 cos(a / 2) - cos(3 a / 2)) / 8: 5 % at 8 Hz and 26 ms.
template <class Real, class Ticks, int Order = 4, class Settings = Kept<AlignSettings<Ticks>>>
class Align : public Settings {
  static_assert(Order == 2 || Order == 4 || Order == 6, "palpate::Align: Order must be 2, 4 or 6");
  static_assert(is_ticks<Ticks>, "palpate::Align: Ticks must be an integer of 32 or 64 bits");
  static constexpr int half = Order / 2;

 public:
  using ticks_type = Ticks;
  using Settings::settings;

  /// Takes one reading of each channel; NaN: a missing reading. Returns the pair that is complete with it.
  constexpr Pair<Real> feed(Ticks hard_time, Ticks soft_time, Real hard, Real soft) noexcept {
    if (is_finite(soft)) {
      push_soft(soft_time, soft);
    }
    if (is_finite(hard)) {
      push_hard(hard_time, hard);
    }
    return is_finite(soft) && soft_filled_ == Order ? centre() : Pair<Real>{hard, soft, false};
  }

  constexpr void reset() noexcept { soft_filled_ = hard_filled_ = 0; }

 private:
  constexpr void push_soft(Ticks time, Real value) noexcept {
    if (soft_filled_ > 0 && !(difference(time, soft_time_[Order - 1]) > 0)) {
      reset();  // the time decreased, or did not change: start again
    }
    for (int i = 1; i < Order; ++i) {
      soft_time_[i - 1] = soft_time_[i];
      soft_[i - 1] = soft_[i];
    }
    soft_time_[Order - 1] = time;
    soft_[Order - 1] = value;
    if (soft_filled_ < Order) {
      ++soft_filled_;
    }
  }

  constexpr void push_hard(Ticks time, Real value) noexcept {
    for (int i = half; i > 0; --i) {
      hard_time_[i] = hard_time_[i - 1];
      hard_[i] = hard_[i - 1];
    }
    hard_time_[0] = time;
    hard_[0] = value;
    if (hard_filled_ <= half) {
      ++hard_filled_;
    }
  }

  /// The newest hard value between the two soft ones in the middle.
  constexpr Pair<Real> centre() const noexcept {
    const Ticks from = soft_time_[half - 1], to = soft_time_[half];
    for (int i = 0; i < hard_filled_; ++i) {
      if (difference(hard_time_[i], from) > 0 && !(difference(hard_time_[i], to) > 0) &&
          apart(to, from) <= static_cast<std::make_signed_t<Ticks>>(settings.max_gap)) {
        return {hard_[i], interpolated(hard_time_[i], std::make_integer_sequence<int, Order>()), true};
      }
    }
    return {hard_[0], soft_[Order - 1], false};
  }

  // Folds over the sequence I are unrolled by every compiler; loops would take three times as long.
  template <int... I>
  constexpr Real interpolated(Ticks time, std::integer_sequence<int, I...> all) const noexcept {
    const Real node[] = {difference(soft_time_[I], soft_time_[half])...};
    const Real at = difference(time, soft_time_[half]);
    Real sum = 0;
    ((sum += term<I>(node, at, all)), ...);
    return sum;
  }

  template <int I, int... J>
  constexpr Real term(const Real (&node)[Order], Real at, std::integer_sequence<int, J...>) const noexcept {
    Real above = soft_[I], below = 1;
    ((above = J == I ? above : product(above, at - node[J])), ...);
    ((below = J == I ? below : product(below, node[I] - node[J])), ...);
    return above / below;
  }

  // Computed with unsigned ticks, which may wrap.
  static constexpr auto apart(Ticks later, Ticks earlier) noexcept {
    using Unsigned = std::make_unsigned_t<Ticks>;
    const auto wrapped = static_cast<Unsigned>(static_cast<Unsigned>(later) - static_cast<Unsigned>(earlier));
    return static_cast<std::make_signed_t<Ticks>>(wrapped);
  }

  // In units of 2^24 ticks: this scaling is exact, and near 1 for milliseconds in nanoseconds, so that products of five
  // stay in the range of float.
  static constexpr Real difference(Ticks later, Ticks earlier) noexcept {
    return product(static_cast<Real>(apart(later, earlier)), Real(1) / Real(16777216));
  }

  Ticks soft_time_[Order] = {};
  Real soft_[Order] = {};
  Ticks hard_time_[half + 1] = {};
  Real hard_[half + 1] = {};
  std::uint8_t soft_filled_ = 0, hard_filled_ = 0;
};

}  // namespace palpate
