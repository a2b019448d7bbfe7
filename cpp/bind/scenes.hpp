// SPDX-License-Identifier: MIT
#pragma once

// The scenes: the settings of each, and how each runs.

#include <algorithm>
#include <array>
#include <palpate/scenes.hpp>
#include <palpate/stage/stamps.hpp>
#include <variant>

#include "arrays.hpp"
#include "estimator_kinds.hpp"
#include "touch.hpp"

/// One row of Tracker.process.
struct TrackerRow {
  double ratio, standard_error, statistic, hard_baseline, soft_baseline;
  std::int32_t touch;
  bool alarm, contact, revised;
  unsigned char padding[1];

  static py::dtype dtype() {
    return dtype_of<TrackerRow>({PALPATE_COLUMN(TrackerRow, ratio), PALPATE_COLUMN(TrackerRow, standard_error),
                                 PALPATE_COLUMN(TrackerRow, alarm), PALPATE_COLUMN(TrackerRow, contact),
                                 PALPATE_COLUMN(TrackerRow, touch), PALPATE_COLUMN(TrackerRow, statistic),
                                 PALPATE_COLUMN(TrackerRow, hard_baseline), PALPATE_COLUMN(TrackerRow, soft_baseline),
                                 PALPATE_COLUMN(TrackerRow, revised)});
  }
};

using FixedScene = palpate::FixedTracker<double>;
using PaperScene = palpate::PaperTracker<double>;
using HandheldScene = palpate::HandheldTracker<double>;

/// A core with what Python wants to know beside it: times, and the touches that have ended.
template <class Core_>
struct Run {
  using Core = Core_;

  explicit Run(const Core& made, bool host_stamps) : core(made), smooths(host_stamps) {}

  /// The touches that it ends are put into `ended`; the number of a touch that it revises, into `revised`.
  palpate::Report<double> take(std::int64_t t_hard, std::int64_t t_soft, double hard, double soft, Touches& all) {
    if (smooths) {
      t_hard = hard_stamps.smooth(t_hard);
      t_soft = soft_stamps.smooth(t_soft);
    }
    // Times of the last readings, as many as a touch may be dated back.
    times[core.readings() % times.size()] = t_hard;
    const bool was_ready = core.ready();
    const auto report = core.feed(t_hard, t_soft, hard, soft);
    if (released && core.ready() && !was_ready && !core.open()) {  // measured; a touch that begins keeps the old one
      unproven = released = false;
    }
    if (core.open() && !was_open) {
      const std::uint64_t oldest = core.readings() > times.size() ? core.readings() - times.size() : 0;
      start_s = static_cast<double>(times[std::max(core.started(), oldest) % times.size()]) * 1e-9;
    }
    was_open = core.open();
    based = based || core.ready();
    if (report.finished) {
      released = unproven;
      all.end(result());
    } else if (report.revised) {
      all.revise(result());
    }
    return report;
  }

  TouchResult result() const {
    return {core.touch(),
            start_s,
            period_s(),
            core.settings.samples > 0 || core.settings.seconds > 0,
            core.settings.initial_covariance,
            palpate::knows_its_error<decltype(core.estimator)>,
            unproven};
  }

  /// Measure the baseline again; unless it is `proven` to be without contact, the next touch has to show it.
  void tare(bool proven) {
    unproven = !proven;
    released = false;
    core.tare();
  }

  TrackerRow row(const palpate::Report<double>& report, std::size_t touches) const {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const bool measured = report.finished || core.open();
    const auto number = static_cast<std::int32_t>(touches) + (report.finished ? 0 : 1);
    return {report.ratio,
            core.standard_error(),
            core.estimator.statistic(),
            based ? core.hard_baseline.level() : nan,
            based ? core.soft_baseline.level() : nan,
            measured ? number : 0,
            report.alarm,
            report.contact,
            report.revised,
            {}};
  }

