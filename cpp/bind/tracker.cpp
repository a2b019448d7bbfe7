// SPDX-License-Identifier: MIT
#include <pybind11/stl.h>

#include <cmath>
#include <vector>

#include "scenes.hpp"
#include "touch.hpp"

namespace {

using palpate::runs::Result;

/// As std::llround(seconds * 1e9), without a call; |seconds| < 9e9.
std::int64_t nanoseconds_of(double seconds) {
  const double exact = palpate::product(seconds, 1e9);
  const auto whole = static_cast<std::int64_t>(exact);
  const double rest = exact - static_cast<double>(whole);  // both are multiples of the last place: no rounding
  return whole + (rest >= 0.5) - (rest <= -0.5);
}
bool is_time(double seconds) { return std::abs(seconds) < 9e9; }
void require_time(const char* name, double seconds) {
  if (!is_time(seconds)) {
    refuse<value_error>(name, seconds, "finite times, s, within 9e9 of 0");
  }
}

/// The times of a channel, ns; `given`: seconds as floats, or nanoseconds as integers.
View<const std::int64_t> times_of(const py::object& given, const char* name, py::ssize_t size) {
  const py::array array(given);
  const char kind = array.dtype().kind();
  py::ssize_t i = 0;
  if (kind == 'i' || kind == 'u') {
    require_shape(array, name, {size});
    const View<const std::int64_t> times{py::array_t<std::int64_t, py::array::forcecast | aligned>(array)};
    run_block(size, [&] {
      while (i < size && (kind == 'i' || times[i] >= 0)) {
        ++i;
      }
    });
    if (i < size) {  // one above int64 has become negative
      refuse<value_error>(name, static_cast<std::uint64_t>(times[i]), "times below 2**63 ns");
    }
    return times;
  }
  const View<const double> seconds(samples_of<double>(array, name, {size}));
  py::array_t<std::int64_t> times(size);
  std::int64_t* const ns = times.mutable_data();
  run_block(size, [&] {
    for (; i < size && is_time(seconds[i]); ++i) {
      ns[i] = nanoseconds_of(seconds[i]);
    }
  });
  if (i < size) {
    require_time(name, seconds[i]);
  }
  return View<const std::int64_t>(times);
}

/// The touches that have ended, and the numbers, from 1, of those that were revised, in order of time. Only the last one
/// can be revised: before the next one begins, or never.
struct Touches {
  std::vector<Result> list;
  std::vector<std::size_t> revisions;
  std::vector<Judgement> judgements{};
  std::ptrdiff_t before = 0;  ///< how many there are before those in the list

  void end(const Result& touch) { list.push_back(touch); }
  void revise(const Result& touch) {
    list.back() = touch;
    revisions.push_back(count());
  }
  void judge(const Judgement& judgement) { judgements.push_back(judgement); }
  void judge(int) {}  // of a scene that judges nothing
  std::size_t count() const { return static_cast<std::size_t>(before) + list.size(); }

  /// Those of a block, behind the last one of all.
  static Touches after(const Touches& all) {
    const auto last = all.list.end() - (all.list.empty() ? 0 : 1);
    return {{last, all.list.end()}, {}, {}, last - all.list.begin()};
  }
  void append(const Touches& block) {
    list.erase(list.begin() + block.before, list.end());
    list.insert(list.end(), block.list.begin(), block.list.end());
    revisions.insert(revisions.end(), block.revisions.begin(), block.revisions.end());
    judgements.insert(judgements.end(), block.judgements.begin(), block.judgements.end());
  }
};

class PyTracker {
 public:
  const char* const scene;

  /// What get(run) gives.
  template <class Get>
  auto of_run(const Get& get) {
    return std::visit(get, run_);
  }

  PyTracker(const Scene& given, const Settings& settings)
      : scene(given.name), settings_(settings), run_(given.run(settings)) {
    touch_class();  // imported here: no reading waits for it
  }

  py::object feed(PyObject* const* given, Py_ssize_t count) {
    const auto values = numbers_of<4>(given, count, {"t_hard", "t_soft", "hard", "soft"});
    const double t_hard = values[0], t_soft = values[1];
    busy_.require_idle();
    require_time("t_hard", t_hard);
    require_time("t_soft", t_soft);
    const auto report = of_run([&](auto& run) {
      return run.take(palpate::Nanoseconds(nanoseconds_of(t_hard)), palpate::Nanoseconds(nanoseconds_of(t_soft)),
                      values[2], values[3], touches_);
    });
    return report.finished ? touch(touch_count() - 1) : py::none();
  }

