// SPDX-License-Identifier: MIT
#pragma once

// A channel that stands still: at a known end of the range of its converter, or to the last digit.

#include <palpate/time.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// The readings of one channel that are no outliers.
template <class Real, class Time>
class Standstill {
  // pF: AD7746; twice that, where its range is extended; FDC1004.
  static constexpr Real ends[] = {Real(4.096), Real(8.192), Real(15)};
  static constexpr Real coarsest =
      Real(0.02);                             // code, pF, with which a reading is at an end; and how far beyond is over
  static constexpr int in_a_row = 8;          // readings at an end
  static constexpr std::uint32_t usual = 12;  // equal readings in a row: the codes are coarse
  static constexpr std::uint32_t more = 8;    // times as many as ever before
  static constexpr std::uint32_t shortest = 20;  // of a channel that stands still, for at least a second
  static constexpr std::uint32_t fewest = 40;    // before that
  static constexpr Real never = Real(10);        // seconds without any change

 public:
  /// Takes a reading; NaN: none; `code`: the smallest change that was seen, 0: none. Returns at_end().
  PALPATE_INLINE constexpr bool follow(Time time, Real value, Real code) noexcept {
    if (!is_finite(value)) {
      return at_end();
    }
    if (PALPATE_UNLIKELY(value > highest_ || value < lowest_ || code != code_)) {
      widen(value, code);
    }
    if (PALPATE_UNLIKELY(reaches_)) {
      const bool there = magnitude(value - top_) <= tolerance(code) || magnitude(value + bottom_) <= tolerance(code);
      at_end_ = static_cast<std::uint8_t>(there ? at_end_ + (at_end_ < in_a_row) : 0);
    }
    if (value == last_) {
      equal_ += 1;
      return at_end();
    }
    if (PALPATE_UNLIKELY(equal_ > 0)) {
      longest_ = is_frozen_ || equal_ < longest_ ? longest_ : equal_;
      equal_ = 0;
      is_frozen_ = false;
    }
    if (PALPATE_UNLIKELY(moved_ < fewest)) {
      moved_ += 1;
    }
    last_ = value;
    since_ = time;
    return at_end();
  }

  /// Whether it does not stand still at all.
  constexpr bool moves() const noexcept { return equal_ == 0 && at_end_ == 0; }
  /// Whether the last readings are at a known end of the range.
  constexpr bool at_end() const noexcept { return at_end_ >= in_a_row; }
  /// Whether this is new: once.
  constexpr bool came_to_end() noexcept {
    const bool is_new = at_end_ == in_a_row;
    at_end_ = static_cast<std::uint8_t>(at_end_ + is_new);
    return is_new;
  }
  /// Since when the channel stands still.
  constexpr Time since() const noexcept { return since_; }

  /// Whether it is new that the channel stands still: no reading ever differed, or before there was nothing like it.
  /// Where the codes are coarser than the noise, this is no news. `last`: no reading will follow.
  PALPATE_INLINE constexpr bool freezes(Time time, bool last = false) noexcept {
    if (PALPATE_LIKELY(equal_ < shortest || is_frozen_)) {
      return false;
    }
    const Real seconds = time.template seconds_since<Real>(since_);
    const bool is_new = moved_ == fewest && longest_ < usual && equal_ > more * longest_ && seconds >= 1;
    is_frozen_ = highest_ == lowest_ ? last || seconds >= never : is_new;
    return is_frozen_;
  }

 private:
  static constexpr Real tolerance(Real code) noexcept { return product(Real(0.55), code) + Real(1e-4); }

  // The end of a range at which readings from 0 to `most` stop; else NaN.
  static constexpr Real end_of(Real most, Real code) noexcept {
    for (const Real end : ends) {
      if (most >= end - tolerance(code) && most <= end + coarsest && code <= coarsest) {
        return end;
      }
    }
    return not_a_number<Real>;
  }

  constexpr void widen(Real value, Real code) noexcept {
    code_ = code;
    highest_ = value > highest_ ? value : highest_;
    lowest_ = value < lowest_ ? value : lowest_;
    top_ = end_of(highest_, code);
    bottom_ = end_of(-lowest_, code);
    reaches_ = top_ == top_ || bottom_ == bottom_;
    at_end_ = reaches_ ? at_end_ : 0;
  }

  Real highest_ = -std::numeric_limits<Real>::infinity(), lowest_ = std::numeric_limits<Real>::infinity();
  Real top_ = not_a_number<Real>, bottom_ = not_a_number<Real>;  // known ends at both, that of the lowest one negated
  Real last_ = not_a_number<Real>, code_ = 0;
  std::uint32_t equal_ = 0, longest_ = 0;  // readings equal to the one before them, in a row
  std::uint32_t moved_ = 0;                // other readings, at most `fewest`
  Time since_;
  std::uint8_t at_end_ = 0;
  bool reaches_ = false;  // it has been at a known end
  bool is_frozen_ = false;
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
