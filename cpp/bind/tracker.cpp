// SPDX-License-Identifier: MIT
#include "tracker.hpp"

#include <algorithm>
#include <array>

namespace {

/// One row of Tracker.process.
struct TrackerRow {
  double ratio, standard_error, statistic, hard_baseline, soft_baseline;
  std::int32_t touch;
  bool alarm, contact;
  unsigned char padding[2];

  static py::dtype dtype() {
    FieldList fields;
    fields.add<double>("ratio", offsetof(TrackerRow, ratio));
    fields.add<double>("standard_error", offsetof(TrackerRow, standard_error));
    fields.add<bool>("alarm", offsetof(TrackerRow, alarm));
    fields.add<bool>("contact", offsetof(TrackerRow, contact));
    fields.add<std::int32_t>("touch", offsetof(TrackerRow, touch));
    fields.add<double>("statistic", offsetof(TrackerRow, statistic));
    fields.add<double>("hard_baseline", offsetof(TrackerRow, hard_baseline));
    fields.add<double>("soft_baseline", offsetof(TrackerRow, soft_baseline));
    return fields.dtype(sizeof(TrackerRow));
  }
};

/// Every setting of every scene; each scene has a list of those it knows.
struct TrackerSettings {
  double samples = 250, full_scale = std::numeric_limits<double>::infinity(), release = 0.5;
  double forgetting = 0.995, steady = 0.995, alarmed = 0.9, drift = 0.01, threshold = 0.05, clip = 3.0,
         smoothing = 0.0625;
  double initial_ratio = 1.0, initial_covariance = 1e4, max_covariance = 1e6;

  using F = Field<TrackerSettings>;
  static constexpr std::array<F, 13> fields() {
    using S = TrackerSettings;
    return {{F{"samples", &S::samples}, F{"full_scale", &S::full_scale}, F{"release", &S::release},
             F{"forgetting", &S::forgetting}, F{"steady", &S::steady}, F{"alarmed", &S::alarmed}, F{"drift", &S::drift},
             F{"threshold", &S::threshold}, F{"clip", &S::clip}, F{"smoothing", &S::smoothing},
             F{"initial_ratio", &S::initial_ratio}, F{"initial_covariance", &S::initial_covariance},
             F{"max_covariance", &S::max_covariance}}};
  }
};

const std::vector<std::string> fixed_names{"samples",       "full_scale",         "forgetting",
                                           "initial_ratio", "initial_covariance", "max_covariance"};
const std::vector<std::string> paper_names{
    "samples",       "full_scale",         "release",       "steady", "alarmed", "drift", "threshold",
    "initial_ratio", "initial_covariance", "max_covariance"};
const std::vector<std::string> handheld_names{"samples",       "full_scale",         "release",       "steady",
                                              "drift",         "threshold",          "clip",          "smoothing",
                                              "initial_ratio", "initial_covariance", "max_covariance"};

using Fixed = palpate::FixedTracker<double>;
using Paper = palpate::PaperTracker<double>;
using Handheld = palpate::HandheldTracker<double>;

void configure(Fixed& tracker, const TrackerSettings& s) {
  require(is_forgetting(s.forgetting), "forgetting", s.forgetting, "0 < forgetting <= 1");
  tracker.estimator = palpate::FixedRls<double>({s.forgetting}, {}, {1 / s.max_covariance});
}
void configure(Paper& tracker, const TrackerSettings& s) {
  check_adaptive(s);
  tracker.estimator =
      palpate::AdaptiveRls<double>({s.steady, s.alarmed}, {s.drift, s.threshold}, {1 / s.max_covariance});
  tracker.gate.settings.release = s.release;
}
void configure(Handheld& tracker, const TrackerSettings& s) {
  check_handover(s);
  tracker.estimator =
      palpate::Handover<double>({s.steady, s.drift, s.threshold, s.clip, s.smoothing, 1 / s.max_covariance});
  tracker.gate.settings.release = s.release;
}

/// Seconds as floats, or nanoseconds as integers, to nanoseconds.
std::vector<std::int64_t> ticks_of(const py::object& value, const std::string& name, py::ssize_t size) {
  const py::array array(value);
  std::vector<std::int64_t> ticks(static_cast<std::size_t>(array.size()));
  if (array.dtype().kind() == 'i' || array.dtype().kind() == 'u') {
    require_shape(array, name, size);
    const py::array_t<std::int64_t, py::array::forcecast> integers(array);
    for (py::ssize_t i = 0; i < integers.size(); ++i) {
      ticks[static_cast<std::size_t>(i)] = integers.at(i);
    }
    return ticks;
  }
  const auto seconds = samples_of<double>(array, name, size);
  for (py::ssize_t i = 0; i < seconds.size(); ++i) {
    require(std::abs(seconds.at(i)) < 9e9, name.c_str(), seconds.at(i), "finite times, s, within 9e9 of 0");
    ticks[static_cast<std::size_t>(i)] = std::llround(seconds.at(i) * 1e9);
  }
  return ticks;
}

template <class Core>
class SceneTracker final : public AnyTracker {
 public:
  SceneTracker(std::string scene, std::vector<std::string> names, const TrackerSettings& settings)
      : scene_(std::move(scene)), names_(std::move(names)), settings_(settings) {
    configure(core_, settings);
    core_.settings.initial_ratio = settings.initial_ratio;
    core_.settings.initial_covariance = settings.initial_covariance;
    core_.estimator.reset(settings.initial_ratio, settings.initial_covariance);
    core_.settings.samples = static_cast<std::uint32_t>(settings.samples);
    core_.settings.full_scale = settings.full_scale;
  }

