// SPDX-License-Identifier: MIT
#include "settings.hpp"

#include <algorithm>
#include <cmath>

namespace {

bool is_samples(const char* name) { return std::strcmp(name, "samples") == 0; }
bool is_length(const char* name) { return is_samples(name) || std::strcmp(name, "seconds") == 0; }
bool is_size(const char* name) { return std::strcmp(name, "size") == 0; }
bool is_switch(const char* name) {
  return std::strcmp(name, "host_stamps") == 0 || std::strcmp(name, "intercept") == 0;
}

double real_of(const char* name, py::handle value) {
  if (value.is_none() && is_length(name)) {
    return 0;
  }
  const double real = methods::to_real(value, name);
  if (is_size(name)) {
    require(real >= 1 && real <= 8 && real == std::floor(real), name, real, "a whole number, 1 to 8");
  } else if (is_switch(name)) {
    require(real == 0 || real == 1, name, real, "True or False");
  } else if (is_samples(name)) {
    require(real >= 1 && real <= 4e9 && real == std::floor(real), name, real, "a whole number >= 1, or None");
  } else if (is_length(name)) {
    require(real > 0 && real <= 9e9, name, real, "0 < seconds <= 9e9, or None");
  }
  return real;
}

}  // namespace

const Settings::Setting* Settings::find(const std::string& name) const noexcept {
  return std::find_if(begin(), end(), [&](const Setting& s) { return name == s.name; });
}

py::dict Settings::dict() const {
  py::dict result;
  for (const auto& [name, value] : *this) {
    if (is_length(name) && value == 0) {
      result[name] = py::none();
    } else if (is_switch(name)) {
      result[name] = py::bool_(value != 0);
    } else if (is_samples(name) || is_size(name)) {
      result[name] = py::int_(static_cast<std::uint32_t>(value));
    } else {
      result[name] = py::float_(value);
    }
  }
  return result;
}

std::string Settings::text() const {
  std::string text;
  for (const auto& [name, value] : *this) {
    text += (text.empty() ? "" : ", ") + std::string(name) + "=" + number(value);
  }
  return text;
}

Settings Settings::with(const char* owner, const py::dict& given) const {
  Settings all = *this;
  for (const auto& [key, value] : given) {
    const auto name = key.cast<std::string>();
    const Setting* const setting = find(name);
    if (setting == end()) {
      throw py::type_error(std::string(owner) + ": " +
                           unlike(py::str(name), py::list(dict()), "an unexpected keyword"));
    }
    all.set(setting->name, real_of(setting->name, value));
  }
  all.choose_length(given);
  return all;
}

// A length in samples or in seconds: the one that is given replaces the scene's own.
void Settings::choose_length(const py::dict& given) {
  const bool samples = given.contains("samples"), seconds = given.contains("seconds");
  if (samples && seconds) {
    require((*this)["samples"] == 0 || (*this)["seconds"] == 0, "seconds", (*this)["seconds"],
            "None beside samples (" + number((*this)["samples"]) + "): a touch has one length");
  } else if (samples && find("seconds") != end()) {
    set("seconds", 0);
  } else if (seconds) {
    set("samples", 0);
  }
}