  /// Rows, or None. Through a copy, as in Estimator: a reader in another thread sees the state before the block or the one
  /// after it. A block of 256 takes some 15 us.
  template <bool has_rows>
  py::object process(const py::object& t_hard, const py::object& t_soft, const py::object& hard,
                     const py::object& soft) {
    const View<const double> hard_pF(samples_of<double>(hard, "hard", {-1}));
    const View<const double> soft_pF(samples_of<double>(soft, "soft", {hard_pF.size}));
    const auto hard_ns = times_of(t_hard, "t_hard", hard_pF.size), soft_ns = times_of(t_soft, "t_soft", hard_pF.size);
    py::array rows(once<&tracker_row_dtype>(), has_rows ? hard_pF.size : 0);
    auto* const row = static_cast<TrackerRow*>(rows.mutable_data());
    const std::lock_guard in_use(busy_);
    Touches block = Touches::after(touches_);
    const auto take = [&](auto& run) {
      auto next = run;
      const auto loop = [&] {
        for (py::ssize_t i = 0; i < hard_pF.size; ++i) {
          const auto report = next.take(palpate::Nanoseconds(hard_ns[i]), palpate::Nanoseconds(soft_ns[i]), hard_pF[i],
                                        soft_pF[i], block);
          if constexpr (has_rows) {
            row[i] = next.row(report, block.count());
          }
        }
      };
      run_block(hard_pF.size, loop, 256);
      run = next;
    };
    of_run(take);
    touches_.append(block);
    return has_rows ? py::object(rows) : py::none();
  }

  py::object finish() {
    busy_.require_idle();
    const std::size_t before = touch_count();
    of_run([&](auto& run) { run.finish(touches_); });
    return touch_count() > before ? touch(touch_count() - 1) : py::none();
  }

  void tare(bool force) {
    if (!force && of_run([](const auto& run) { return run.pressed(); })) {
      refuse<std::runtime_error>("tare", "it while the probe is in contact",
                                 "without contact. Lift the probe, or force=True");
    }
    finish();
    of_run([](auto& run) { run.tare(true); });
  }

  void gap() {
    busy_.require_idle();
    of_run([&](auto& run) { run.gap(touches_); });
  }

  py::list touches_since(py::handle count) { return touches_from(first_after(count)); }
  py::list revisions_since(py::handle count) const {
    py::list revisions;
    for (std::size_t i = first_after(count); i < touches_.revisions.size(); ++i) {
      revisions.append(touches_.revisions[i]);
    }
    return revisions;
  }

  py::dict settings_dict() const { return settings_.dict(); }
  py::list judgements_since(py::handle count) const {
    py::list judgements;
    for (std::size_t i = first_after(count); i < touches_.judgements.size(); ++i) {
      judgements.append(judgement_object(touches_.judgements[i]));
    }
    return judgements;
  }
  py::list judgements() const { return judgements_since(py::int_(0)); }
  py::list touches() { return touches_from(0); }
  std::size_t touch_count() const { return touches_.list.size(); }
  std::size_t revision_count() const { return touches_.revisions.size(); }

 private:
  static std::size_t first_after(py::handle count) {
    const py::ssize_t first = to_size(count, "count");
    if (first < 0) {
      refuse<value_error>("count", first, "0 or more");
    }
    return static_cast<std::size_t>(first);
  }

  py::list touches_from(std::size_t first) {
    py::list touches;
    for (std::size_t i = first; i < touches_.list.size(); ++i) {
      touches.append(touch(i));
    }
    return touches;
  }

  /// A touch as an object of Python: the same one until it is revised.
  py::object touch(std::size_t index) {
    objects_.resize(touches_.list.size());
    const std::size_t revisions = touches_.revisions.size();
    for (; revisions_seen_ < revisions; ++revisions_seen_) {
      objects_[touches_.revisions[revisions_seen_] - 1] = py::object();
    }
    if (objects_[index]) {
      return objects_[index];
    }
    const auto result = touches_.list[index];  // a copy: while Python runs, another thread may add touches
    const py::object made = touch_object(result);
    if (revisions == touches_.revisions.size()) {
      objects_[index] = made;
    }
    return made;
  }

