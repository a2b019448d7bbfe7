// SPDX-License-Identifier: MIT
#include <cmath>
#include <functional>
#include <limits>
#include <type_traits>

#include "../runs/run.hpp"
#include "methods.hpp"

namespace {

using R = palpate::runs::Result;

py::object flags(const R& touch) {
  py::list flags;
  touch.visit_flags([&](const char* name) { flags.append(name); });
  return py::tuple(flags);
}

py::object effects(const R& touch) {
  const auto& f = touch.fitted;
  return touch.knows_error
             ? py::dict(py::arg("offset") = f.offset, py::arg("drift") = f.drift, py::arg("lag") = touch.lag_ms(),
                        py::arg("curve") = f.curve, py::arg("tilt") = f.tilt, py::arg("shift") = touch.shift)
             : py::dict();
}

py::object plain(const py::object& value) {
  const bool is_nan = PyFloat_Check(value.ptr()) && std::isnan(PyFloat_AS_DOUBLE(value.ptr()));
  return is_nan ? py::none() : value;
}

struct Field {
  const char* name;
  py::object (*get)(const R&);
  const char* doc;
};

template <auto Member>
py::object get(const R& touch) {
  return py::cast(std::invoke(Member, touch));
}

const Field fields[] = {
    {"start", &get<&R::start>, "Reading with which it began, counted from 0."},
    {"start_s", &get<&R::start_s>, "Time of that reading, s; nan without times."},
    {"samples", &get<&R::samples>, "Number of samples used."},
    {"ratio", &get<&R::ratio>, "Capacitance ratio, hard / soft: the best that is known; see `revised`."},
    {"covariance", &get<&R::covariance>,
     "Unscaled covariance P of the ratio, 1/pF^2: a harder press gives a smaller one."},
    {"standard_error", &get<&R::standard_error>,
     "Standard deviation of the ratio, with what a misfit leaves open; nan if it is not known."},
    {"revised", &get<&R::revised>,
     R"(Whether the baseline after the release is known, and `ratio` corrected for its drift (with the flag "creep" or
"baseline": known, and not corrected).)"},
    {"first_ratio", &get<&R::first_ratio>, "The ratio that was known at the end of the touch."},
    {"first_standard_error", &get<&R::first_standard_error>, "Its standard deviation."},
    {"level_ratio", [](const R& touch) { return py::cast(touch.level.ratio); },
     R"(Ratio over the swept depth, the slope of a line with an intercept over rise, hold and (after the release) fall: a tilt
of the probe does not change it; nan in other scenes, or where the press shows no sweep.)"},
    {"level_standard_error", [](const R& touch) { return py::cast(touch.level.standard_error); },
     "Standard deviation of `level_ratio`."},
    {"contact_exponent", &get<&R::contact_exponent>,
     "Exponent of force against depth with which `level_ratio` was computed; 0: there is none."},
    {"age_s", &get<&R::age>,
     R"(Seconds from where the press had settled to the end of the touch, if it ends at an age; 0: it ends at its length.)"},
    {"ratio_before", [](const R& touch) { return py::cast(touch.before.ratio); },
     "With the flag \"changed\", where the change lasted: the ratio before it, and `ratio` is the one after it; else "
     "nan."},
    {"before_standard_error", [](const R& touch) { return py::cast(touch.before.standard_error); },
     "Standard deviation of `ratio_before`."},
    {"ratio_after", [](const R& touch) { return py::cast(touch.after.ratio); },
     R"(With the flag "changed", shortly before the end: the ratio after the change, from the last samples, and `ratio` is the
one before it; else nan.)"},
    {"after_standard_error", [](const R& touch) { return py::cast(touch.after.standard_error); },
     "Standard deviation of `ratio_after`."},
    {"offset_ratio", [](const R& touch) { return py::cast(touch.fitted.offset_ratio); },
     R"(Ratio of hard = ratio * soft + offset, where the flag "offset" is the only misfit and explains it; else nan.)"},
    {"offset_standard_error", [](const R& touch) { return py::cast(touch.fitted.offset_error); },
     "Standard deviation of `offset_ratio`."},
    {"effects", &effects,
     R"(Sizes of what the model leaves out, as a dict (empty in a scene without a fit): `offset`, the share of the mean
depth by which the soft bump is reached first; `drift` during the touch, share of the mean output; `lag` of the soft
channel, ms (nan without times); `curve`, share of the mean output; `tilt`, the ratio above the level ratio, share of it;
`shift` of the ratio by the revision, share.)"},
    {"alarm_share", &get<&R::alarm_share>, "Share of the samples with the alarm on."},
    {"saturated", &get<&R::saturated>, "Readings left out as saturated."},
    {"refused", &get<&R::refused>, "Readings that gave no sample: without a value, or impossible to align."},
    {"flags", &flags,
     R"(Warnings about the result; `palpate.advice` says what to do. "short" (shorter than `seconds` or `samples`),
"saturated", "refused" (more than three quarters of the readings gave no sample), "late" (a fifth of the pairs or more did
not come in time: the computer was too slow), "unsettled" (no standard error yet, in a scene that has one), "unexcited" (the samples hardly moved the initial ratio), "one-sided" (one channel did not change, or
fell: a ratio below 0.02 or above 50); the samples contradict hard = ratio * soft: "offset" (bumps not level), "drift" (of
a baseline or of the object), "lag" (of a channel, or wrong times), "curve" (a gauge or bump that is not linear); "tilt"
(the ratio differs from the level ratio); "changed" (the ratio changed during the touch: `ratio` is the one after it; or
shortly before the end: the one before); and, known after the release: "creep" (a channel recovers slowly), "baseline" (it
was measured in contact); "gap" (`Tracker.gap` ended the touch; or the baseline was measured after it, and no release has
shown yet that this was without contact).)"},
};

