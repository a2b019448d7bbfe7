// SPDX-License-Identifier: MIT
#pragma once

// The scenes behind one Python class: their settings, and the conversion of times and results.

#include <cmath>
#include <cstring>
#include <memory>
#include <palpate/touch.hpp>
#include <string>
#include <vector>

#include "result.hpp"
#include "settings.hpp"
#include "trace_row.hpp"

class AnyTracker {
 public:
  virtual ~AnyTracker() = default;
  virtual py::object feed(double t_hard, double t_soft, double hard, double soft) = 0;
  virtual py::array process(const py::object& t_hard, const py::object& t_soft, const py::object& hard,
                            const py::object& soft) = 0;
  virtual py::object finish() = 0;
  virtual void tare() = 0;
  virtual std::string scene() const = 0;
  virtual py::dict settings() const = 0;
  virtual py::str state() const = 0;
  virtual double ratio() const = 0;
  virtual double standard_error() const = 0;
  virtual std::uint64_t readings() const = 0;
  virtual std::vector<Result> touches() const = 0;
};

std::unique_ptr<AnyTracker> make_tracker(const std::string& scene, const py::dict& settings);

/// What Python holds. As with Estimator, an object whose __init__ was not called is zeros, and says so.
class PyTracker {
 public:
  static void* operator new(std::size_t size) { return std::memset(::operator new(size), 0, size); }
  static void* operator new(std::size_t, void* place) { return place; }
  static void operator delete(void* memory) { ::operator delete(memory); }

  PyTracker(const std::string& scene, const py::dict& settings) : tracker_(make_tracker(scene, settings)) {}

  AnyTracker* operator->() const {
    if (!tracker_) {
      throw py::type_error("__init__ of this tracker has not been called");
    }
    return tracker_.get();
  }

 private:
  std::unique_ptr<AnyTracker> tracker_;
};