  Settings settings_;
  AnyRun run_;
  Touches touches_;
  std::vector<py::object> objects_;  ///< of the touches; empty: not made yet
  std::size_t revisions_seen_ = 0;   ///< for which objects were dropped
  Busy busy_{"tracker"};
};

constexpr auto tracker_doc =
    R"(All stages of a scene: takes readings of both channels, finds touches, estimates their ratios.

Parameters
----------
scene : str
    "fixed": clean changes of capacitance, always in contact. "paper": baseline, contact, and the paper's estimator
    for 250 samples. "handheld": the channels aligned, `HandoverRls`, 6.5 s; a test of the model, and a revised result
    after the release. "sliding": as handheld, but the ratio may move, and a touch ends at its release only.
**settings
    Settings of the scene, below, and the parameters of its estimator: `Rls` (fixed), `AdaptiveRls` (paper), `HandoverRls`
    (handheld, sliding). TypeError for a setting that the scene does not have.

Other Parameters
----------------
samples : int, 1 or more, or None
    Length of a touch in samples. If `seconds` is None, too, a touch ends at its release only.
seconds : float, s, above 0 to 9e9, or None
    Length of a touch.
full_scale : float, pF, above 0
    A reading of this size is saturated and left out. inf: the converter has no limit.
release : float, 0 < release < 1
    Share of the press below which a touch ends.
falling : bool
    Whether a press makes both channels fall (mutual capacitances, or inverted wiring). Results keep the sign.
baseline : str or tuple of float, pF
    "measured"; "zero", for readings that are changes already, as of an indenter; or the values (hard, soft), or with the
    noise of each (hard, soft, 4e-5, 4e-5). A baseline that is given stays, its error is not in the uncertainty, and a touch
    may run from the first readings on.
host_stamps : bool
    Whether the times are those of a computer: they are smoothed.
soft_later : float, s, -1 < soft_later < 1
    The soft readings are later than their times by this, as where a row has one time for both channels.
period : float, s, 0 to 1e9
    Time from pair to pair of the device. 0: not known, and no touch has the flag "late".
confirmed : float, s, 0 or more
    A change becomes the result after this time with the probe down. 0: off.
averaged : float, s, 0 to 1
    If a converter gives more than three readings in this time, they are averaged over it. 0: off.
contact_exponent : float, 0, 1 or 1.5
    Exponent p of the level ratio, force ~ depth^p: 1 for flat bumps, 1.5 for domes. 0: no level ratio.
age : float, s, 0 or more
    Time from the moment when the press has settled to the end of the touch. 0: a touch ends at its length.
steady : float, 0 < steady <= 1
    Forgetting factor while the alarm is off (paper), or while the ratio does not drift (handheld).
initial_covariance : float, 1/pF^2
    Uncertainty of the initial ratio, as in `Rls`.

Examples
--------
>>> import numpy as np, palpate
>>> press = np.repeat([0.0, 0.25, 0.0], [60, 270, 30])
>>> t = np.arange(360) * 0.026
>>> tracker = palpate.Tracker("handheld")
>>> rows = tracker.process(t, t + 0.013, 9 + 2.5 * press, 8 + press)
>>> [(touch.samples, round(touch.ratio, 3)) for touch in tracker.touches]
[(250, 2.5)]
)";

constexpr auto tracker_process_doc = R"(process(self, /, t_hard, t_soft, hard, soft)
--

Take a block of readings; the same bits as one `feed` for each.

Parameters
----------
t_hard, t_soft : array_like, shape (n,)
    Times of the two conversions: seconds as floats, or nanoseconds as integers.
hard, soft : array_like, shape (n,), pF
    Readings with their baseline; nan for a missing one.

Returns
-------
numpy.ndarray, shape (n,), structured
    After each reading: `ratio`; `standard_error` (nan for the first samples, and in scenes without one); `alarm`;
    `contact`; `touch`, the number of the running touch, counted from 1, or 0; `statistic` of the detector (of the
    running touch, or of the last one; 0 without a detector); `hard_baseline` and `soft_baseline`, pF (0 in a scene
    without, nan until the first is known); `revised`, whether this reading revised the last touch.
)";

}  // namespace

