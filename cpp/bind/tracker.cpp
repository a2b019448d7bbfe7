// SPDX-License-Identifier: MIT
#include "readings.hpp"
#include "scenes.hpp"
#include "tracker_docs.hpp"

namespace {

class PyTracker {
  template <class Get>
  auto get(Get&& get) const {
    return std::visit([&](const auto& run) { return get(run.core); }, run_);
  }

 public:
  PyTracker(const Scene& scene, const Settings& settings)
      : scene_(scene.name), settings_(settings), run_(scene.run(settings)) {}

  py::object feed(double t_hard, double t_soft, double hard, double soft) {
    require_idle(busy_, "tracker");
    if (!is_time(t_hard)) refuse_time("t_hard", t_hard);
    if (!is_time(t_soft)) refuse_time("t_soft", t_soft);
    const auto report = std::visit(
        [&](auto& run) { return run.take(nanoseconds_of(t_hard), nanoseconds_of(t_soft), hard, soft, touches_); },
        run_);
    return report.finished ? py::cast(touches_.list.back()) : py::none();
  }

  py::object process(const py::object& t_hard, const py::object& t_soft, const py::object& hard,
                     const py::object& soft) {
    require_idle(busy_, "tracker");
    const Readings given(t_hard, t_soft, hard, soft);
    py::array rows(once<&tracker_row_dtype>(), given.hard.size);
    auto* const row = static_cast<TrackerRow*>(rows.mutable_data());
    run_through(given, [row](py::ssize_t i, const auto& run, const auto& report, std::size_t touches) {
      row[i] = run.row(report, touches);
    });
    return rows;
  }

  void take(const py::object& t_hard, const py::object& t_soft, const py::object& hard, const py::object& soft) {
    require_idle(busy_, "tracker");
    const Readings given(t_hard, t_soft, hard, soft);
    run_through(given, [](py::ssize_t, const auto&, const auto&, std::size_t) {});
  }

  py::object finish() {
    require_idle(busy_, "tracker");
    const bool ended = std::visit([&](auto& run) { return run.finish(touches_); }, run_);
    return ended ? py::cast(touches_.list.back()) : py::none();
  }

  void tare(bool force) {
    if (!force && pressed()) {
      throw std::runtime_error(
          "tare: got it while the probe is in contact, allowed: without contact. Lift the probe, or force=True");
    }
    finish();
    std::visit([](auto& run) { run.tare(true); }, run_);
  }

  void gap() {
    require_idle(busy_, "tracker");
    std::visit([&](auto& run) { run.gap(touches_); }, run_);
  }

  py::list touches_since(py::handle count) const {
    py::list result;
    for (std::size_t i = first_of(count); i < touches_.list.size(); ++i) {
      result.append(py::cast(touches_.list[i]));
    }
    return result;
  }
  py::list revisions_since(py::handle count) const {
    py::list result;
    for (std::size_t i = first_of(count); i < touches_.revisions.size(); ++i) {
      result.append(touches_.revisions[i]);
    }
    return result;
  }

  const char* scene() const { return scene_; }
  py::dict settings_dict() const { return settings_.dict(); }
  py::list touches() const { return touches_since(py::int_(0)); }
  std::size_t touch_count() const { return touches_.list.size(); }
  std::size_t revision_count() const { return touches_.revisions.size(); }
  std::uint32_t retaken() const {
    return get([](const auto& core) { return core.retaken(); });
  }
  const char* state() const {
    return std::visit([](const auto& run) { return run.state(); }, run_);
  }
  double ratio() const {
    return get([](const auto& core) { return core.estimator.ratio(); });
  }
  double standard_error() const {
    return get([](const auto& core) { return core.standard_error(); });
  }
  std::size_t readings() const {
    return get([](const auto& core) { return core.readings(); });
  }

