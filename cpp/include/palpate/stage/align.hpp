// SPDX-License-Identifier: MIT
#pragma once

// One converter reads the two channels one after the other: the soft channel is interpolated to the times of the hard
// channel. And the part that the alignment stages share: the last readings of both channels with their times.

#include <palpate/time.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// Both channels at one time; valid is false if there is no pair.
template <class Real>
struct Pair {
  Real hard;   ///< pF
  Real soft;   ///< pF
  bool valid;  ///< there is a pair
};

/// The last four readings of a channel with their times; index 0 is the newest. A ring: each value is stored once.
template <class Real, class Time>
class RecentValues {
 public:
  static constexpr int size = 4;

  constexpr void push(Time time, Real value) noexcept {
    newest_ = static_cast<std::uint8_t>((newest_ + 1) % size);
    time_[newest_] = time;
    value_[newest_] = value;
    if (PALPATE_UNLIKELY(filled_ < size)) {
      filled_ += 1;
    }
  }
  constexpr int filled() const noexcept { return filled_; }
  PALPATE_INLINE constexpr Time time(int i) const noexcept { return time_[place(i)]; }
  constexpr Real operator[](int i) const noexcept { return value_[place(i)]; }

 private:
  constexpr unsigned place(int i) const noexcept { return (newest_ - static_cast<unsigned>(i)) % size; }

  Time time_[size] = {};
  Real value_[size] = {};
  std::uint8_t newest_ = 0, filled_ = 0;
};

/// The last readings of both channels.
template <class Real, class Time>
class LastReadings {
 public:
  RecentValues<Real, Time> hard, soft;

  /// Takes one reading of each channel; NaN: a missing reading. Returns whether there is a soft one, and all four.
  constexpr bool add(Time hard_time, Time soft_time, Real hard_value, Real soft_value) noexcept {
    const bool any = is_finite(soft_value);
    if (any && soft.filled() > 0 && !(soft_time.since(soft.time(0)) > 0)) {
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
    const Time from = soft.time(2);
    const auto span = soft.time(1).unsigned_since(from);
    for (int i = 0; i < hard.filled() && i <= 2; ++i) {
      if (hard.time(i).unsigned_since(from) - 1 < span) {  // a difference below 0 is large
        return i;
      }
    }
    return -1;
  }

  /// Whether the two soft readings in the middle are near enough for an interpolation: at most a second apart.
  constexpr bool near() const noexcept { return soft.time(1).since(soft.time(2)) <= Time::second; }

  /// The soft channel at a time: Lagrange interpolation through all four values.
  constexpr Real soft_at(Time time) const noexcept { return interpolated(time, std::make_integer_sequence<int, 4>()); }

 private:
  // In units of 2^24 ticks: this scaling is exact, and near 1 for milliseconds in nanoseconds, so that products of three
  // stay in the range of float.
  static constexpr Real difference(Time later, Time earlier) noexcept {
    return product(static_cast<Real>(later.since(earlier)), Real(1) / Real(16777216));
  }

  // Folds over the sequence I are unrolled by every compiler; loops would take three times as long. The oldest first.
  // (Divided differences need fewer operations, but they lose digits where two readings are close together.)
  template <int... I>
  constexpr Real interpolated(Time time, std::integer_sequence<int, I...> all) const noexcept {
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
template <class Real, class Time>
struct NoAlign {
  using time_type = Time;  ///< Ticks with their unit
  /// The pair of these two readings; the times are not used.
  constexpr Pair<Real> feed(Time, Time, Real hard, Real soft, bool = true) noexcept {
    return {hard, soft, is_finite(hard) && is_finite(soft)};
  }
  /// Nothing to forget.
  constexpr void reset() noexcept {}
};

/// Lagrange interpolation through four soft values around a hard one, with their real times. The delay is one pair (two
/// if the soft channel is read first). The relative error of a sine whose phase changes by a between two soft values is
/// 1 - (9 cos(a / 2) - cos(3 a / 2)) / 8: 5 % at 8 Hz and 26 ms.
template <class Real, class Time>
class Align {
 public:
  using time_type = Time;  ///< Ticks with their unit

  /// Takes one reading of each channel; NaN: a missing reading. Returns the pair that is complete with it.
  PALPATE_INLINE constexpr Pair<Real> feed(Time hard_time, Time soft_time, Real hard, Real soft,
                                           bool wanted = true) noexcept {
    if (readings_.add(hard_time, soft_time, hard, soft) && wanted) {
      const int i = readings_.middle();
      if (i >= 0 && readings_.near()) {
        return {readings_.hard[i], readings_.soft_at(readings_.hard.time(i)), true};
      }
    }
    return {hard, soft, false};
  }

  /// Forget the readings.
  constexpr void reset() noexcept { readings_.reset(); }

 private:
  LastReadings<Real, Time> readings_;
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
