// SPDX-License-Identifier: MIT
#pragma once

// A tracker with what its readers want to know beside it: times, gaps, and what a row of it says.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <palpate/scenes.hpp>
#include <palpate/stage/stamps.hpp>

namespace palpate::runs {

/// A touch as its readers see it: with its time, with what the scene promised, and with its flags by name.
struct Result : Touch<double> {
  double start_s;
  double period_s;  // from pair to pair
  bool has_length;  // the scene ends a touch at a length
  double initial_covariance;
  bool knows_error;
  double contact_exponent, age;  // of the level ratio; 0: none
  bool gap;                      // it ended at a gap, or its baseline was measured after one, perhaps in contact
  bool together;                 // both channels had one time
  bool late, held;  // a fifth of its pairs did not come in time; it had nearly the length of the scene all the same

  double alarm_share() const noexcept { return samples > 0 ? static_cast<double>(alarms) / samples : 0.0; }
  bool revised() const noexcept { return revision != Revision::none; }
  // The test of the model has a slope over two pairs for the lag: right for a bump that gives way slowly. Where both
  // channels have one time, the readings may be d pairs apart: with the phase a of the movement from pair to pair, that
  // appears as tan(a d) / sin a.
  double lag_ms() const noexcept {
    const double phase = together && misfits.bend > 0 ? 2 * std::atan(std::sqrt(misfits.bend)) : 0;
    const double pairs = phase > 0 ? std::atan(misfits.lag * std::sin(phase)) / phase : misfits.lag;
    return 1000 * pairs * period_s;
  }
  // A press raises both channels. Of the probe's ratios, 1 to 10, none is near these limits: then a channel is not wired,
  // or wired to fall.
  bool one_sided() const noexcept {
    constexpr double least = 0.02, most = 50;
    return (knows_error || has_length) && samples > 0 && !(ratio > least && ratio < most);
  }

  /// Calls visit(name) for each flag.
  template <class Visit>
  void visit_flags(Visit&& visit) const {
    const auto readings = static_cast<double>(samples) + refused + saturated;
    if (has_length && !full) visit("short");
    if (saturated > 0) visit("saturated");
    if (refused > 0.75 * readings) visit("refused");
    if (late) visit("late");
    if (outliers >= 3 && outliers >= 0.05 * readings) visit("outliers");
    if (knows_error && standard_error != standard_error) visit("unsettled");
    if (!(covariance <= 0.1 * initial_covariance)) visit("unexcited");
    if (one_sided()) visit("one-sided");
    if (misfits.flags & misfit_offset) visit("offset");
    if (misfits.flags & misfit_drift) visit("drift");
    if (misfits.flags & misfit_lag) visit("lag");
    if (misfits.flags & misfit_curve) visit("curve");
    if (misfits.flags & misfit_tilt) visit("tilt");
    if (misfits.flags & misfit_changed) visit("changed");
    if (misfits.flags & misfit_step) visit("step");
    if (misfits.flags & misfit_jumped) visit("jumped");
    if (revision == Revision::creep) visit("creep");
    if (revision == Revision::baseline) visit("baseline");
    if (gap) visit("gap");
  }
};

/// The state after a reading, as a row.
struct TrackerRow {
  double ratio, standard_error, statistic, hard_baseline, soft_baseline;
  std::int32_t touch;
  bool alarm, contact, revised;
  unsigned char padding[1];
};

template <class Core_>
struct Run {
  using Core = Core_;

  explicit Run(const Core& made, bool host_stamps, double period = 0, bool has_baseline = false)
      : core(made), smooths(host_stamps), given(has_baseline), nominal_s(period) {}

  /// Each touch that it ends goes to `all.end`, one that it revises to `all.revise`, and a judgement to `all.judge`.
  template <class Touches>
  Report<double> take(Nanoseconds t_hard, Nanoseconds t_soft, double hard, double soft, Touches& all) {
    if (smooths) {
      t_hard = hard_stamps.smooth(t_hard);
      t_soft = soft_stamps.smooth(t_soft);
    }
    t_soft = t_soft.later(soft_later_ns);
    together = t_hard == t_soft;
    const bool whole = std::isfinite(hard) && std::isfinite(soft);
    const auto due = core.due_time(t_hard);
    return note(due, t_hard, whole, all, [&] { return core.feed(t_hard, t_soft, hard, soft); });
  }

  /// End a touch that is still running.
  template <class Touches>
  void finish(Touches& all) {
    while (core.waiting() > 0) {
      note(core.due_time({}), last_whole, false, all, [&] { return core.flush(); });
    }
    if (core.finish()) {
      all.end(result());
    }
  }

  /// What comes next is after a gap. A touch that it cuts is flagged, and so is one whose baseline may have been measured in contact.
  template <class Touches>
  void gap(Touches& all) {
    unproven = true;  // of the touch that ends here, too
    finish(all);
    core.forget();
    tare(false);
  }

  /// Measure the baseline again; unless it is `proven` to be without contact, the next touch has to show it.
  void tare(bool proven) {
    unproven = !proven && !given;
    released = false;
    core.tare();
  }

