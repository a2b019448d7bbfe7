// SPDX-License-Identifier: MIT
#pragma once

// One converter reads the two channels one after the other: the soft channel is interpolated to the times of the hard
// channel. And what the alignment stages have in common: the last readings of both channels with their times, which are
// integer ticks of any unit; only their differences become Real.

#include <palpate/arithmetic.hpp>

namespace palpate {

/// Both channels at one time; valid is false if there is no pair.
template <class Real>
struct Pair {
  Real hard;   ///< pF
  Real soft;   ///< pF
  bool valid;  ///< there is a pair
};

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
/// The time so many ticks later, which may wrap.
template <class Ticks>
constexpr Ticks later(Ticks time, std::make_signed_t<Ticks> ticks) noexcept {
  using Unsigned = std::make_unsigned_t<Ticks>;
  return static_cast<Ticks>(static_cast<Unsigned>(static_cast<Unsigned>(time) + static_cast<Unsigned>(ticks)));
}
/// ticks_between in seconds.
template <class Real, class Ticks>
constexpr Real seconds_between(Ticks later, Ticks earlier) noexcept {
  return static_cast<Real>(ticks_between(later, earlier)) / static_cast<Real>(ticks_per_second<Ticks>);
}

/// The last four readings of a channel with their times; index 0 is the newest. A ring: each value is stored once.
template <class Real, class Ticks>
class Channel {
 public:
  static constexpr int size = 4;

  constexpr void push(Ticks time, Real value) noexcept {
    newest_ = static_cast<std::uint8_t>((newest_ + 1) % size);
    time_[newest_] = time;
    value_[newest_] = value;
    if (PALPATE_UNLIKELY(filled_ < size)) {
      filled_ += 1;
    }
  }
  constexpr int filled() const noexcept { return filled_; }
  constexpr Ticks time(int i) const noexcept { return time_[place(i)]; }
  constexpr Real operator[](int i) const noexcept { return value_[place(i)]; }

 private:
  constexpr unsigned place(int i) const noexcept { return (newest_ - static_cast<unsigned>(i)) % size; }

  Ticks time_[size] = {};
  Real value_[size] = {};
  std::uint8_t newest_ = 0, filled_ = 0;
};

/// The last readings of both channels.
template <class Real, class Ticks>
class LastReadings {
  // A time in float32 is too inexact after a minute.
  static_assert(std::is_integral_v<Ticks> && sizeof(Ticks) >= 4,
                "palpate::Align: Ticks must be an integer of 32 or 64 bits");

 public:
  Channel<Real, Ticks> hard, soft;

  /// Takes one reading of each channel; NaN: a missing reading. Returns whether there is a soft one, and all four.
  constexpr bool add(Ticks hard_time, Ticks soft_time, Real hard_value, Real soft_value) noexcept {
    const bool any = is_finite(soft_value);
    if (any && soft.filled() > 0 && !(ticks_between(soft_time, soft.time(0)) > 0)) {
      reset();  // the time decreased, or did not change: start again
    }
    if (is_finite(hard_value)) {
      hard.push(hard_time, hard_value);
    }
    if (any) {
      soft.push(soft_time, soft_value);
    }
    return any && soft.filled() >= soft.size;
  }

  constexpr void reset() noexcept { *this = {}; }

  /// The newest hard reading after the older one of the two soft ones in the middle, and not after the newer one; -1:
  /// there is none.
  constexpr int middle() const noexcept {
    using Unsigned = std::make_unsigned_t<Ticks>;
    const auto from = static_cast<Unsigned>(soft.time(2)), span = static_cast<Unsigned>(soft.time(1)) - from;
    for (int i = 0; i < hard.filled() && i <= 2; ++i) {
      if (static_cast<Unsigned>(hard.time(i)) - from - 1 < span) {  // an unsigned difference below 0 is large
        return i;
      }
    }
    return -1;
  }

  /// Whether the two soft readings in the middle are near enough for an interpolation: at most a second apart.
  constexpr bool near() const noexcept {
    return ticks_between(soft.time(1), soft.time(2)) <= static_cast<std::make_signed_t<Ticks>>(ticks_per_second<Ticks>);
  }

  /// The soft channel at a time: Lagrange interpolation through all four values.
  constexpr Real soft_at(Ticks time) const noexcept { return interpolated(time, std::make_integer_sequence<int, 4>()); }

 private:
  // In units of 2^24 ticks: this scaling is exact, and near 1 for milliseconds in nanoseconds, so that products of three
  // stay in the range of float.
  static constexpr Real difference(Ticks later, Ticks earlier) noexcept {
    return product(static_cast<Real>(ticks_between(later, earlier)), Real(1) / Real(16777216));
  }

  // Folds over the sequence I are unrolled by every compiler; loops would take three times as long. The oldest first.
  // (Divided differences need fewer operations, but they lose digits where two readings are close together.)
  template <int... I>
  constexpr Real interpolated(Ticks time, std::integer_sequence<int, I...> all) const noexcept {
    const Real node[] = {difference(soft.time(3 - I), time)...};
    Real sum = 0;
    ((sum = I % 2 == 0 ? sum + term<I>(node, all) : sum - term<I>(node, all)), ...);
    return sum;
  }

  // Without the sign (-1)^I: each difference is that of the later node, and serves two terms.
  template <int I, int... J>
  constexpr Real term(const Real (&node)[4], std::integer_sequence<int, J...>) const noexcept {
    Real above = 1, below = 1;
    ((above = J == I ? above : product(above, node[J])), ...);
    // NOLINTNEXTLINE(bugprone-branch-clone): they differ where J is not I
    ((below = J == I ? below : product(below, J < I ? node[I] - node[J] : node[J] - node[I])), ...);
    return product(soft[3 - I], above / below);
  }
};

/// The null stage: both values unchanged. In every stage, feed's `wanted` says whether the pair is used: the readings are
/// kept anyway.
template <class Real, class Ticks>
struct NoAlign {
  using ticks_type = Ticks;  ///< of the times: an integer of 32 or 64 bits
  /// The pair of these two readings; the times are not used.
  constexpr Pair<Real> feed(Ticks, Ticks, Real hard, Real soft, bool = true) noexcept {
    return {hard, soft, is_finite(hard) && is_finite(soft)};
  }
  /// Nothing to forget.
  constexpr void reset() noexcept {}
};

/// Lagrange interpolation through four soft values around a hard one, with their real times. The delay is one pair (two
/// if the soft channel is read first). The relative error of a sine whose phase changes by a between two soft values is
/// 1 - (9 cos(a / 2) - cos(3 a / 2)) / 8: 5 % at 8 Hz and 26 ms.
template <class Real, class Ticks>
class Align {
 public:
  using ticks_type = Ticks;  ///< of the times: an integer of 32 or 64 bits

  /// Takes one reading of each channel; NaN: a missing reading. Returns the pair that is complete with it.
  PALPATE_ONCE constexpr Pair<Real> feed(Ticks hard_time, Ticks soft_time, Real hard, Real soft,
                                         bool wanted = true) noexcept {
    Pair<Real> pair{hard, soft, false};
    if (readings_.add(hard_time, soft_time, hard, soft) && wanted) {
      const int i = readings_.middle();
      if (i >= 0 && readings_.near()) {
        pair = {readings_.hard[i], readings_.soft_at(readings_.hard.time(i)), true};
      }
    }
    return pair;
  }

  /// Forget the readings.
  constexpr void reset() noexcept { readings_.reset(); }

 private:
  LastReadings<Real, Ticks> readings_;
};

}  // namespace palpate
