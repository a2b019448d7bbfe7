// SPDX-License-Identifier: MIT
#pragma once

// The scenes behind one Python class: their settings, and the conversion of times and results.

#include <cmath>
#include <memory>
#include <palpate/tracker.hpp>
#include <string>
#include <vector>

#include "made.hpp"
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

/// What Python holds.
class PyTracker : Made {
 public:
  using Made::operator new;
  using Made::operator delete;

  PyTracker(const std::string& scene, const py::dict& settings) : tracker_(make_tracker(scene, settings)) {}

  AnyTracker* operator->() const {
    require_made();
    return tracker_.get();
  }

 private:
  std::unique_ptr<AnyTracker> tracker_;
};