  /// Whether the probe is in contact, where this can be known.
  bool pressed() const { return core.gate.releases && core.ready() && !core.gate.idle(); }

  const char* state() const {
    return core.open()                               ? "contact"
           : !core.ready()                           ? "baseline"
           : core.gate.idle() || !core.gate.releases ? "waiting"
                                                     : "done";
  }

  Result result() const {
    return {core.touch(),
            start_s,
            period_s(),
            core.settings.samples > 0 || core.settings.seconds > 0 || level_settings().age > 0,
            core.initial_covariance(),
            knows_its_error<decltype(core.estimator)>,
            level_settings().contact_exponent,
            level_settings().age,
            unproven,
            together,
            nominal_s > 0 && came <= 0.8 * passed_s / nominal_s,
            passed_s >= 0.8 * static_cast<double>(core.settings.seconds)};
  }

  LevelRatioSettings<double> level_settings() const {
    if constexpr (Core::levels) {
      return core.level_settings();
    } else {
      return {0, 0};
    }
  }

  /// `touches`: how many have ended.
  TrackerRow row(const Report<double>& report, std::size_t touches) const {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const bool measured = report.finished || core.open();
    const double sign = core.settings.falling ? -1 : 1;
    const auto number = static_cast<std::int32_t>(touches) + (report.finished ? 0 : 1);
    return {report.ratio,
            core.standard_error(),
            core.estimator.statistic(),
            based ? sign * core.hard_baseline.level() : nan,
            based ? sign * core.soft_baseline.level() : nan,
            measured ? number : 0,
            report.alarm,
            report.contact,
            report.revised,
            {}};
  }

  /// From pair to pair: the mean of the last 16.
  double period_s() const {
    const std::size_t last = core.pairs() - 1, many = std::min<std::size_t>(last, 16);
    const auto span = times[last % times.size()].since(times[(last - many) % times.size()]);
    return many > 0 ? static_cast<double>(span) * 1e-9 / static_cast<double>(many) : 0.0;
  }

  /// Let the core take a reading that was due at a time, and tell what it ends, revises and judges. `now`: when the newest
  /// one was read, and whether it was `whole`.
  template <class Touches, class Take>
  Report<double> note(Nanoseconds due, Nanoseconds now, bool whole, Touches& all, const Take& take_one) {
    // Times of the first readings of the last pairs, as many as a touch may be dated back.
    if (core.pairs() != begun) {
      begun = core.pairs();
      times[begun % times.size()] = due;
    }
    const bool was_ready = core.ready();
    const auto report = take_one();
    if (released && core.ready() && !was_ready && !core.open()) {  // measured; a touch that begins keeps the old one
      unproven = released = false;
    }
    if ((core.open() || report.finished) && !was_open) {  // a touch of one sample is no longer open
      const std::uint64_t oldest = core.pairs() > times.size() ? core.pairs() - times.size() : 0;
      const std::uint64_t first = std::max<std::uint64_t>(core.started(), oldest);
      start_s = static_cast<double>(times[first % times.size()].count) * 1e-9;
      opened = last_whole;
      came = 0;
    }
    if (core.open() || was_open) {
      came += whole;
      passed_s = static_cast<double>(now.since(opened)) * 1e-9;
    }
    last_whole = whole ? now : last_whole;
    was_open = core.open();
    based = based || core.ready();
    if (report.finished) {
      released = unproven;
      all.end(result());
    } else if (report.revised) {
      all.revise(result());
    }
    for (const auto& judgement : core.judgements()) {
      all.judge(seen(judgement));
    }
    return report;
  }

  /// A judgement in the signs of the readings.
  template <class Judgement>
  Judgement seen(Judgement judgement) const {
    if constexpr (Core::scene_type::contact::releases && Core::scene_type::screen::screens) {
      judgement.size = core.settings.falling ? -judgement.size : judgement.size;
    }
    return judgement;
  }

  Core core;
  SteadyStamps<double, Nanoseconds> hard_stamps, soft_stamps;
  bool smooths;                    // the times are a computer's
  bool given;                      // the baseline, which then is valid after a gap, too
  bool together = false;           // both channels of the last pair have one time
  std::int64_t soft_later_ns = 0;  // of the soft readings, after their stamps
  double nominal_s;                // from pair to pair of the device; 0: not known
  Nanoseconds last_whole, opened;  // times of pairs with both values: the last one, and the one before the touch
  std::uint32_t came = 0;          // such pairs in the touch
  double passed_s = 0;             // since `opened`
  std::array<Nanoseconds, 256> times{};
  std::size_t begun = std::numeric_limits<std::size_t>::max();  // the last pair of which a reading came
  double start_s = 0;
  bool was_open = false;
  bool unproven = false;  // since a gap: the baseline may have been measured in contact
  bool released = false;  // a touch has ended since then: the baseline after it is proven
  bool based = false;     // a baseline has been measured, ever
};

}  // namespace palpate::runs
