// SPDX-License-Identifier: MIT
#pragma once

// The scenes: the settings of each, and how each runs.

#include <array>
#include <cmath>
#include <limits>
#include <variant>

#include "../runs/run.hpp"
#include "arrays.hpp"
#include "estimator_kinds.hpp"

using palpate::runs::Run;
using palpate::runs::TrackerRow;

/// One row of Tracker.process.
inline py::dtype tracker_row_dtype() {
  return dtype_of({PYBIND11_MAP_LIST(PYBIND11_FIELD_DESCRIPTOR, TrackerRow, ratio, standard_error, alarm, contact,
                                     touch, statistic, hard_baseline, soft_baseline, revised)},
                  sizeof(TrackerRow));
}

using FixedScene = palpate::FixedTracker<double>;
using PaperScene = palpate::PaperTracker<double>;
using HandheldScene = palpate::HandheldTracker<double>;
using SlidingScene = palpate::SlidingTracker<double>;

using LevelSettings = palpate::LevelRatioSettings<double>;

using AnyRun = std::variant<Run<FixedScene>, Run<PaperScene>, Run<HandheldScene>, Run<SlidingScene>>;

template <class Core>
constexpr bool has_gate = !std::is_same_v<decltype(Core::gate), palpate::AlwaysContact<double>>;

template <class Core>
constexpr bool is_aligned = std::is_same_v<decltype(Core::align), palpate::MatchedPair<double, palpate::Nanoseconds>>;

template <class Core>
constexpr bool is_given = std::is_same_v<decltype(Core::hard_baseline), palpate::GivenBaseline<double>>;

/// A baseline that is known has no end of its contacts by patience: it is not measured again.
template <class Core>
void give_baseline(Core& core, const std::array<double, 4>& given) {
  const double sign = core.settings.falling ? -1 : 1;
  core.hard_baseline.give(sign * given[0], given[2]);
  core.soft_baseline.give(sign * given[1], given[3]);
  core.gate.settings.patience = std::numeric_limits<double>::infinity();
}

/// A scene's settings are those of its tracker, as the core makes it, and of its estimator.
template <class Kind, class Core>
Settings settings_of() {
  const Core core;
  Settings settings;
  settings.add("samples", core.settings.samples);
  settings.add("seconds", core.settings.seconds);
  settings.add("full_scale", core.settings.full_scale);
  if constexpr (has_gate<Core>) {
    settings.add("release", core.gate.settings.release);
    settings.add("falling", core.settings.falling);
  }
  if constexpr (is_given<Core>) {
    settings.add_baseline();
  }
  if constexpr (is_aligned<Core>) {
    settings.add("host_stamps", 0);
    settings.add("soft_later", 0);
    settings.add("period", 0);
  }
  if constexpr (Core::levels) {
    settings.add("confirmed", core.settings.confirmed);
  }
  if constexpr (is_aligned<Core>) {
    settings.add("averaged", core.settings.averaged);
  }
  if constexpr (Core::levels) {
    settings.add_fields<LevelSettings>(false);
  }
  settings.add_all(Kind::defaults());
  return settings;
}

template <class Kind, class Core>
AnyRun run_of(const Settings& s) {
  Core core;
  Kind::check(s);
  core.estimator = Kind::core(s);
  s.check<decltype(Core::settings)>();
  core.settings = s.values<decltype(Core::settings)>();
  if constexpr (has_gate<Core>) {
    core.gate.settings.release = s["release"];
    require(palpate::valid(core.gate.settings), "release", s["release"], "0 < release < 1");
  }
  std::optional<std::array<double, 4>> given;
  if constexpr (is_given<Core>) {
    given = s.baseline();
    if (given) {
      give_baseline(core, *given);
    }
  }
  bool host_stamps = false;
  double period = 0, soft_later = 0;
  if constexpr (is_aligned<Core>) {
    soft_later = s["soft_later"];
    require(soft_later > -1 && soft_later < 1, "soft_later", soft_later, "-1 < soft_later < 1");
    host_stamps = s["host_stamps"] != 0;
    period = s["period"];
    require(period >= 0 && period <= 1e9, "period", period, "0 <= period <= 1e9, s");
  }
  if constexpr (Core::levels) {
    s.check<LevelSettings>();
    core.level_settings() = s.values<LevelSettings>();
  }
  Run<Core> run(core, host_stamps, period, given.has_value());
  run.soft_later_ns = std::llround(1e9 * soft_later);
  return run;
}

struct Scene {
  const char* name;
  Settings (*settings)();
  AnyRun (*run)(const Settings&);
};

using Robust = HandoverKind<double>;
constexpr Scene scenes[] = {
    {"fixed", &settings_of<FixedKind<double>, FixedScene>, &run_of<FixedKind<double>, FixedScene>},
    {"paper", &settings_of<AdaptiveKind<double>, PaperScene>, &run_of<AdaptiveKind<double>, PaperScene>},
    {"handheld", &settings_of<Robust, HandheldScene>, &run_of<Robust, HandheldScene>},
    {"sliding", &settings_of<WindowKind<double>, SlidingScene>, &run_of<WindowKind<double>, SlidingScene>},
};

inline py::list scene_names() {
  py::list names;
  for (const Scene& scene : scenes) {
    names.append(scene.name);
  }
  return names;
}

inline const Scene& scene_named(const py::object& given) {
  for (const Scene& scene : scenes) {
    if (given.equal(py::str(scene.name))) {
      return scene;
    }
  }
  throw value_error("scene: " + unlike(given, scene_names()));
}
