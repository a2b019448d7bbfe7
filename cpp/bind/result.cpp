// SPDX-License-Identifier: MIT
#include "result.hpp"

#include <cmath>
#include <string>

py::tuple Result::flags() const {
  py::list flags;
  const auto readings = static_cast<double>(touch.samples) + touch.refused + touch.saturated;
  if (touch.samples < wanted) flags.append("short");
  if (touch.saturated > 0) flags.append("saturated");
  if (touch.refused > 0.25 * readings) flags.append("refused");
  if (knows_error && std::isnan(touch.standard_error)) flags.append("unsettled");
  if (!(touch.covariance <= 0.1 * initial_covariance)) flags.append("unexcited");
  return py::tuple(flags);
}

py::dict Result::as_dict() const {
  const auto plain = [](double value) {
    return std::isnan(value) ? py::object(py::none()) : py::object(py::float_(value));
  };
  py::dict result;
  result["start"] = touch.start;
  result["start_s"] = plain(start_s);
  result["samples"] = touch.samples;
  result["ratio"] = plain(touch.ratio);
  result["covariance"] = plain(touch.covariance);
  result["standard_error"] = plain(touch.standard_error);
  result["alarm_share"] = alarm_share();
  result["saturated"] = touch.saturated;
  result["refused"] = touch.refused;
  result["flags"] = flags();
  return result;
}

py::list Result::assignments() const {
  py::list result;
  for (const auto& item : as_dict()) {
    result.append(py::str("{}={!r}").format(item.first, item.second));
  }
  return result;
}

py::tuple Result::state() const {
  return py::make_tuple(touch.start, touch.samples, touch.alarms, touch.saturated, touch.refused, touch.ratio,
                        touch.covariance, touch.standard_error, start_s, wanted, initial_covariance, knows_error);
}

Result Result::of(const py::tuple& s) {
  const auto count = [&](std::size_t i) { return s[i].cast<std::uint32_t>(); };
  const auto real = [&](std::size_t i) { return s[i].cast<double>(); };
  return {{{s[0].cast<std::size_t>(), count(1), count(2), count(3), count(4)}, real(5), real(6), real(7)},
          real(8),
          count(9),
          real(10),
          s[11].cast<bool>()};
}
