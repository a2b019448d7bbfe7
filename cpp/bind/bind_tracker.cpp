// SPDX-License-Identifier: MIT
#include <pybind11/stl.h>

#include "fastcall.hpp"
#include "pickling.hpp"
#include "tracker.hpp"

namespace {

constexpr auto tracker_doc = R"(The whole way of a sample, from two readings to touches.

Parameters
----------
scene : str
    "fixed": a loop that feeds clean changes, as one touch. "paper": baseline, contact, and the
    paper's estimator for 250 samples. "handheld": the channels aligned, `HandoverRls`.
    "sliding": as handheld, a touch ends by its release only.
**settings
    `samples` (int or None: a touch ends by its release only), `full_scale` (pF: a reading of this
    size is saturated and left out), `release` (share of the press below which a touch ends),
    and the parameters of the scene's estimator.

Raises
------
ValueError
    An unknown scene or setting, or a setting out of range.

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

constexpr auto feed_doc = R"(feed($self, t_hard, t_soft, hard, soft, /)
--

Take one reading of each channel (times in s, capacitances in pF); return the touch that it ends, or None.)";

constexpr auto process_doc = R"(Take a block of readings; the same bits as one `feed` for each.

Parameters
----------
t_hard, t_soft : array_like, shape (n,)
    Times of the two conversions: seconds as floats, or nanoseconds as integers.
hard, soft : array_like, shape (n,), pF
    Readings, baseline included; nan where there is none.

Returns
-------
numpy.ndarray, shape (n,), structured
    After each reading: `ratio`; `standard_error` (nan before it means something, and in scenes
    that do not know it); `alarm`; `contact`; `touch`, the number of the touch that is measured,
    counted from 1, else 0; `statistic`, the detector's (of the touch that is measured, or of the last
    one; 0 without a detector); `hard_baseline` and `soft_baseline`, pF (0 in a scene without, nan before
    the first is known).

Raises
------
ValueError
    Not one-dimensional, not of one length, a time that is not finite.
)";

PyObject* fed(PyTracker& tracker, double t_hard, double t_soft, double hard, double soft) {
  return tracker->feed(t_hard, t_soft, hard, soft).release().ptr();
}

double numeric(const Result& touch, double palpate::Touch<double>::* member) { return touch.touch.*member; }

}  // namespace

void bind_tracker(py::module_& module) {
  py::class_<Result> touch(module, "Touch", "The result of one touch.");
  touch.attr("__module__") = "palpate";
  touch
      .def_property_readonly(
          "start", [](const Result& r) { return r.touch.start; }, "Reading with which it began, counted from 0.")
      .def_property_readonly(
          "start_s", [](const Result& r) { return r.start_s; }, "Time of that reading, s; nan without times.")
      .def_property_readonly(
          "samples", [](const Result& r) { return r.touch.samples; }, "Samples that the estimate rests on.")
      .def_property_readonly(
          "ratio", [](const Result& r) { return numeric(r, &palpate::Touch<double>::ratio); },
          "Capacitance ratio, hard / soft, at the end of the touch.")
      .def_property_readonly(
          "covariance", [](const Result& r) { return numeric(r, &palpate::Touch<double>::covariance); },
          "Unscaled covariance P of the ratio, 1/pF^2: the smaller, the harder was pressed.")
      .def_property_readonly(
          "standard_error", [](const Result& r) { return numeric(r, &palpate::Touch<double>::standard_error); },
          "Standard deviation of the ratio; nan where it is not known.")
      .def_property_readonly("alarm_share", &Result::alarm_share, "Share of the samples with the alarm on.")
      .def_property_readonly(
          "saturated", [](const Result& r) { return r.touch.saturated; }, "Readings left out as saturated.")
      .def_property_readonly(
          "refused", [](const Result& r) { return r.touch.refused; },
          "Readings that gave no sample: without a value, or not to be aligned.")
      .def_property_readonly("flags", &Result::flags,
                             "What stands against the result: \"short\" (fewer samples than asked for), "
                             "\"saturated\", \"refused\" (more than a quarter of the readings gave no sample), "
                             "\"unsettled\" (no standard error in a scene that should know it), "
                             "\"unexcited\" (the samples hardly moved the initial ratio).")
      .def(
          "__eq__", [](const Result& a, const Result& b) { return a.as_dict().equal(b.as_dict()); }, py::is_operator())
      .def("__repr__",
           [](const Result& r) {
             return "Touch(" + py::str(", ").attr("join")(r.assignments()).cast<std::string>() + ")";
           })
      .def("_untimed",
           [](Result r) {
             r.start_s = std::numeric_limits<double>::quiet_NaN();
             return r;
           })
      .def("as_dict", &Result::as_dict, "Every field, as plain numbers; nan as None.")
      .def(py::pickle([](const Result& r) { return r.state(); },
                      [](const py::tuple& state) { return of_pickled(state, &Result::of); }));

  bind_reduce(touch);

  py::class_<PyTracker> tracker(module, "Tracker", tracker_doc);
  tracker.attr("__module__") = "palpate";
  fastcall::def_numbers<PyTracker, 4, &fed>(tracker, "feed", feed_doc);
  tracker
      .def(py::init([](const std::string& scene, const py::kwargs& settings) { return PyTracker(scene, settings); }),
           py::arg("scene") = "handheld")
      .def(
          "process",
          [](PyTracker& t, const py::object& t_hard, const py::object& t_soft, const py::object& hard,
             const py::object& soft) { return t->process(t_hard, t_soft, hard, soft); },
          py::arg("t_hard"), py::arg("t_soft"), py::arg("hard"), py::arg("soft"), process_doc)
      .def(
          "__reduce_ex__",
          [](const PyTracker&, int) -> py::object {
            throw py::type_error("cannot pickle a Tracker: make a new one with the same scene and settings");
          },
          py::arg("protocol"), py::pos_only())
      .def(
          "finish", [](PyTracker& t) { return t->finish(); },
          "End a touch that is still running, and return it; None where there is none.")
      .def(
          "tare", [](PyTracker& t) { t->tare(); },
          "Measure the baseline anew, with nothing touched: after a jump, which the gate takes for a touch without "
          "end.")
      .def("__repr__",
           [](const PyTracker& t) {
             return "<Tracker(" + py::repr(py::str(t->scene())).cast<std::string>() + ") " +
                    t->state().cast<std::string>() + " ratio=" + number(t->ratio()) +
                    " touches=" + std::to_string(t->touches().size()) + ">";
           })
      .def_property_readonly(
          "scene", [](const PyTracker& t) { return t->scene(); }, "Its name.")
      .def_property_readonly(
          "settings", [](const PyTracker& t) { return t->settings(); },
          "The settings, as a dict: `Tracker(t.scene, **t.settings)` is a new tracker like `t`.")
      .def_property_readonly(
          "state", [](const PyTracker& t) { return t->state(); },
          "\"baseline\" (being measured), \"waiting\", \"contact\", or \"done\" (not yet released).")
      .def_property_readonly(
          "ratio", [](const PyTracker& t) { return t->ratio(); }, "Ratio of the running touch, or of the last one.")
      .def_property_readonly(
          "standard_error", [](const PyTracker& t) { return t->standard_error(); },
          "Of that ratio; nan where it is not known.")
      .def_property_readonly(
          "readings", [](const PyTracker& t) { return t->readings(); }, "Readings taken so far.")
      .def_property_readonly(
          "touches", [](const PyTracker& t) { return t->touches(); }, "Every touch that has ended, in order of time.");
}
