// SPDX-License-Identifier: MIT
#pragma once

// Readings are judged before anything pairs or averages them: one false reading would be in three or four pairs.

#include <palpate/judgement.hpp>
#include <palpate/stage/outliers.hpp>
#include <palpate/stage/standstill.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// A reading of each channel.
template <class Real, class Time>
struct ScreenedReading {
  Time hard_time;             ///< of the hard channel
  Time soft_time;             ///< of the soft channel
  Real hard;                  ///< pF; NaN: no value
  Real soft;                  ///< pF; NaN: no value
  bool hard_outlier = false;  ///< it has no value for this reason
  bool soft_outlier = false;  ///< the same
  bool at_end = false;        ///< one of them is at a known end of the range
};

/// The null stage: each reading is as it is, at once.
template <class Real, class Time>
struct NoScreen {
  using real_type = Real;                 ///< float or double
  using time_type = Time;                 ///< Ticks with their unit
  static constexpr bool screens = false;  ///< a reading waits for the next two
  /// As Screen::due_time.
  static constexpr Time due_time(Time now) noexcept { return now; }
  /// As Screen::waiting.
  static constexpr int waiting() noexcept { return 0; }
  /// @{
  /// As the function of Screen of this name.
  static constexpr void begun() noexcept {}
  template <class Touch>
  static constexpr void complete(Touch&) noexcept {}
  /// @}
};

/// Gives each reading when the next two are known, screened.
template <class Real, class Time>
class Screen {
  static constexpr int newest = 2;

 public:
  using real_type = Real;                ///< float or double
  using time_type = Time;                ///< Ticks with their unit
  static constexpr bool screens = true;  ///< a reading waits for the next two

  /// Takes a reading of each channel; NaN: no value. Returns whether one is due.
  PALPATE_INLINE constexpr bool add(Time hard_time, Time soft_time, Real hard, Real soft) noexcept {
    push({hard_time, soft_time});
    hard_.add(hard);
    soft_.add(soft);
    waiting_ += 1;
    return oldest_ == 0;
  }
  /// No reading follows for now. Returns whether one is due: take it, and flush again.
  constexpr bool flush() noexcept {
    while (waiting_ > 0 && oldest_ > 0) {
      push(times_[newest]);
      hard_.add_nothing();
      soft_.add_nothing();
    }
    return waiting_ > 0;
  }
  /// How many readings wait for the next ones.
  constexpr int waiting() const noexcept { return waiting_; }
  /// When the hard channel of the oldest one was read; else `now`.
  constexpr Time due_time(Time now) const noexcept { return waiting_ > 0 ? times_[oldest_].hard : now; }

  /// The oldest reading, which is due. What is judged is added to a list. `full_scale`: readings of this size are
  /// saturated, and no outliers; infinite: the known ends are looked for. `last`: after flush().
  PALPATE_INLINE constexpr ScreenedReading<Real, Time> take(Real full_scale, bool last,
                                                            Judgements<Real, Time>& judgements) noexcept {
    ScreenedReading<Real, Time> reading{times_[0].hard, times_[0].soft, 0, 0};
    const bool hard_suspect = hard_.suspects(), soft_suspect = soft_.suspects();
    if (PALPATE_UNLIKELY(hard_suspect || soft_suspect)) {
      find_outliers(reading, full_scale);
    }
    const bool known = full_scale <= std::numeric_limits<Real>::max();
    reading.hard = hard_.judged(reading.hard_outlier);
    reading.soft = soft_.judged(reading.soft_outlier);
    const bool hard_ends = hard_stands_.follow(reading.hard_time, reading.hard, hard_.code());
    const bool soft_ends = soft_stands_.follow(reading.soft_time, reading.soft, soft_.code());
    reading.at_end = !known && (hard_ends || soft_ends);
    if (PALPATE_UNLIKELY(!(hard_stands_.moves() && soft_stands_.moves()))) {
      judge(Channel::hard, hard_stands_, reading.hard_time, reading.hard, known, last, judgements);
      judge(Channel::soft, soft_stands_, reading.soft_time, reading.soft, known, last, judgements);
    }
    waiting_ -= 1;
    oldest_ = 1;
    if (PALPATE_UNLIKELY(waiting_ == 0)) {  // what comes next may be at another place
      oldest_ = newest + 1;
      hard_ = soft_ = {};
    }
    return reading;
  }

