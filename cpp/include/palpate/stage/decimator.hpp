// SPDX-License-Identifier: MIT
#pragma once

// Fewer pairs from a fast converter, each the mean of many readings.

#include <palpate/stage/align.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// A reading of each channel, or the mean of several, and the aligned pair that is complete with it.
template <class Time, class Real, class Pair>
struct Frame {
  Time time;               ///< of the hard channel
  Real hard;               ///< pF
  Real soft;               ///< pF
  Pair pair;               ///< of the aligned channels
  std::uint32_t size = 1;  ///< readings in it; 0: there is none yet
};

/// The null stage: each reading counts.
struct NoDecimator {
  /// @{
  /// As the function of Decimator of this name.
  static constexpr void reset() noexcept {}
  static constexpr void next() noexcept {}
  static constexpr void begin(std::size_t) noexcept {}
  static constexpr std::size_t size() noexcept { return 1; }
  static constexpr bool fast() noexcept { return false; }
  static constexpr std::size_t pairs(std::size_t readings) noexcept { return readings; }
  static constexpr std::size_t first(std::size_t reading) noexcept { return reading; }
  /// @}
};

/// Means over about `longest` ticks each of a converter with more than 3 readings in it. The later stages have memories
/// in pairs, and would not take the disturbances within them, which are slow there, for noise. The readings of a slower
/// converter stay as they are. `Pair` is the result of the alignment.
template <class Real, class Time, class Pair>
class Decimator {
  using Unsigned = typename Time::Unsigned;
  static constexpr Unsigned few = 3;      // readings in `longest`, which are no reason for a mean
  static constexpr Unsigned memory = 32;  // of the mean step between readings, which may come in bursts
  static constexpr int unknown = -1;

 public:
  using Mean = Frame<Time, Real, Pair>;  ///< of readings, and of their valid pairs

  /// Number of readings in the last mean.
  constexpr std::size_t size() const noexcept { return size_; }
  /// Whether the converter is fast.
  constexpr bool fast() const noexcept { return fast_ > 0; }

  /// Forget the readings of a mean that is not complete; how fast the converter is stays.
  constexpr void reset() noexcept { count_ = 0; }
  /// A pair is complete, with or without values.
  constexpr void next() noexcept { pairs_ += 1; }
  /// A touch began `age` pairs ago.
  constexpr void begin(std::size_t age) noexcept { first_ = pairs_ + 1 > age ? pairs_ + 1 - age : 0; }
  /// Number of the pairs before this one.
  constexpr std::size_t pairs(std::size_t) const noexcept { return pairs_; }
  /// Number of the first pair of a touch.
  constexpr std::size_t first(std::size_t) const noexcept { return first_; }

  /// Takes the time of a reading of each channel, both with a value. Returns whether it is to become part of a mean.
  PALPATE_INLINE constexpr bool follow(Time time, Unsigned longest) noexcept {
    const Unsigned since = time.unsigned_since(last_);
    const Unsigned step = since - 1 < 2 * longest ? since : 2 * longest;  // a difference below 0 is large
    last_ = time;
    pace_ = pace_ - pace_ / memory + step / memory;
    return !PALPATE_LIKELY(pace_ >= longest / few && fast_ == 0) && judge(longest);
  }

  /// Add a reading of each channel, and the pair that is complete with it. Returns the mean of those before, where it is
  /// complete.
  constexpr Mean add(Time time, Real hard, Real soft, const Pair& pair, Unsigned longest) noexcept {
    Mean mean{{}, 0, 0, {}, 0};
    // After a gap, and where the time goes back, too.
    if (count_ > 0 && time.unsigned_since(begin_) >= longest - pace_ / 2) {
      mean = {begin_.later(static_cast<typename Time::Signed>(time_)), hard_, soft_, pair_, count_};
      size_ = count_;
      count_ = 0;
    }
    if (count_ == 0) {
      start(time);
    }
    if (!is_finite(hard - hard_) || !is_finite(soft - soft_)) {
      return mean;  // two readings near the limits of Real have no mean: the later one is left out
    }
    count_ += 1;
    const Real part = 1 / static_cast<Real>(count_);
    time_ += product(part, static_cast<Real>(time.unsigned_since(begin_)) - time_);
    hard_ += product(part, hard - hard_);
    soft_ += product(part, soft - soft_);
    if (pair.valid && is_finite(pair.hard - pair_.hard) && is_finite(pair.soft - pair_.soft)) {
      add(pair);
    }
    return mean;
  }

 private:
  constexpr void start(Time time) noexcept {
    begin_ = time;
    time_ = hard_ = soft_ = 0;
    pair_ = {};
    pair_.matched = true;
    pair_count_ = 0;
  }

  constexpr void add(const Pair& pair) noexcept {
    pair_count_ += 1;
    const Real share = 1 / static_cast<Real>(pair_count_);
    pair_.hard += product(share, pair.hard - pair_.hard);
    pair_.soft += product(share, pair.soft - pair_.soft);
    pair_.matched = pair_.matched && pair.matched;
    pair_.valid = true;
  }

  constexpr bool judge(Unsigned longest) noexcept {
    pace_ = fast_ == unknown ? longest / 5 * 2 : pace_;
    // Twice the limit for one that is fast: at the limit it does not change to and fro.
    fast_ = pace_ < (longest / few) << fast();
    if (!fast()) {
      size_ = 1;
      count_ = 0;
    }
    return fast();
  }

  Time last_, begin_;
  Real time_ = 0, hard_ = 0, soft_ = 0;  // means: of the ticks since begin_, and of the values
  Pair pair_{};
  std::size_t pairs_ = 0, first_ = 0;
  std::uint32_t count_ = 0, pair_count_ = 0, size_ = 1;
  Unsigned pace_ = 0;  // mean step
  std::int8_t fast_ = unknown;
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
