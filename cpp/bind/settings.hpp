// SPDX-License-Identifier: MIT
#pragma once

// The estimators' parameters as Python gives them: named doubles, checked once, kept as given for repr, == and pickle.

#include <array>
#include <limits>
#include <palpate/estimator/rls.hpp>
#include <string>

#include "bind.hpp"

template <class Settings>
struct Field {
  const char* name;
  double Settings::* value;
};

inline std::string number(double value) { return py::repr(py::float_(value)).cast<std::string>(); }

inline void require(bool ok, const char* name, double value, const std::string& allowed) {
  if (!ok) {
    throw py::value_error(std::string(name) + ": got " + number(value) + ", allowed: " + allowed);
  }
}

/// Covariance and information are kept to the normal numbers of Real, where arithmetic is exact to an eps and fast.
template <class Real, class Settings>
void check_prior(const Settings& settings) {
  constexpr double smallest = std::numeric_limits<Real>::min();
  const double largest = 1 / smallest;
  require(palpate::is_finite(static_cast<Real>(settings.initial_ratio)), "initial_ratio", settings.initial_ratio,
          "a finite number");
  require(settings.max_covariance >= smallest && settings.max_covariance <= largest, "max_covariance",
          settings.max_covariance, number(smallest) + " <= max_covariance <= " + number(largest));
  require(settings.initial_covariance >= smallest && settings.initial_covariance <= settings.max_covariance,
          "initial_covariance", settings.initial_covariance,
          number(smallest) + " <= initial_covariance <= max_covariance (" + number(settings.max_covariance) + ")");
}

inline bool is_forgetting(double value) { return value > 0 && value <= 1; }

template <class Settings>
void check_adaptive(const Settings& s) {
  require(is_forgetting(s.steady), "steady", s.steady, "0 < steady <= 1");
  require(is_forgetting(s.alarmed) && s.alarmed <= s.steady, "alarmed", s.alarmed,
          "0 < alarmed <= steady (" + number(s.steady) + ")");
  require(s.drift >= 0 && palpate::is_finite(static_cast<float>(s.drift)), "drift", s.drift, "0 <= drift, finite");
  require(s.threshold >= 0, "threshold", s.threshold, "0 <= threshold");
}

template <class Settings>
void check_handover(const Settings& s) {
  require(is_forgetting(s.steady), "steady", s.steady, "0 < steady <= 1");
  require(s.clip > 0 && s.clip <= 100, "clip", s.clip, "0 < clip <= 100");
  require(s.drift >= 0 && s.drift < s.clip, "drift", s.drift, "0 <= drift < clip (" + number(s.clip) + ")");
  require(s.threshold > 0, "threshold", s.threshold, "0 < threshold");
  require(is_forgetting(s.smoothing), "smoothing", s.smoothing, "0 < smoothing <= 1");
}

template <class Settings>
py::dict to_dict(const Settings& settings) {
  py::dict result;
  for (const auto& field : Settings::fields()) {
    result[field.name] = settings.*field.value;
  }
  return result;
}

template <class Settings>
Settings from_dict(const py::dict& values) {
  Settings settings;
  for (const auto& field : Settings::fields()) {
    settings.*field.value = values[field.name].template cast<double>();
  }
  return settings;
}

template <class Settings>
bool equal(const Settings& left, const Settings& right) {
  for (const auto& field : Settings::fields()) {
    if (left.*field.value != right.*field.value) {
      return false;
    }
  }
  return true;
}