  py::object feed(double t_hard, double t_soft, double hard, double soft) override {
    require(std::abs(t_hard) < 9e9, "t_hard", t_hard, "a finite time, s, within 9e9 of 0");
    require(std::abs(t_soft) < 9e9, "t_soft", t_soft, "a finite time, s, within 9e9 of 0");
    const bool ended = take(std::llround(t_hard * 1e9), std::llround(t_soft * 1e9), hard, soft).finished;
    return ended ? py::cast(touches_.back()) : py::none();
  }

  py::array process(const py::object& t_hard, const py::object& t_soft, const py::object& hard,
                    const py::object& soft) override {
    const auto h = samples_of<double>(hard, "hard");
    const py::ssize_t size = h.shape(0);
    const auto s = samples_of<double>(soft, "soft", size);
    const auto th = ticks_of(t_hard, "t_hard", size);
    const auto ts = ticks_of(t_soft, "t_soft", size);
    py::array rows(TrackerRow::dtype(), size);
    auto* row = static_cast<TrackerRow*>(rows.mutable_data());
    for (py::ssize_t i = 0; i < size; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const auto report = take(th[k], ts[k], h.at(i), s.at(i));
      const bool measured = report.finished || core_.open();
      const auto number = static_cast<std::int32_t>(touches_.size()) + (report.finished ? 0 : 1);
      based_ = based_ || core_.ready();
      row[i] = {report.ratio,
                core_.standard_error(),
                core_.estimator.statistic(),
                level(core_.hard_baseline),
                level(core_.soft_baseline),
                measured ? number : 0,
                report.alarm,
                report.contact,
                {}};
    }
    return rows;
  }

  py::object finish() override {
    if (!core_.finish()) {
      return py::none();
    }
    keep();
    return py::cast(touches_.back());
  }

  void tare() override {
    finish();
    core_.tare();
  }

  std::string scene() const override { return scene_; }
  py::dict settings() const override {
    py::dict all = to_dict(settings_), mine;
    for (const auto& name : names_) {
      mine[name.c_str()] = all[name.c_str()];
    }
    mine["samples"] = settings_.samples == 0 ? py::object(py::none()) : py::object(py::int_(core_.settings.samples));
    return mine;
  }
  py::str state() const override {
    return core_.open() ? "contact" : !core_.ready() ? "baseline" : core_.gate.idle() ? "waiting" : "done";
  }
  double ratio() const override { return core_.estimator.ratio(); }
  double standard_error() const override { return core_.standard_error(); }
  std::uint64_t readings() const override { return core_.readings(); }
  std::vector<Result> touches() const override { return touches_; }

