// SPDX-License-Identifier: MIT
#include "constructors.hpp"
#include "core_state.hpp"
#include "methods.hpp"
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

  py::object process(py::handle t_hard, py::handle t_soft, py::handle hard, py::handle soft) {
    require_idle(busy_, "tracker");
    const Readings given(t_hard, t_soft, hard, soft);
    py::array rows(once<&tracker_row_dtype>(), given.size());
    auto* const row = static_cast<TrackerRow*>(rows.mutable_data());
    run_through(given, [row](py::ssize_t i, const auto& run, const auto& report, std::size_t touches) {
      row[i] = run.row(report, touches);
    });
    return rows;
  }

  void take(py::handle t_hard, py::handle t_soft, py::handle hard, py::handle soft) {
    require_idle(busy_, "tracker");
    const Readings given(t_hard, t_soft, hard, soft);
    run_through(given, [](py::ssize_t, const auto&, const auto&, std::size_t) {});
  }

  py::object finish() {
    require_idle(busy_, "tracker");
    const bool ended = std::visit([&](auto& run) { return run.finish(touches_); }, run_);
    return ended ? py::cast(touches_.list.back()) : py::none();
  }

  void tare(py::handle force) {
    if (!py::bool_(py::reinterpret_borrow<py::object>(force)) && pressed()) {
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
    const py::ssize_t first = methods::to_size("count", py::reinterpret_borrow<py::object>(count));
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
            for (; i < given.size() && !(refused = given.read(i, t_hard, t_soft)); ++i) {
              const auto report = next.take(t_hard, t_soft, given.hard[i], given.soft[i], block);
              after(i, next, report, block.count());
            }
          };
          run_block(given.size(), loop, 256);
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

PyTracker made(const methods::Given& given) {
  const Scene& scene = scene_named(given.first ? given.first : py::str(default_scene));
  const Settings settings = scene.settings.with(given.owner, given.settings);
  require(settings["full_scale"] > 0, "full_scale", settings["full_scale"], "0 < full_scale, pF");
  return PyTracker(scene, settings);
}

void refuse_pickle(py::handle, py::handle) {
  throw py::type_error("cannot pickle a Tracker: make a new one with the same scene and settings");
}

}  // namespace

void bind_tracker(py::module_& module) {
  using T = PyTracker;
  const std::string parameters = "(scene='" + std::string(default_scene) + "', **settings)";
  auto type = methods::define_class<&made>(module, "Tracker", parameters, tracker_doc);
  methods::define<&T::feed>(type, feed_doc);
  methods::define<&T::process>(type, process_doc);
  methods::define<&T::take>(type, take_doc);
  methods::define<&T::finish>(type, finish_doc);
  methods::define<&T::tare>(type, tare_doc);
  methods::define<&T::gap>(type, gap_doc);
  methods::define<&T::touches_since>(type, touches_since_doc);
  methods::define<&T::revisions_since>(type, revisions_since_doc);
  display::define<display::Kind::tracker>(type);
  methods::define<&refuse_pickle>(type, "__reduce_ex__($self, protocol, /)\n--\n\n");
  methods::property<&T::scene>(type, "scene", "Name of the scene.");
  methods::property<&T::settings_dict>(
      type, "settings", "The settings, as a dict: `Tracker(t.scene, **t.settings)` is a new tracker like `t`.");
  methods::property<&T::state>(
      type, "state", "\"baseline\" (being measured), \"waiting\", \"contact\", or \"done\" (not yet released).");
  methods::property<&T::ratio>(type, "ratio", "Ratio of the running touch, or of the last one.");
  methods::property<&T::standard_error>(type, "standard_error",
                                        "Standard deviation of that ratio; nan if it is not known.");
  methods::property<&T::readings>(type, "readings", "Readings taken so far.");
  methods::property<&T::touches>(type, "touches", "Every touch that has ended, in order of time.");
  methods::property<&T::touch_count>(type, "touch_count", "How many touches have ended.");
  methods::property<&T::revision_count>(type, "revision_count", "How many touches were revised after their release.");
  methods::property<&T::retaken>(
      type, "retaken",
      "How often the channels fell far below the baseline, which was then measured again: it "
      "had been measured in contact, or it jumped.");
  py::list names;
  for (const Scene& scene : scenes()) {
    names.append(scene.name);
  }
  module.attr("scenes") = py::tuple(names);
}
