// SPDX-License-Identifier: MIT
#pragma once

// One converter reads the two channels one after the other: both are filtered, with the same response.

#include <palpate/stage/align.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// The variance of a filtered channel for a reading's variance of 1, at 26 ms: both filters of MatchedPair have it.
template <class Real>
inline constexpr Real noise_gain = Real(0.42);

/// What the time from pair to pair does to a tremor.
enum class Pace : std::uint8_t {
  fast,     ///< what the filters leave of it oscillates, and cancels
  slow,     ///< above 1/31 s: not all of it, as jitter of the times is corrected less well
  aliases,  ///< above 1/12 s: it may look like a rest, with another constant in each channel
};

/// A pair of a stage that filters both channels, which a Judge needs.
template <class Real>
struct FilteredPair {
  Real hard;             ///< pF
  Real soft;             ///< pF
  bool valid;            ///< there is a pair
  bool matched = false;  ///< both channels with the same response
};

/// Interpolation of one channel is a low-pass filter of that channel alone. Instead, with h and s on an even grid, s
/// half a period after h,
///
///     y(k) = (1 - 2 a1) h(k) + a1 (h(k-1) + h(k+1))
///     x(k) = (1/2 - b2) (s(k-1) + s(k)) + b2 (s(k-2) + s(k+1))
///
/// whose responses A = 1 - 2 a1 (1 - cos a) and B = (1 - 2 b2) cos(a/2) + 2 b2 cos(3a/2), a the phase from pair to pair,
/// differ by 0.12 % rms from 3 to 13 Hz at 26 ms (interpolation: 6 %), by 0.02 % at 18 and 1.9 % at 40 ms. The delay is
/// that of Align. How far the times are from the grid is corrected by the slope:
/// v - (v(k+1) - v(k-1)) / 2 * deviation.
///
/// a1 and b2 are the least-squares solution for |A - B|^2 from 0.2 to 13 Hz (weight 1 from 3 Hz on, 0.3 below), to a
/// hundredth, as polynomials of the squared period; at 0 the powers of `a` up to the fifth agree. Above 40 ms the filter
/// stays the same, and differs more: 7 % rms at 50 ms, 27 % at 60; there the pair is not matched. (Interpolation: 71 and
/// 102 %.)
template <class Real, class Time>
class MatchedPair {
 public:
  using time_type = Time;  ///< Ticks with their unit

  /// As Align::feed. On an uneven grid pairs are left out, and after 8 of them interpolated.
  PALPATE_INLINE constexpr FilteredPair<Real> feed(Time hard_time, Time soft_time, Real hard, Real soft,
                                                   bool wanted = true) noexcept {
    if (!readings_.add(hard_time, soft_time, hard, soft)) {
      return {hard, soft, false};
    }
    const int i = readings_.middle();
    if (i < 0) {
      return {readings_.hard[0], readings_.soft[0], false};
    }
    if (readings_.hard.time(i) == readings_.soft.time(1)) {  // both at once: there is nothing to align
      pace_ = Pace::fast;
      return {readings_.hard[i], readings_.soft[1], true, true};
    }
    if (i >= 1 && i + 1 < readings_.hard.filled()) {
      const Grid grid = fitted(i);
      if (grid.even || uneven_ == patience) {
        pace_ = grid.period > shortest_alias ? Pace::aliases : grid.period > shortest_slow ? Pace::slow : Pace::fast;
      }
      if (grid.even) {
        uneven_ = 0;
        return wanted ? filtered(i, grid) : FilteredPair<Real>{hard, soft, false};
      }
    }
    return interpolated(i);
  }

  /// Forget the readings.
  constexpr void reset() noexcept { readings_.reset(); }

  /// How slow the pairs are: of the last window whose period is known.
  constexpr Pace pace() const noexcept { return pace_; }

 private:
  using Signed = typename Time::Signed;
  static constexpr int patience = 8;
  static constexpr Signed longest = Time::second / 25;  // period: 40 ms
  static constexpr Signed shortest_slow = Time::second / 31, shortest_alias = Time::second / 12;

  struct Grid {
    Signed hard_before, hard_after, soft[4];  // deviations, ticks
    Signed period;
    bool even;
  };

  // A grid around the hard reading in the middle, with the mean period of the soft ones.
  constexpr Grid fitted(int i) const noexcept {
    const auto& hard = readings_.hard;
    const auto& soft = readings_.soft;
    const Time centre = hard.time(i);
    const Signed period = soft.time(0).since(soft.time(3)) / 3, half = period / 2, limit = period / 4;
    const auto deviation = [centre](Time time, Signed step) { return time.since(centre.later(step)); };
    Grid grid{deviation(hard.time(i + 1), -period),
              deviation(hard.time(i - 1), period),
              {deviation(soft.time(3), -period - half), deviation(soft.time(2), -half), deviation(soft.time(1), half),
               deviation(soft.time(0), period + half)},
              period,
              false};
    // -limit < ticks < limit, as an unsigned difference below 0 is large: times that go backwards may be any number of
    // ticks away.
    using Unsigned = typename Time::Unsigned;
    const auto least = static_cast<Unsigned>(limit) - 1, span = least + static_cast<Unsigned>(limit);
    const auto near = [least, span](Signed ticks) { return static_cast<Unsigned>(ticks) + least < span; };
    grid.even = limit > 0 && readings_.near() && near(grid.hard_before) && near(grid.hard_after) &&
                near(grid.soft[0]) && near(grid.soft[1]) && near(grid.soft[2]) && near(grid.soft[3]);
    return grid;
  }

  constexpr FilteredPair<Real> filtered(int i, const Grid& grid) const noexcept {
    const bool slow = grid.period > longest;
    const Real share = 1 / static_cast<Real>(grid.period), period = static_cast<Real>(slow ? longest : grid.period);
    const Real size = product(period, 1 / (Real(0.026) * static_cast<Real>(Time::second)));
    const Real u = product(size, size);
    const Real a1 = Real(0.1875) + product(u, Real(0.0227) + product(u, Real(0.0003)));
    const Real b2 = Real(0.03125) + product(u, Real(0.0109) + product(u, Real(0.0027)));
    const auto part = [share](Signed deviation, Real step) {
      return product(product(static_cast<Real>(deviation), share), step);
    };
    const Real before = readings_.hard[i + 1], now = readings_.hard[i], after = readings_.hard[i - 1];
    const Real sides = (before - part(grid.hard_before, now - before)) + (after - part(grid.hard_after, after - now));
    const Real s[4] = {readings_.soft[3], readings_.soft[2], readings_.soft[1], readings_.soft[0]};
    const Real inner = (s[1] + s[2]) - (part(grid.soft[1], s[2] - s[0]) + part(grid.soft[2], s[3] - s[1])) / 2;
    const Real outer = (s[0] + s[3]) - (part(grid.soft[0], s[1] - s[0]) + part(grid.soft[3], s[3] - s[2]));
    return {now + product(a1, sides - 2 * now), inner / 2 + product(b2, outer - inner), true, !slow};
  }

  // Windows that are not whole are left out, unless there are no others.
  constexpr FilteredPair<Real> interpolated(int i) noexcept {
    uneven_ = static_cast<std::uint8_t>(uneven_ + (uneven_ < patience));
    const bool valid = uneven_ == patience && readings_.near();
    return {readings_.hard[i], readings_.soft_at(readings_.hard.time(i)), valid};
  }

  LastReadings<Real, Time> readings_;
  std::uint8_t uneven_ = 0;
  Pace pace_ = Pace::fast;
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
