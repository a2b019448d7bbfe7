// SPDX-License-Identifier: MIT
#pragma once

// Tracker: all stages from two readings to the result of a touch; and the scenes: which stages each one has.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <palpate/estimator/handover.hpp>
#include <palpate/settings.hpp>
#include <palpate/stage/align.hpp>
#include <palpate/stage/baseline.hpp>
#include <palpate/stage/contact.hpp>

namespace palpate {

struct Counts {
  std::size_t start = 0;  // index of the first reading of the touch, from 0
  std::uint32_t samples = 0, alarms = 0, saturated = 0, refused = 0;
};

/// The result of a touch.
template <class Real>
struct Touch : Counts {
  Real ratio = 0, covariance = 0;
  Real standard_error = std::numeric_limits<Real>::quiet_NaN();
};

/// The state after a reading.
template <class Real>
struct Report {
  Real ratio;
  bool alarm, contact;
  bool finished;  // touch() is new
};

/// Only Handover has a standard error.
template <class Estimator>
inline constexpr bool knows_its_error = false;
template <class Real, class Parameters>
inline constexpr bool knows_its_error<Handover<Real, Parameters>> = true;

template <class Estimator>
struct TrackerSettings {
  using Real = typename Estimator::real_type;
  Real initial_ratio = Real(1), initial_covariance = Estimator::default_covariance;
  std::uint32_t samples = 250;                              // of a touch; 0: a touch ends only by its release
  Real full_scale = std::numeric_limits<Real>::infinity();  // readings from this size on are saturated

  template <class Visit>
  static constexpr void visit_fields(Visit&& visit) noexcept {
    visit("initial_ratio", &TrackerSettings::initial_ratio);
    visit("initial_covariance", &TrackerSettings::initial_covariance);
    visit("samples", &TrackerSettings::samples);
    visit("full_scale", &TrackerSettings::full_scale);
  }
};

/// All stages of a scene, in order. The baseline and the gate get the readings before alignment: so the noise of the
/// baseline is that of the channel, and the gate does not wait for the alignment.
template <class Real, class AlignStage, class BaselineStage, class ContactStage, class Estimator,
          class Settings = Kept<TrackerSettings<Estimator>>>
class Tracker : public Settings {
 public:
  using real_type = Real;
  using Settings::settings;
  using ticks_type = typename AlignStage::ticks_type;

  AlignStage align;
  BaselineStage hard_baseline, soft_baseline;
  ContactStage gate;
  Estimator estimator;

  constexpr Report<Real> feed(ticks_type hard_time, ticks_type soft_time, Real hard, Real soft) noexcept {
    const bool usable = is_finite(hard) && is_finite(soft);
    const bool saturated = usable && !(magnitude(hard) < settings.full_scale && magnitude(soft) < settings.full_scale);
    if (usable) {
      gate_with(hard, soft);
    }
    const Real nan = std::numeric_limits<Real>::quiet_NaN();
    const auto pair = align.feed(hard_time, soft_time, saturated ? nan : hard, saturated ? nan : soft);
    bool alarm = false;
    if (open_) {
      counts_.saturated += saturated;
      counts_.refused += !saturated && !pair.valid;
      alarm = pair.valid && estimate(pair);
    }
    readings_ += 1;
    const bool full = settings.samples > 0 && counts_.samples >= settings.samples;
    const bool finished = running_ && (!open_ || full) && finish();
    return {estimator.ratio(), alarm, gate.contact(), finished};
  }

  /// End a touch that is still running, for example at the end of a recording. False: there is no such touch.
  constexpr bool finish() noexcept {
    if (!running_) {
      return false;
    }
    running_ = open_ = false;
    standard_error_ = standard_error();
    return true;
  }

  /// Measure the baseline again, without contact. Needed after a jump of the baseline, which looks like a touch without
  /// end.
  constexpr void tare() noexcept {
    finish();
    gate.reset();
    align.reset();
    hard_baseline.reset();
    soft_baseline.reset();
  }

  /// The last touch; read it before the next one begins.
  constexpr Touch<Real> touch() const noexcept {
    const Real nan = std::numeric_limits<Real>::quiet_NaN();
    const bool any = counts_.samples > 0;
    return {counts_, any ? estimator.ratio() : nan, any ? estimator.covariance() : nan, standard_error_};
  }
  constexpr bool open() const noexcept { return open_; }
  /// Index of the first reading of the running touch, or of the last one.
  constexpr std::size_t started() const noexcept { return counts_.start; }
  constexpr bool ready() const noexcept { return hard_baseline.ready() && soft_baseline.ready(); }
  constexpr std::size_t readings() const noexcept { return readings_; }

