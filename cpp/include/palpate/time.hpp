// SPDX-License-Identifier: MIT
#pragma once

// Times of readings: integers with their unit. Only differences become float or double: a time in float is too inexact
// after a minute.

#include <palpate/arithmetic.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// A time of a clock with PerSecond ticks a second, as an integer that may wrap. State a timer of any frequency once:
/// `using Timer = palpate::Ticks<std::uint32_t, 84000000>;`
template <class Integer, std::intmax_t PerSecond>
struct Ticks {
  static_assert(std::is_integral_v<Integer> && sizeof(Integer) >= 4,
                "palpate::Ticks: the ticks are an integer of 32 or 64 bits");
  static_assert(PerSecond >= 1000 && PerSecond <= std::numeric_limits<Integer>::max() / 8,
                "palpate::Ticks: 1000 ticks a second or more, and 8 seconds or more until they wrap");
  using Unsigned = std::make_unsigned_t<Integer>;  ///< in which differences are computed
  using Signed = std::make_signed_t<Integer>;      ///< of differences
  static constexpr Signed second = PerSecond;      ///< ticks

  Integer count = 0;  ///< ticks since any moment

  constexpr Ticks() noexcept = default;
  /// So many ticks. The integer may be narrower than Integer, not wider: its high bits would be lost without a word.
  template <class Given>
  constexpr explicit Ticks(Given ticks) noexcept : count(static_cast<Integer>(ticks)) {
    static_assert(std::is_integral_v<Given>,
                  "palpate::Ticks: times are integers: convert seconds, as static_cast<std::int64_t>(s * 1e9)");
    static_assert(sizeof(Given) <= sizeof(Integer),
                  "palpate::Ticks: this time has more bits than the ticks: use palpate::Nanoseconds, or cast it");
  }

  /// Ticks from an earlier time to this one; below 0 if that is later.
  PALPATE_INLINE constexpr Signed since(Ticks earlier) const noexcept {
    return static_cast<Signed>(unsigned_since(earlier));
  }
  /// The same without a sign: a difference below 0 is large.
  PALPATE_INLINE constexpr Unsigned unsigned_since(Ticks earlier) const noexcept {
    return static_cast<Unsigned>(static_cast<Unsigned>(count) - static_cast<Unsigned>(earlier.count));
  }
  /// Seconds from an earlier time to this one.
  template <class Real>
  PALPATE_INLINE constexpr Real seconds_since(Ticks earlier) const noexcept {
    return static_cast<Real>(since(earlier)) / static_cast<Real>(second);
  }
  /// This time plus a number of ticks.
  PALPATE_INLINE constexpr Ticks later(Signed ticks) const noexcept {
    return Ticks(
        static_cast<Integer>(static_cast<Unsigned>(static_cast<Unsigned>(count) + static_cast<Unsigned>(ticks))));
  }

  /// Whether both are the same moment.
  friend constexpr bool operator==(Ticks left, Ticks right) noexcept { return left.count == right.count; }
};

namespace detail {
template <class Time>
inline constexpr bool is_ticks = false;
template <class Integer, std::intmax_t PerSecond>
inline constexpr bool is_ticks<Ticks<Integer, PerSecond>> = true;
}  // namespace detail

/// Of a computer: 64 bits, which do not wrap.
using Nanoseconds = Ticks<std::int64_t, 1000000000>;
/// Of a microcontroller, as micros() of Arduino gives them: they wrap after 71 minutes.
using Microseconds = Ticks<std::uint32_t, 1000000>;
/// As millis() of Arduino gives them: coarse for the alignment of channels that are read in turn.
using Milliseconds = Ticks<std::uint32_t, 1000>;

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