  /// A touch begins: count its outliers.
  constexpr void begun() noexcept { hard_outliers_ = soft_outliers_ = 0; }
  /// Count the outliers of a touch that is `open`.
  PALPATE_INLINE constexpr void count(const ScreenedReading<Real, Time>& reading, bool open) noexcept {
    hard_outliers_ += open && reading.hard_outlier;
    soft_outliers_ += open && reading.soft_outlier;
  }
  /// Add to a touch what is counted.
  template <class Touch>
  constexpr void complete(Touch& touch) const noexcept {
    touch.outliers = hard_outliers_ > soft_outliers_ ? hard_outliers_ : soft_outliers_;
  }

 private:
  using Deviation = typename OutlierTest<Real>::Deviation;
  static constexpr Real edge = Real(1.5);  // limits: range of the neighbours at a contact, a release, in a tap
  static constexpr Real alike = Real(1) / Real(0.4);  // of a limit: both channels did the same

  struct Times {
    Time hard, soft;
  };

  PALPATE_INLINE constexpr void push(const Times& times) noexcept {
    times_[0] = times_[1];
    times_[1] = times_[newest];
    times_[newest] = times;
    oldest_ -= 1;
  }

  // Both channels off to the same side: the peak of a tremor, or a tap between readings more than 40 ms apart, half a
  // period of the fastest hand. Where the other channel moves far, the probe is pressed or lifted: there an outlier is
  // off by more than its neighbours differ.
  constexpr void find_outliers(ScreenedReading<Real, Time>& reading, Real full_scale) noexcept {
    const Deviation hard = hard_.deviation(), soft = soft_.deviation();
    const Real hard_size = magnitude(hard.off), soft_size = magnitude(soft.off);
    const bool together = (hard.off > 0) == (soft.off > 0) && hard_.is_far(product(alike, hard_size), hard) &&
                          soft_.is_far(product(alike, soft_size), soft);
    const bool slow = times_[1].hard.since(times_[0].hard) > Time::second / 25;
    if (together && (slow || !(hard_.is_far(hard_size / 2, hard) || soft_.is_far(soft_size / 2, soft)))) {
      return;
    }
    reading.hard_outlier = magnitude(hard_.due()) < full_scale && hard_.is_far(hard_size, hard) &&
                           (hard_size > hard.range || !soft_.is_far(soft.range / edge, soft));
    reading.soft_outlier = magnitude(soft_.due()) < full_scale && soft_.is_far(soft_size, soft) &&
                           (soft_size > soft.range || !hard_.is_far(hard.range / edge, hard));
  }

  static constexpr void judge(Channel channel, Standstill<Real, Time>& stands, Time time, Real value, bool known,
                              bool last, Judgements<Real, Time>& judgements) noexcept {
    if (PALPATE_UNLIKELY(stands.came_to_end() && !known)) {
      judgements.add(Judged::saturated, channel, time, value);
    }
    if (PALPATE_UNLIKELY(is_finite(value) && stands.freezes(time, last))) {
      judgements.add(Judged::frozen, channel, stands.since(), value);
    }
  }

  OutlierTest<Real> hard_, soft_;
  Standstill<Real, Time> hard_stands_, soft_stands_;
  Times times_[newest + 1];  // of the readings; the first one is due
  int oldest_ = newest + 1;  // index of the oldest reading that waits
  int waiting_ = 0;
  std::uint32_t hard_outliers_ = 0, soft_outliers_ = 0;
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