py::dict as_dict(const R& touch) {
  py::dict result, sizes;
  for (const Field& field : fields) {
    result[field.name] = plain(field.get(touch));
  }
  for (const auto& [name, size] : py::dict(result["effects"])) {
    sizes[name] = plain(py::reinterpret_borrow<py::object>(size));
  }
  result["effects"] = sizes;
  return result;
}

R untimed(R touch) {
  touch.start_s = touch.period_s = std::numeric_limits<double>::quiet_NaN();
  return touch;
}

// Every number of a touch, in order: to save it, and to restore it.
template <class Result, class Visit>
void visit_numbers(Result& r, Visit&& visit) {
  const auto all = [&](auto&... numbers) { (visit(numbers), ...); };
  all(r.start, r.samples, r.alarms, r.saturated, r.refused, r.ratio, r.covariance, r.standard_error, r.first_ratio,
      r.first_standard_error, r.full, r.shift, r.start_s, r.period_s, r.has_length, r.initial_covariance, r.knows_error,
      r.contact_exponent, r.age, r.gap, r.late, r.held);
  auto& f = r.fitted;
  all(f.offset, f.drift, f.lag, f.curve, f.tilt, f.open, f.open_drift, f.offset_ratio, f.offset_error, f.flags);
  for (auto* const level : {&r.level, &r.before, &r.after}) {
    all(level->ratio, level->standard_error);
  }
}

py::tuple pickled(const R& r) {
  py::list numbers;
  visit_numbers(r, [&](const auto& number) { numbers.append(number); });
  numbers.append(static_cast<int>(r.revision));
  return py::tuple(numbers);
}

R restored(const py::tuple& state) {
  R r{};
  std::size_t i = 0;
  visit_numbers(r, [&](auto& number) { number = state[i++].cast<std::decay_t<decltype(number)>>(); });
  const int kind = state[i].cast<int>();
  if (state.size() != i + 1 || kind < 0 || kind > static_cast<int>(palpate::Revision::baseline)) {
    throw py::value_error("Touch: got the state of another version, allowed: a state of this one");
  }
  r.revision = static_cast<palpate::Revision>(kind);
  return r;
}

R not_made(const py::args&, const py::kwargs&) {
  throw py::type_error("Touch: got a call, allowed: those that a Tracker, a Stream or palpate.touches returns");
}

bool equal(const R& left, const R& right) { return as_dict(left).equal(as_dict(right)); }

}  // namespace

void bind_touch(py::module_& module) {
  auto type = methods::define_class<R>(module, "Touch", "()", "The result of one touch.", &not_made);
  methods::define_display(type, "touch");
  type.def("as_dict", &as_dict, "as_dict(self, /)\n--\n\nAll fields as a dict of plain numbers; nan becomes None.")
      .def("_untimed", &untimed, "_untimed(self, /)\n--\n\n")
      .def_property_readonly("_held", [](const R& touch) { return touch.held; })
      .def("__eq__", &equal, py::is_operator(), "__eq__(self, other, /)\n--\n\n")
      .def(py::pickle(&pickled, &restored));
  for (const Field& field : fields) {
    type.def_property_readonly(field.name, field.get, field.doc);
  }
}