  /// From pair to pair: the mean of the last 16.
  double period_s() const {
    const std::size_t last = core.readings() - 1, many = std::min<std::size_t>(last, 16);
    const auto span = times[last % times.size()] - times[(last - many) % times.size()];
    return many > 0 ? static_cast<double>(span) * 1e-9 / static_cast<double>(many) : 0.0;
  }

  Core core;
  palpate::SteadyStamps<double, std::int64_t> hard_stamps, soft_stamps;
  bool smooths;  // the times are a computer's
  std::array<std::int64_t, 256> times{};
  double start_s = 0;
  bool was_open = false;
  bool unproven = false;  // since a gap: the baseline may be that of a contact
  bool released = false;  // a touch has ended since then: the baseline after it is proven
  bool based = false;     // a baseline has been measured, ever
};

using AnyRun = std::variant<Run<FixedScene>, Run<PaperScene>, Run<HandheldScene>>;

template <class Core>
constexpr bool has_gate = !std::is_same_v<decltype(Core::gate), palpate::AlwaysContact<double>>;

template <class Core>
constexpr bool is_aligned = std::is_same_v<decltype(Core::align), palpate::MatchedPair<double, std::int64_t>>;

/// A scene's settings are those of its tracker, as the core makes it, and of its estimator.
template <class Kind, class Core>
Settings settings_of(const Core& core = Core()) {
  Settings settings;
  settings.add("samples", core.settings.samples);
  settings.add("seconds", core.settings.seconds);
  settings.add("full_scale", core.settings.full_scale);
  if constexpr (has_gate<Core>) {
    settings.add("release", core.gate.settings.release);
  }
  if constexpr (is_aligned<Core>) {
    settings.add("host_stamps", 0);
    settings.add_fields<palpate::MatchedPairSettings<double, std::int64_t>>(false);
  }
  settings.add_all(Kind::defaults());
  return settings;
}

template <class Kind, class Core>
AnyRun run_of(const Settings& s) {
  Core core;
  Kind::check(s);
  core.estimator = Kind::core(s);
  core.settings = s.values<decltype(Core::settings)>();
  if constexpr (has_gate<Core>) {
    require(s["release"] > 0 && s["release"] < 1, "release", s["release"], "0 < release < 1");
    core.gate.settings.release = s["release"];
  }
  bool host_stamps = false;
  if constexpr (is_aligned<Core>) {
    host_stamps = s["host_stamps"] != 0;
    for (const char* name : {"hard_side", "soft_side", "slow_hard_side", "slow_soft_side"}) {
      require(s[name] >= 0 && s[name] <= 0.5, name, s[name], std::string("0 <= ") + name + " <= 0.5");
    }
    core.align.settings = s.values<palpate::MatchedPairSettings<double, std::int64_t>>();
  }
  return Run<Core>(core, host_stamps);
}

struct Scene {
  const char* name;
  Settings settings;
  AnyRun (*run)(const Settings&);
};

inline const std::array<Scene, 4>& scenes() {
  using Robust = HandoverKind<double>;
  static const std::array<Scene, 4> all{{
      {"fixed", settings_of<FixedKind<double>, FixedScene>(), &run_of<FixedKind<double>, FixedScene>},
      {"paper", settings_of<AdaptiveKind<double>, PaperScene>(), &run_of<AdaptiveKind<double>, PaperScene>},
      {"handheld", settings_of<Robust, HandheldScene>(), &run_of<Robust, HandheldScene>},
      {"sliding", settings_of<Robust, palpate::SlidingTracker<double>>(), &run_of<Robust, HandheldScene>},
  }};
  return all;
}

inline const Scene& scene_named(const py::object& given) {
  const auto name = py::isinstance<py::str>(given) ? given.cast<std::string>() : std::string();
  std::string allowed;
  py::list names;
  for (const Scene& scene : scenes()) {
    if (name == scene.name) {
      return scene;
    }
    allowed += (allowed.empty() ? "" : ", ") + std::string(scene.name);
    names.append(scene.name);
  }
  throw py::value_error("scene: got " + py::repr(given).cast<std::string>() + ", allowed: " + allowed +
                        nearest(given, names));
}
