// SPDX-License-Identifier: MIT
#pragma once

// One converter reads the two channels one after the other: the soft channel is interpolated to the times of the hard
// channel.

#include <palpate/stage/readings.hpp>

namespace palpate {

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

/// Settings of Align.
template <class Ticks>
struct AlignSettings {
  Ticks max_gap = ticks_per_second<Ticks>;  ///< longest time between two soft values for an interpolation

  /// As FixedForgetting::visit_fields.
  template <class Self, class Visit>
  static constexpr void visit_fields(Self& s, Visit&& visit) noexcept {
    visit("max_gap", s.max_gap, s.max_gap > 0, "0 < max_gap");
  }
};

/// Lagrange interpolation through four soft values around a hard one, with their real times. The delay is one pair (two
/// if the soft channel is read first). The relative error of a sine whose phase changes by a between two soft values is
/// 1 - (9 cos(a / 2) - cos(3 a / 2)) / 8: 5 % at 8 Hz and 26 ms.
template <class Real, class Ticks, class Settings = Kept<AlignSettings<Ticks>>>
class Align : public Settings {
 public:
  using ticks_type = Ticks;  ///< of the times: an integer of 32 or 64 bits
  using Settings::settings;

  /// Takes one reading of each channel; NaN: a missing reading. Returns the pair that is complete with it.
  PALPATE_ONCE constexpr Pair<Real> feed(Ticks hard_time, Ticks soft_time, Real hard, Real soft,
                                         bool wanted = true) noexcept {
    Pair<Real> pair{hard, soft, false};
    if (readings_.add(hard_time, soft_time, hard, soft) && wanted) {
      const int i = readings_.middle();
      if (i >= 0 && readings_.gap() <= static_cast<std::make_signed_t<Ticks>>(settings.max_gap)) {
        pair.hard = readings_.hard[i];
        pair.soft = readings_.soft_at(readings_.hard.time(i));
        pair.valid = true;
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