  /// Standard error from the noise of the estimator and from the errors of the baselines, which are common to all
  /// samples of a touch; NaN until it is known. An error of a baseline changes the ratio by this error divided by the
  /// mean regressor, sqrt(R / W), W being the count.
  constexpr Real standard_error() const noexcept {
    if constexpr (!knows_its_error<Estimator>) {
      return std::numeric_limits<Real>::quiet_NaN();
    } else {
      if (!estimator.settled()) {
        return std::numeric_limits<Real>::quiet_NaN();
      }
      const Real ratio = estimator.ratio();
      const Real shared = hard_baseline.variance() + product(product(ratio, ratio), soft_baseline.variance());
      return square_root(estimator.variance() + product(shared, estimator.count()) / estimator.information());
    }
  }

 private:
  constexpr void gate_with(Real hard, Real soft) noexcept {
    const Real change = magnitude((hard - hard_baseline.level()) + (soft - soft_baseline.level()));
    if (!ready()) {
      collect(hard, soft, change);
      return;
    }
    const bool was_idle = gate.idle(), was_in_contact = gate.contact();
    gate.update(change, noise());
    if (gate.contact() && !(ContactStage::releases ? was_in_contact : running_)) {
      start();
    } else if (was_in_contact && !gate.contact()) {
      open_ = false;
    } else if (gate.idle() && !was_idle) {
      hard_baseline.reset();
      soft_baseline.reset();
    } else if (gate.idle()) {
      follow(hard, soft);
    }
  }

  // A touch that begins before a new baseline is measured uses the old baseline.
  constexpr void collect(Real hard, Real soft, Real change) noexcept {
    if (gate.update_between(change)) {
      hard_baseline.keep();
      soft_baseline.keep();
      start();
      return;
    }
    hard_baseline.collect(hard);
    soft_baseline.collect(soft);
  }

  constexpr void follow(Real hard, Real soft) noexcept {
    hard_baseline.follow(hard);
    soft_baseline.follow(soft);
    if (!gate.suspects()) {
      hard_baseline.mark();
      soft_baseline.mark();
    }
  }

  // sqrt(a^2 + b^2), at most 4 % too small and 12 % too large: enough for a threshold.
  constexpr Real noise() const noexcept {
    const Real a = hard_baseline.noise(), b = soft_baseline.noise();
    return a > b ? a + product(Real(0.42), b) : b + product(Real(0.42), a);
  }

  constexpr void start() noexcept {
    running_ = open_ = true;
    hard_baseline.rewind();
    soft_baseline.rewind();
    estimator.reset(settings.initial_ratio, settings.initial_covariance);
    counts_ = Counts();
    const auto age = static_cast<std::size_t>(gate.age());
    counts_.start = readings_ + 1 > age ? readings_ + 1 - age : 0;
  }

  constexpr bool estimate(const Pair<Real>& pair) noexcept {
    const auto step = estimator.update(pair.hard - hard_baseline.level(), pair.soft - soft_baseline.level());
    counts_.samples += step.accepted;
    counts_.refused += !step.accepted;
    counts_.alarms += step.alarm && step.accepted;
    return step.alarm;
  }

  std::size_t readings_ = 0;
  bool open_ = false;     // the touch takes samples
  bool running_ = false;  // a touch has begun, and its result is not yet reported
  Counts counts_;
  Real standard_error_ = std::numeric_limits<Real>::quiet_NaN();
};

/// Settings with which a touch ends only by its release.
template <class Estimator>
inline constexpr TrackerSettings<Estimator> unlimited = [] {
  TrackerSettings<Estimator> settings;
  settings.samples = 0;
  return settings;
}();
/// Contact settings for sliding. The height varies, so a release is below 0.3 of the highest value.
template <class Real>
inline constexpr ContactSettings<Real> sliding_contact = [] {
  ContactSettings<Real> settings;
  settings.release = Real(0.3);
  return settings;
}();

/// Scene "fixed": for a loop that supplies changes without faults, as one endless touch. The smallest scene.
template <class Real, class Ticks = std::int64_t>
using FixedTracker = Tracker<Real, NoAlign<Real, Ticks>, NoBaseline<Real>, AlwaysContact<Real>, FixedRls<Real>,
                             Kept<TrackerSettings<FixedRls<Real>>, unlimited<FixedRls<Real>>>>;
/// Scene "paper": the estimator of the paper, 250 samples from contact.
template <class Real, class Ticks = std::int64_t>
using PaperTracker = Tracker<Real, NoAlign<Real, Ticks>, Baseline<Real>, Contact<Real>, AdaptiveRls<Real>>;
/// Scene "handheld": a probe held in the hand.
template <class Real, class Ticks = std::int64_t>
using HandheldTracker = Tracker<Real, Align<Real, Ticks, 4>, Baseline<Real>, Contact<Real>, Handover<Real>>;
/// Scene "sliding": a probe that slides over tissue.
template <class Real, class Ticks = std::int64_t>
using SlidingTracker = Tracker<Real, Align<Real, Ticks, 4>, Baseline<Real>,
                               Contact<Real, Kept<ContactSettings<Real>, sliding_contact<Real>>>, Handover<Real>,
                               Kept<TrackerSettings<Handover<Real>>, unlimited<Handover<Real>>>>;

}  // namespace palpate