 private:
  static std::size_t first_of(py::handle count) {
    const py::ssize_t first = methods::to_size(count, "count");
    if (first < 0) {
      throw py::value_error("count: got " + std::to_string(first) + ", allowed: 0 or more");
    }
    return static_cast<std::size_t>(first);
  }
  /// Take readings, and call `after` for each. Through a copy, as in Estimator: a reader in another thread sees the state
  /// before the block or the one after it, and a time that is refused changes nothing. A block of 256 takes some 15 us.
  template <class After>
  void run_through(const Readings& given, After&& after) {
    require_idle(busy_, "tracker");  // making arrays of the arguments may have run other Python code
    const InUse in_use(busy_);
    Touches block = Touches::after(touches_);
    std::visit(
        [&](auto& run) {
          auto next = run;
          const Times* refused = nullptr;
          py::ssize_t i = 0;
          const auto loop = [&] {
            std::int64_t t_hard, t_soft;
            for (; i < given.hard.size && !(refused = given.read(i, t_hard, t_soft)); ++i) {
              const auto report = next.take(t_hard, t_soft, given.hard[i], given.soft[i], block);
              after(i, next, report, block.count());
            }
          };
          run_block(given.hard.size, loop, 256);
          if (refused) {
            refused->refuse(i);
          }
          run = next;
        },
        run_);
    touches_.append(block);
  }
  bool pressed() const {
    return std::visit([](const auto& run) { return run.pressed(); }, run_);
  }

  const char* scene_;
  Settings settings_;
  AnyRun run_;
  Touches touches_;
  bool busy_ = false;
};
constexpr auto default_scene = "handheld";

}  // namespace

void bind_tracker(py::module_& module) {
  using T = PyTracker;
  const std::string parameters = "(scene='" + std::string(default_scene) + "', **settings)";
  const auto made = [](const py::object& name, const py::kwargs& given) {
    const Scene& scene = scene_named(name);
    const Settings settings = scene.settings.with("Tracker", given);
    require(settings["full_scale"] > 0, "full_scale", settings["full_scale"], "0 < full_scale, pF");
    return T(scene, settings);
  };
  auto type =
      methods::define_class<T>(module, "Tracker", parameters, tracker_doc, made, py::arg("scene") = default_scene);
  methods::define_numeric<&T::feed>(type, "feed", feed_doc, {"t_hard", "t_soft", "hard", "soft"});
  methods::define_display(type, "tracker");
  const auto t_hard = py::arg("t_hard"), t_soft = py::arg("t_soft"), hard = py::arg("hard"), soft = py::arg("soft");
  type.def("process", &T::process, t_hard, t_soft, hard, soft, process_doc)
      .def("take", &T::take, t_hard, t_soft, hard, soft, take_doc)
      .def("finish", &T::finish, finish_doc)
      .def("tare", &T::tare, py::arg("force") = false, tare_doc)
      .def("gap", &T::gap, gap_doc)
      .def("touches_since", &T::touches_since, touches_since_doc)
      .def("revisions_since", &T::revisions_since, revisions_since_doc)
      .def_property_readonly("scene", &T::scene, "Name of the scene.")
      .def_property_readonly("settings", &T::settings_dict,
                             "The settings, as a dict: `Tracker(t.scene, **t.settings)` is a new tracker like `t`.")
      .def_property_readonly("state", &T::state,
                             "\"baseline\" (being measured), \"waiting\", \"contact\", or \"done\" (not yet released).")
      .def_property_readonly("ratio", &T::ratio, "Ratio of the running touch, or of the last one.")
      .def_property_readonly("standard_error", &T::standard_error,
                             "Standard deviation of that ratio; nan if it is not known.")
      .def_property_readonly("readings", &T::readings, "Readings taken so far.")
      .def_property_readonly("touches", &T::touches, "Every touch that has ended, in order of time.")
      .def_property_readonly("touch_count", &T::touch_count, "How many touches have ended.")
      .def_property_readonly("revision_count", &T::revision_count, "How many touches were revised after their release.")
      .def_property_readonly("retaken", &T::retaken,
                             "How often the channels fell far below the baseline, which was then measured again: it "
                             "had been measured in contact, or it jumped.");
  module.attr("scenes") = py::tuple(scene_names());
}
