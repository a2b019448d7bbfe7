// SPDX-License-Identifier: MIT
#pragma once

// Fewer pairs from a fast converter, each the mean of many readings.

#include <palpate/stage/align.hpp>

namespace palpate {

/// The null stage: each reading counts.
struct NoMeans {
  /// @{
  /// As the function of Means of this name.
  static constexpr void next() noexcept {}
  static constexpr void begin(std::size_t) noexcept {}
  static constexpr std::size_t size() noexcept { return 1; }
  static constexpr bool fast() noexcept { return false; }
  static constexpr std::size_t pairs(std::size_t readings) noexcept { return readings; }
  static constexpr std::size_t first(std::size_t reading) noexcept { return reading; }
  /// @}
};

/// Means of a converter with more than 3 / `longest` pairs a second, over about `longest` seconds each: what follows has
/// memories in pairs, and would take the disturbances within them, as they are slow there, for no noise. The readings of
/// a slower converter stay as they are. `Pair` is what the alignment gives.
template <class Real, class Ticks, class Pair>
class Means {
  using Unsigned = std::make_unsigned_t<Ticks>;
  static constexpr Unsigned few = 3;      // readings in `longest`, which are no reason for a mean
  static constexpr Unsigned memory = 32;  // of the mean step between readings, which may come in bursts
  static constexpr int unknown = -1;

 public:
  /// Of readings, and of their pairs; size 0: there is none.
  struct Mean {
    Ticks time;          ///< of the hard channel
    Real hard;           ///< pF
    Real soft;           ///< pF
    Pair pair;           ///< of the valid ones
    std::uint32_t size;  ///< number of readings
  };

  /// Number of readings in the last mean.
  constexpr std::size_t size() const noexcept { return size_; }
  /// Whether the converter is fast.
  constexpr bool fast() const noexcept { return fast_ > 0; }

  /// A pair is complete, with or without values.
  constexpr void next() noexcept { pairs_ += 1; }
  /// A touch began so many pairs ago.
  constexpr void begin(std::size_t age) noexcept { first_ = pairs_ + 1 > age ? pairs_ + 1 - age : 0; }
  /// Number of the pairs before this one.
  constexpr std::size_t pairs(std::size_t) const noexcept { return pairs_; }
  /// Number of the first pair of a touch.
  constexpr std::size_t first(std::size_t) const noexcept { return first_; }

  /// Takes the time of a reading of each channel, both with a value. Returns whether it is to become part of a mean.
  PALPATE_ONCE constexpr bool follow(Ticks time, Ticks longest) noexcept {
    const auto whole = static_cast<Unsigned>(longest);
    const Unsigned since = static_cast<Unsigned>(time) - static_cast<Unsigned>(last_);
    const Unsigned step = since - 1 < 2 * whole ? since : 2 * whole;  // an unsigned difference below 0 is large
    last_ = time;
    pace_ = pace_ - pace_ / memory + step / memory;
    return !PALPATE_LIKELY(pace_ >= whole / few && fast_ == 0) && judge(whole);
  }

  /// Add a reading of each channel, and the pair that is complete with it. Returns the mean of those before, where it is
  /// complete.
  PALPATE_COLD constexpr Mean add(Ticks time, Real hard, Real soft, const Pair& pair, Ticks longest) noexcept {
    const Unsigned since = static_cast<Unsigned>(time) - static_cast<Unsigned>(begin_);
    Mean mean{};
    // After a gap, and where the time goes back, too.
    if (count_ > 0 && since >= static_cast<Unsigned>(longest) - pace_ / 2) {
      mean = {later(begin_, static_cast<std::make_signed_t<Ticks>>(time_)), hard_, soft_, pair_, count_};
      size_ = count_;
      count_ = 0;
    }
    if (count_ == 0) {
      begin_ = time;
      time_ = hard_ = soft_ = 0;
      pair_ = {};
      pair_.matched = true;
      pair_count_ = 0;
    }
    count_ += 1;
    const Real part = 1 / static_cast<Real>(count_);
    time_ += product(part, static_cast<Real>(static_cast<Unsigned>(time) - static_cast<Unsigned>(begin_)) - time_);
    hard_ += product(part, hard - hard_);
    soft_ += product(part, soft - soft_);
    if (pair.valid) {
      pair_count_ += 1;
      const Real share = 1 / static_cast<Real>(pair_count_);
      pair_.hard += product(share, pair.hard - pair_.hard);
      pair_.soft += product(share, pair.soft - pair_.soft);
      pair_.matched = pair_.matched && pair.matched;
      pair_.valid = true;
    }
    return mean;
  }

 private:
  PALPATE_COLD constexpr bool judge(Unsigned longest) noexcept {
    pace_ = fast_ == unknown ? longest / 5 * 2 : pace_;
    // Twice the limit for one that is fast: at the limit it does not change to and fro.
    fast_ = pace_ < (longest / few) << fast();
    if (!fast()) {
      size_ = 1;
      count_ = 0;
    }
    return fast();
  }

  Ticks last_ = 0, begin_ = 0;
  Real time_ = 0, hard_ = 0, soft_ = 0;  // means: of the ticks since begin_, and of the values
  Pair pair_{};
  std::size_t pairs_ = 0, first_ = 0;
  std::uint32_t count_ = 0, pair_count_ = 0, size_ = 1;
  Unsigned pace_ = 0;  // mean step
  std::int8_t fast_ = unknown;
};

}  // namespace palpate