void bind_tracker(py::module_& module) {
  using T = PyTracker;
  const auto made = [](const py::object& name, const py::kwargs& given) {
    const Scene& scene = scene_named(name);
    const Settings settings = scene.settings().with("Tracker", given);
    return T(scene, settings);
  };
  auto type = define_class<T>(module, "Tracker", "(scene='handheld', **settings)", tracker_doc, made,
                              py::arg("scene") = "handheld");
  type.fast<&T::feed>("feed", R"(feed($self, t_hard, t_soft, hard, soft, /)
--

Take one reading of each channel (times in s, capacitances in pF); return the touch that it ends, or None.
)");
  define_display(type, "tracker_line", "tracker_card");
  const auto add = [&](const char* property, auto get, const char* doc) {
    type.property(property, [get](T& tracker) { return tracker.of_run(get); }, doc);
  };
  const auto t_hard = py::arg("t_hard"), t_soft = py::arg("t_soft"), hard = py::arg("hard"), soft = py::arg("soft");
  type.def("process", &T::process<true>, t_hard, t_soft, hard, soft,
           (tracker_process_doc + std::string(raises)).c_str())
      .def("take", &T::process<false>, t_hard, t_soft, hard, soft, R"(take(self, /, t_hard, t_soft, hard, soft)
--

Take a block of readings as `process`, without rows: where only the touches count, in about half the time.)")
      .def("finish", &T::finish,
           "finish(self, /)\n--\n\nEnd the running touch and return it; None if no touch is running.")
      .def("tare", &T::tare, py::arg("force") = false, R"(tare(self, /, force=False)
--

Measure the baseline again, with nothing touched: after a jump upwards, which the gate takes for an endless touch.

In contact it raises RuntimeError, unless `force` is True: a baseline that was measured in contact is noticed at the
release, and measured again.)")
      .def("gap", &T::gap, R"(gap(self, /)
--

The readings from here on have another baseline: the board was opened again or replaced, or its range was moved.

It ends a running touch, and measures the baseline again, with whatever the probe touches now. That touch and the next
ones have the flag "gap", until the release of one shows that this baseline was measured without contact, or until `tare`.
If it shows the opposite, that touch has the flag "baseline".)")
      .def("touches_since", &T::touches_since,
           "touches_since(self, count, /)\n--\n\nReturn the touches after the first `count`, in order of time.")
      .def("revisions_since", &T::revisions_since,
           "revisions_since(self, count, /)\n--\n\nReturn the numbers, from 1, of the touches that were revised after "
           "the first `count` revisions, in order of time.");
  type.def("judgements_since", &T::judgements_since,
           "judgements_since(self, count, /)\n--\n\nReturn the judgements after the first `count`, in order of time.");
  type.property("judgements", &T::judgements,
                "What was judged of the readings, as a list of `palpate.judgements.Judgement`, in order of time.");
  type.property("scene", &T::scene, "Name of the scene.")
      .property("settings", &T::settings_dict,
                "The settings, as a dict: `Tracker(t.scene, **t.settings)` is a new tracker like `t`.")
      .property("touches", &T::touches, "Every touch that has ended, in order of time.")
      .property("touch_count", &T::touch_count, "How many touches have ended.")
      .property("revision_count", &T::revision_count, "How many touches were revised after their release.");
  add(
      "state", [](const auto& run) { return run.state(); },
      "\"baseline\" (being measured), \"waiting\", \"contact\", or \"done\" (not yet released).");
  add(
      "ratio", [](const auto& run) { return run.core.ratio(); },
      "Ratio of the running touch, or of the last one; nan until it has a sample.");
  add(
      "standard_error", [](const auto& run) { return run.core.standard_error(); },
      "Standard deviation of that ratio; nan if it is not known.");
  add(
      "threshold", [](const auto& run) { return threshold_of(run.core.estimator); },
      "There is an alarm when the detector's statistic is larger than this; inf without a detector.");
  add(
      "readings", [](const auto& run) { return run.core.readings() + static_cast<std::size_t>(run.core.waiting()); },
      "Readings taken so far.");
  add(
      "retaken", [](const auto& run) { return run.core.retaken(); },
      "How often the channels fell far below the baseline, which was then measured again: it had been measured in "
      "contact, or it jumped.");
  add(
      "pressed_again", [](const auto& run) { return run.core.gate.pressed_again(); },
      "How often the probe was pressed again before it was lifted, so that no touch began.");
  module.attr("scenes") = py::tuple(scene_names());
}
