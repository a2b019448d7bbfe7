// SPDX-License-Identifier: MIT
#pragma once

#include <cstring>
#include <palpate/tracker.hpp>

#include "bind.hpp"

/// A touch as Python sees it: with its time, and with what the scene promised.
struct Result {
  static void* operator new(std::size_t size) { return std::memset(::operator new(size), 0, size); }
  static void* operator new(std::size_t, void* place) { return place; }
  static void operator delete(void* memory) { ::operator delete(memory); }

  palpate::Touch<double> touch;
  double start_s;
  std::uint32_t wanted;  // samples, 0 for any number
  double initial_covariance;
  bool knows_error;

  double alarm_share() const { return touch.samples > 0 ? static_cast<double>(touch.alarms) / touch.samples : 0.0; }
  py::tuple flags() const;
  py::dict as_dict() const;
  py::list assignments() const;
  py::tuple state() const;
  static Result of(const py::tuple& state);
};
