// SPDX-License-Identifier: MIT
#include "touch.hpp"

#include <cmath>
#include <limits>
#include <string>

#include "constructors.hpp"
#include "methods.hpp"
#include "pickling.hpp"

py::tuple TouchResult::flags() const {
  py::list flags;
  visit_flags([&](const char* name) { flags.append(name); });
  return py::tuple(flags);
}

namespace {
py::object plain(double value) { return std::isnan(value) ? py::object(py::none()) : py::object(py::float_(value)); }
}  // namespace

py::dict TouchResult::effects() const {
  py::dict effects;
  if (knows_error) {
    effects["offset"] = fitted.offset;
    effects["drift"] = fitted.drift;
    effects["lag"] = lag_ms();
    effects["curve"] = fitted.curve;
    effects["shift"] = shift;
  }
  return effects;
}

py::dict TouchResult::as_dict() const {
  py::dict result;
  result["start"] = start;
  result["start_s"] = plain(start_s);
  result["samples"] = samples;
  result["ratio"] = plain(ratio);
  result["covariance"] = plain(covariance);
  result["standard_error"] = plain(standard_error);
  result["revised"] = revised();
  result["first_ratio"] = plain(first_ratio);
  result["first_standard_error"] = plain(first_standard_error);
  result["offset_ratio"] = plain(fitted.offset_ratio);
  result["offset_standard_error"] = plain(fitted.offset_error);
  py::dict sizes;
  for (const auto& [name, size] : effects()) {
    sizes[name] = plain(size.cast<double>());
  }
  result["effects"] = sizes;
  result["alarm_share"] = alarm_share();
  result["saturated"] = saturated;
  result["refused"] = refused;
  result["flags"] = flags();
  return result;
}

TouchResult TouchResult::untimed() const {
  TouchResult other = *this;
  other.start_s = other.period_s = std::numeric_limits<double>::quiet_NaN();
  return other;
}

namespace {

// Every number of a touch, in order: to save it, and to restore it.
template <class Result, class Visit>
void visit_numbers(Result& r, Visit&& visit) {
  const auto all = [&](auto&... numbers) { (visit(numbers), ...); };
  all(r.start, r.samples, r.alarms, r.saturated, r.refused, r.ratio, r.covariance, r.standard_error, r.first_ratio,
      r.first_standard_error, r.full, r.shift, r.start_s, r.period_s, r.has_length, r.initial_covariance, r.knows_error,
      r.gap);
  auto& f = r.fitted;
  all(f.offset, f.drift, f.lag, f.curve, f.open, f.open_drift, f.offset_ratio, f.offset_error, f.flags);
}

py::tuple state(py::handle self) {
  const auto& r = methods::reference<TouchResult>(self);
  py::list numbers;
  visit_numbers(r, [&](const auto& number) { numbers.append(number); });
  numbers.append(static_cast<int>(r.revision));
  return py::tuple(numbers);
}

TouchResult restored(py::handle, py::handle pickled) {
  return of_pickled(pickled, [](const py::tuple& s) -> TouchResult {
    TouchResult r{};
    std::size_t i = 0;
    visit_numbers(r, [&](auto& number) { number = s[i++].cast<std::decay_t<decltype(number)>>(); });
    const int kind = s[i].cast<int>();
    if (s.size() != i + 1 || kind < 0 || kind > static_cast<int>(palpate::Revision::baseline)) {
      throw py::value_error("Touch: got the state of another version, allowed: that of this one");
    }
    r.revision = static_cast<palpate::Revision>(kind);
    return r;
  });
}

TouchResult not_made(const methods::Given& given) {
  methods::refuse_others(given, "none");
  throw py::type_error("Touch: got a call, allowed: those that a Tracker, a Stream or palpate.touches returns");
}

}  // namespace

bool operator==(const TouchResult& left, const TouchResult& right) { return left.as_dict().equal(right.as_dict()); }

void bind_touch(py::module_& module) {
  using R = TouchResult;
  auto type = methods::define_class<&not_made>(module, "Touch", "()", "The result of one touch.");
  methods::define<&R::as_dict>(type, "as_dict($self)\n--\n\nAll fields as a dict of plain numbers; nan becomes None.");
  methods::define<&R::untimed>(type, "_untimed($self)\n--\n\n");
  display::define<display::Kind::touch>(type);
  define_pickling<&state, &restored>(type);
  methods::property<&R::start>(type, "start", "Reading with which it began, counted from 0.");
  methods::property<&R::start_s>(type, "start_s", "Time of that reading, s; nan without times.");
  methods::property<&R::samples>(type, "samples", "Number of samples used.");
  methods::property<&R::ratio>(type, "ratio", "Capacitance ratio, hard / soft: the best that is known; see `revised`.");
  methods::property<&R::covariance>(type, "covariance",
                                    "Unscaled covariance P of the ratio, 1/pF^2: a harder press gives a smaller one.");
  methods::property<&R::standard_error>(type, "standard_error",
                                        "Standard deviation of the ratio, with what a misfit leaves open; nan if it is "
                                        "not known.");
  methods::property<&R::revised>(type, "revised",
                                 "Whether the baseline after the release is known, and `ratio` corrected for its drift "
                                 "(with the flag \"creep\" or \"baseline\": known, and not corrected).");
  methods::property<&R::first_ratio>(type, "first_ratio", "The ratio that was known at the end of the touch.");
  methods::property<&R::first_standard_error>(type, "first_standard_error", "Its standard deviation.");
  methods::property<&R::offset_ratio>(
      type, "offset_ratio",
      "Ratio of hard = ratio * soft + offset, where the flag \"offset\" is the only misfit and explains it; else nan.");
  methods::property<&R::offset_error>(type, "offset_standard_error", "Standard deviation of `offset_ratio`.");
  methods::property<&R::effects>(
      type, "effects",
      "Sizes of what the model leaves out, as a dict (empty in a scene without a fit): `offset`, the share of the mean "
      "depth by which the soft bump is reached first; `drift` during the touch, share of the mean output; `lag` of the "
      "soft channel, ms (nan without times); `curve`, share of the mean output; `shift` of the ratio by the revision, "
      "share.");
  methods::property<&R::alarm_share>(type, "alarm_share", "Share of the samples with the alarm on.");
  methods::property<&R::saturated>(type, "saturated", "Readings left out as saturated.");
  methods::property<&R::refused>(type, "refused",
                                 "Readings that gave no sample: without a value, or impossible to align.");
  methods::property<&R::flags>(
      type, "flags",
      "Warnings about the result; `palpate.advice` says what to do. \"short\" (shorter than `seconds` or `samples`), "
      "\"saturated\", \"refused\" (more than three quarters of the readings gave no sample), \"unsettled\" (no "
      "standard "
      "error yet, in a scene that has one), \"unexcited\" (the samples hardly moved the initial ratio), "
      "\"one-sided\" (one channel did not change, or fell: a ratio below 0.02 or above 50); "
      "the samples "
      "contradict hard = ratio * soft: \"offset\" (bumps not level), \"drift\" (of a baseline or of the object), "
      "\"lag\" (of a channel, or wrong times), \"curve\" (a gauge or bump that is not linear); and, known after the "
      "release: \"creep\" (a channel recovers slowly), \"baseline\" (it was measured in contact); \"gap\" "
      "(`Tracker.gap` ended the "
      "touch; or the baseline was measured after it, and no release has shown yet that this was without contact).");
}