 private:
  palpate::Report<double> take(std::int64_t t_hard, std::int64_t t_soft, double hard, double soft) {
    // Times of the last readings, as many as a touch may be dated back.
    times_[core_.readings() % times_.size()] = t_hard;
    const auto report = core_.feed(t_hard, t_soft, hard, soft);
    if (core_.open() && !was_open_) {
      const std::uint64_t oldest = core_.readings() > times_.size() ? core_.readings() - times_.size() : 0;
      start_s_ = static_cast<double>(times_[std::max(core_.started(), oldest) % times_.size()]) * 1e-9;
    }
    was_open_ = core_.open();
    if (report.finished) {
      keep();
    }
    return report;
  }

  template <class BaselineStage>
  double level(const BaselineStage& baseline) const {
    return based_ ? baseline.level() : std::numeric_limits<double>::quiet_NaN();
  }

  void keep() {
    touches_.push_back({core_.touch(), start_s_, core_.settings.samples, settings_.initial_covariance,
                        palpate::knows_its_error<decltype(core_.estimator)>});
  }

  std::string scene_;
  std::vector<std::string> names_;
  TrackerSettings settings_;
  Core core_;
  std::vector<Result> touches_;
  std::array<std::int64_t, 256> times_{};
  double start_s_ = 0;
  bool was_open_ = false;
  bool based_ = false;  // a baseline has been measured, ever
};

double real_of(const std::string& name, const py::handle& value) {
  const double real = PyFloat_AsDouble(value.ptr());
  if (PyErr_Occurred()) {
    PyErr_Clear();
    throw py::type_error(name + ": got " + py::repr(value).cast<std::string>() + ", allowed: a number");
  }
  return real;
}

TrackerSettings read_settings(TrackerSettings settings, const std::vector<std::string>& names, const py::dict& given) {
  for (const auto& item : given) {
    const auto name = item.first.cast<std::string>();
    const bool known = std::find(names.begin(), names.end(), name) != names.end();
    if (!known) {
      std::string allowed;
      for (const auto& candidate : names) {
        allowed += (allowed.empty() ? "" : ", ") + candidate;
      }
      throw py::value_error("settings: got '" + name + "', allowed: " + allowed);
    }
    for (const auto& field : TrackerSettings::fields()) {
      if (name == field.name) {
        settings.*field.value = item.second.is_none() && name == "samples" ? 0.0 : real_of(name, item.second);
      }
    }
    if (name == "samples" && !item.second.is_none()) {
      require(settings.samples >= 1 && settings.samples <= 4e9 && settings.samples == std::floor(settings.samples),
              "samples", settings.samples, "a whole number >= 1, or None");
    }
  }
  require(settings.full_scale > 0, "full_scale", settings.full_scale, "0 < full_scale, pF");
  require(settings.release > 0 && settings.release < 1, "release", settings.release, "0 < release < 1");
  check_prior<double>(settings);
  return settings;
}

}  // namespace

std::unique_ptr<AnyTracker> make_tracker(const std::string& scene, const py::dict& given) {
  TrackerSettings settings;
  if (scene == "fixed") {
    settings.samples = 0;
    return std::make_unique<SceneTracker<Fixed>>(scene, fixed_names, read_settings(settings, fixed_names, given));
  }
  if (scene == "paper") {
    return std::make_unique<SceneTracker<Paper>>(scene, paper_names, read_settings(settings, paper_names, given));
  }
  if (scene == "handheld" || scene == "sliding") {
    settings.drift = 0.75;
    settings.threshold = 8;
    settings.initial_covariance = 1e10;
    settings.max_covariance = 1e12;
    if (scene == "sliding") {
      settings.samples = 0;
      settings.release = 0.3;
    }
    return std::make_unique<SceneTracker<Handheld>>(scene, handheld_names,
                                                    read_settings(settings, handheld_names, given));
  }
  throw py::value_error("scene: got '" + scene + "', allowed: fixed, paper, handheld, sliding");
}
