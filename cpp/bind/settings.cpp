// SPDX-License-Identifier: MIT
#include "settings.hpp"

#include <cmath>
#include <string_view>

namespace {

bool is_samples(std::string_view name) { return name == "samples"; }
bool is_length(std::string_view name) { return is_samples(name) || name == "seconds"; }
bool is_size(std::string_view name) { return name == "size"; }
bool is_switch(std::string_view name) { return name == "host_stamps" || name == "intercept" || name == "falling"; }

double checked(const char* name, py::handle value) {
  if (value.is_none() && is_length(name)) {
    return 0;
  }
  const double real = to_real(value, name);
  const bool is_whole = real >= 1 && real == std::floor(real);
  if (is_size(name)) {
    require(is_whole && real <= 8, name, real, "a whole number, 1 to 8");
  } else if (is_switch(name)) {
    require(real == 0 || real == 1, name, real, "True or False");
  } else if (is_samples(name)) {
    require(is_whole && real <= 4e9, name, real, "a whole number >= 1, or None");
  } else if (is_length(name)) {
    require(real > 0 && real <= 9e9, name, real, "0 < seconds <= 9e9, or None");
  }
  return real;
}

/// "measured", "zero", or a tuple of two or four numbers.
py::object checked_baseline(const py::object& value) {
  constexpr auto allowed = "'measured', 'zero', or the values of hard and soft, pF, as (6.9, 4.6)";
  if (value.equal(py::str("measured")) || value.equal(py::str("zero"))) {
    return value;
  }
  const bool is_list = py::isinstance<py::tuple>(value) || py::isinstance<py::list>(value);
  if (!is_list || (py::len(value) != 2 && py::len(value) != 4)) {
    refuse<value_error>("baseline", shown(value), allowed);
  }
  py::list numbers;
  for (const py::handle each : value) {
    const double real = to_real(each, "baseline");
    if (!std::isfinite(real) || (numbers.size() >= 2 && real < 0)) {
      refuse<value_error>("baseline", shown(value), allowed);
    }
    numbers.append(real);
  }
  return py::tuple(numbers);
}

}  // namespace

std::optional<std::array<double, 4>> Settings::baseline() const {
  const py::object value = all_["baseline"];
  if (value.equal(py::str("measured"))) {
    return std::nullopt;
  }
  std::array<double, 4> given{0, 0, 0, 0};
  if (py::isinstance<py::tuple>(value)) {
    std::size_t i = 0;
    for (const py::handle each : value) {
      given[i++] = each.cast<double>();
    }
  }
  return given;
}

void Settings::add(const char* name, double value) {
  if (is_length(name) && value == 0) {
    all_[name] = py::none();
  } else if (is_switch(name)) {
    all_[name] = py::bool_(value != 0);
  } else if (is_samples(name) || is_size(name)) {
    all_[name] = py::int_(static_cast<std::uint32_t>(value));
  } else {
    all_[name] = py::float_(value);
  }
}

std::string Settings::text() const {
  std::string text;
  for (const auto& [name, value] : all_) {
    text += (text.empty() ? "" : ", ") + text_of(name) + "=" + text_of(py::repr(value));
  }
  return text;
}

Settings Settings::with(const char* owner, const py::dict& given) const {
  Settings all;
  all.add_all(*this);
  for (const auto& [key, value] : given) {
    const auto name = text_of(key);
    if (!all_.contains(name)) {
      throw type_error(std::string(owner) + ": " + unlike(py::str(name), py::list(all_), "an unexpected keyword"));
    }
    if (name == "baseline") {
      all.all_[name.c_str()] = checked_baseline(py::reinterpret_borrow<py::object>(value));
    } else {
      all.add(name.c_str(), checked(name.c_str(), value));
    }
  }
  // A length in samples or in seconds: the one that is given replaces the scene's own.
  const bool samples = given.contains("samples"), seconds = given.contains("seconds");
  if (samples && seconds) {
    require(all["samples"] == 0 || all["seconds"] == 0, "seconds", all["seconds"],
            "None beside samples (" + number(all["samples"]) + "): a touch has one length");
  } else if (samples || seconds) {
    all.add(samples ? "seconds" : "samples", 0);
  }
  return all;
}
