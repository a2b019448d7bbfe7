// SPDX-License-Identifier: MIT
#include "touch.hpp"

#include <cmath>
#include <limits>
#include <string>

#include "constructors.hpp"
#include "pickling.hpp"

py::tuple TouchResult::flags() const {
  py::list flags;
  const auto readings = static_cast<double>(samples) + refused + saturated;
  if (samples < wanted) flags.append("short");
  if (saturated > 0) flags.append("saturated");
  if (refused > 0.25 * readings) flags.append("refused");
  if (knows_error && std::isnan(standard_error)) flags.append("unsettled");
  if (!(covariance <= 0.1 * initial_covariance)) flags.append("unexcited");
  return py::tuple(flags);
}

py::dict TouchResult::as_dict() const {
  const auto plain = [](double value) {
    return std::isnan(value) ? py::object(py::none()) : py::object(py::float_(value));
  };
  py::dict result;
  result["start"] = start;
  result["start_s"] = plain(start_s);
  result["samples"] = samples;
  result["ratio"] = plain(ratio);
  result["covariance"] = plain(covariance);
  result["standard_error"] = plain(standard_error);
  result["alarm_share"] = alarm_share();
  result["saturated"] = saturated;
  result["refused"] = refused;
  result["flags"] = flags();
  return result;
}

std::string TouchResult::repr() const {
  py::list assignments;
  for (const auto& [name, value] : as_dict()) {
    assignments.append(py::str("{}={!r}").format(name, value));
  }
  return "Touch(" + py::str(", ").attr("join")(assignments).cast<std::string>() + ")";
}

TouchResult TouchResult::untimed() const {
  TouchResult other = *this;
  other.start_s = std::numeric_limits<double>::quiet_NaN();
  return other;
}

namespace {

py::tuple state(py::handle self) {
  const auto& r = methods::reference<TouchResult>(self);
  return py::make_tuple(r.start, r.samples, r.alarms, r.saturated, r.refused, r.ratio, r.covariance, r.standard_error,
                        r.start_s, r.wanted, r.initial_covariance, r.knows_error);
}

TouchResult restored(py::handle, py::handle pickled) {
  return of_pickled(pickled, [](const py::tuple& s) -> TouchResult {
    const auto count = [&](std::size_t i) { return s[i].cast<std::uint32_t>(); };
    const auto real = [&](std::size_t i) { return s[i].cast<double>(); };
    return {{{s[0].cast<std::size_t>(), count(1), count(2), count(3), count(4)}, real(5), real(6), real(7)},
            real(8),
            count(9),
            real(10),
            s[11].cast<bool>()};
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
  methods::define<&R::as_dict>(type, "as_dict($self)\n--\n\nEvery field, as plain numbers; nan as None.");
  methods::define<&R::untimed>(type, "_untimed($self)\n--\n\n");
  methods::define<&R::repr>(type, "__repr__($self, /)\n--\n\n");
  define_pickling<&state, &restored>(type);
  methods::property<&R::start>(type, "start", "Reading with which it began, counted from 0.");
  methods::property<&R::start_s>(type, "start_s", "Time of that reading, s; nan without times.");
  methods::property<&R::samples>(type, "samples", "Samples that the estimate rests on.");
  methods::property<&R::ratio>(type, "ratio", "Capacitance ratio, hard / soft, at the end of the touch.");
  methods::property<&R::covariance>(type, "covariance",
                                    "Unscaled covariance P of the ratio, 1/pF^2: the smaller, the harder was pressed.");
  methods::property<&R::standard_error>(type, "standard_error",
                                        "Standard deviation of the ratio; nan where it is not known.");
  methods::property<&R::alarm_share>(type, "alarm_share", "Share of the samples with the alarm on.");
  methods::property<&R::saturated>(type, "saturated", "Readings left out as saturated.");
  methods::property<&R::refused>(type, "refused",
                                 "Readings that gave no sample: without a value, or not to be aligned.");
  methods::property<&R::flags>(
      type, "flags",
      "What stands against the result: \"short\" (fewer samples than asked for), \"saturated\", \"refused\" (more "
      "than a quarter of the readings gave no sample), \"unsettled\" (no standard error in a scene that should "
      "know it), \"unexcited\" (the samples hardly moved the initial ratio).");
}
