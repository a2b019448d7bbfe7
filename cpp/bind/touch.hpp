// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/tracker.hpp>
#include <string>

#include "module.hpp"

/// A touch as Python sees it: with its time, and with what the scene promised.
struct TouchResult : palpate::Touch<double> {
  double start_s;
  std::uint32_t wanted;  // samples, 0 for any number
  double initial_covariance;
  bool knows_error;

  double alarm_share() const { return samples > 0 ? static_cast<double>(alarms) / samples : 0.0; }
  py::tuple flags() const;
  py::dict as_dict() const;
  std::string repr() const;
  TouchResult untimed() const;
};

bool operator==(const TouchResult& left, const TouchResult& right);
