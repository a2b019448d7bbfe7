// SPDX-License-Identifier: MIT
#pragma once

// Fewer pairs from a fast converter, each the mean of many readings.

#include <palpate/stage/align.hpp>

namespace palpate {

/// The null stage: each reading counts.
struct NoMeans {
  /// @{
  /// As the function of Means of this name.
  template <class... Reading>
  static constexpr bool add(const Reading&...) noexcept {
    return true;
  }
  static constexpr void next() noexcept {}
  static constexpr void begin(std::size_t) noexcept {}
  static constexpr std::size_t size() noexcept { return 1; }
  static constexpr bool fast() noexcept { return false; }
  static constexpr std::size_t pairs(std::size_t readings) noexcept { return readings; }
  static constexpr std::size_t first(std::size_t reading) noexcept { return reading; }
  /// @}
};

/// Means of the readings of a converter with more than 5 / `longest` pairs a second, over `longest` seconds each: what
/// follows has memories in pairs, and would take the disturbances within them, as they are slow there, for no noise. The
/// readings of a slower converter stay as they are.
template <class Real, class Ticks>
class Means {
  using Unsigned = std::make_unsigned_t<Ticks>;
  static constexpr Unsigned few = 5;         // readings in `longest`, which are no reason for a mean
  static constexpr Unsigned memory = 8;      // of the mean step between readings
  static constexpr int none = -2, one = -1;  // readings before

 public:
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

  /// Takes a reading of each channel, both with a value. Returns whether the four are those of a pair: these, or means,
  /// the soft one at the time of the hard one.
  PALPATE_ONCE constexpr bool add(Ticks& hard_time, Ticks& soft_time, Real& hard, Real& soft, Ticks longest) noexcept {
    const auto whole = static_cast<Unsigned>(longest);
    const Unsigned since = static_cast<Unsigned>(hard_time) - static_cast<Unsigned>(last_hard_);
    const Unsigned step = since - 1 < whole ? since : whole;  // an unsigned difference below 0 is large
    last_hard_ = hard_time;
    pace_ = pace_ - pace_ / memory + step / memory;
    if (PALPATE_LIKELY(pace_ >= whole / few && fast_ == 0)) {
      return true;
    }
    const Mean mean = add_quick(hard_time, soft_time, hard, soft, step, whole);
    if (fast()) {
      hard_time = soft_time = mean.time;
      hard = mean.hard;
      soft = mean.soft;
    }
    return mean.size > 0;
  }

 private:
  /// Of so many readings; 0: there is none.
  struct Mean {
    Ticks time;
    Real hard, soft;
    std::uint32_t size;
  };

  /// By value: what is passed by reference would go through memory in every call of add.
  PALPATE_COLD constexpr Mean add_quick(Ticks hard_time, Ticks soft_time, Real hard, Real soft, Unsigned step,
                                        Unsigned longest) noexcept {
    if (fast_ < 0) {
      pace_ = fast_ == none ? longest : step;
    }
    // Twice the limit for one that is fast: at the limit it does not change to and fro.
    fast_ = static_cast<std::int8_t>(fast_ == none ? one : pace_ < (longest / few) << fast());
    const Real value = interpolated(hard_time, soft_time, soft);
    if (!fast()) {
      size_ = 1;
      count_ = 0;
      return {hard_time, hard, soft, 1};
    }
    const Unsigned since = static_cast<Unsigned>(hard_time) - static_cast<Unsigned>(begin_);
    const bool complete = count_ > 0 && since >= longest;  // after a gap, and where the time goes back, too
    Mean mean{};
    if (complete) {
      mean = {static_cast<Ticks>(static_cast<Unsigned>(begin_) + static_cast<Unsigned>(time_)), hard_, soft_, count_};
      size_ = count_;
      count_ = 0;
    }
    if (count_ == 0) {
      begin_ = hard_time;
      time_ = hard_ = soft_ = 0;
    }
    count_ += 1;
    const Real part = 1 / static_cast<Real>(count_);
    time_ += product(part, static_cast<Real>(static_cast<Unsigned>(hard_time) - static_cast<Unsigned>(begin_)) - time_);
    hard_ += product(part, hard - hard_);
    soft_ += product(part, value - soft_);
    return mean;
  }

  /// The soft channel at the time of the hard one, on the parabola through its last three readings. A line would lower a
  /// tremor of 10 Hz by one per cent.
  constexpr Real interpolated(Ticks hard_time, Ticks soft_time, Real soft) noexcept {
    const auto apart = ticks_between(soft_time, hard_time), step = ticks_between(soft_time, last_time_);
    const bool near = step > 0 && apart < step && apart > -step;
    const Real part = near ? static_cast<Real>(apart) / static_cast<Real>(step) : Real(0);
    const Real change = near ? soft - last_soft_ : Real(0), bend = change - last_change_;
    last_time_ = soft_time;
    last_soft_ = soft;
    last_change_ = change;
    return soft - product(part, change + product((1 - part) / 2, bend));
  }

  Ticks last_hard_ = 0, begin_ = 0, last_time_ = 0;
  Real last_soft_ = 0, last_change_ = 0;
  Real time_ = 0, hard_ = 0, soft_ = 0;  // means: of the ticks since begin_, and of the values
  std::size_t pairs_ = 0, first_ = 0;
  std::uint32_t count_ = 0, size_ = 1;
  Unsigned pace_ = 0;  // mean step
  std::int8_t fast_ = none;
};

}  // namespace palpate
