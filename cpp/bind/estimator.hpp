// SPDX-License-Identifier: MIT
#pragma once

// What Python's estimators have in common: a core, its settings, and the counts that the core leaves to its caller.

#include <cstddef>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "arrays.hpp"
#include "settings.hpp"
#include "trace_row.hpp"

template <class Settings_>
class Estimator {
 public:
  using Settings = Settings_;
  using Core = typename Settings::Core;
  using Real = typename Core::real_type;
  using Row = typename Settings::Row;

  // pybind11 allocates an object whose __init__ was not called when one of its methods is: as zeros, it says so.
  static void* operator new(std::size_t size) { return std::memset(::operator new(size), 0, size); }
  static void* operator new(std::size_t, void* place) { return place; }
  static void operator delete(void* memory) { ::operator delete(memory); }

  explicit Estimator(const Settings& settings) : settings_(settings), core_(settings.core()) {}

  double update(double output, double regressor) {
    require_idle();
    count(core_.update(static_cast<Real>(output), static_cast<Real>(regressor)));
    return core_.ratio();
  }

  py::array process(const py::object& output, const py::object& regressor, const py::object& out) {
    return block<Real>(output, regressor, out, py::dtype::of<Real>(),
                       [](const Core& core, const palpate::Step<Real>&) { return core.ratio(); });
  }

  py::array trace(const py::object& output, const py::object& regressor, const py::object& out) {
    return block<Row>(output, regressor, out, Row::dtype(),
                      [](const Core& core, const palpate::Step<Real>& step) { return Row::of(core, step); });
  }

  void reset() {
    require_idle();
    *this = Estimator(settings_);
  }

  bool operator==(const Estimator& other) const {
    return equal(settings_, other.settings_) && state().equal(other.state());
  }

  /// Every number of the core, then the innovation (None before the first sample) and the counts.
  py::tuple state() const {
    require_made();
    py::list values;
    Core core = core_;
    core.visit_state([&](const Real& value) { values.append(static_cast<double>(value)); });
    values.append(samples_ == 0 ? py::object(py::none()) : py::object(py::float_(innovation_)));
    values.append(samples_);
    values.append(rejected_);
    return py::tuple(values);
  }

  static Estimator restored(const Settings& settings, const py::tuple& state) {
    Estimator estimator(settings);
    std::size_t position = 0;
    bool ok = true;
    estimator.core_.visit_state([&](Real& value) {
      value = state[position++].cast<Real>();
      ok = ok && palpate::is_finite(value);
    });
    if (!ok || !(estimator.core_.information() > 0) || !(estimator.core_.statistic() >= 0)) {
      throw py::value_error("pickled state: got " + py::repr(state).cast<std::string>() +
                            ", allowed: finite numbers, an information > 0, a statistic >= 0");
    }
    const py::object innovation = state[position];
    estimator.innovation_ = innovation.is_none() ? estimator.innovation_ : innovation.cast<Real>();
    estimator.samples_ = state[position + 1].cast<std::size_t>();
    estimator.rejected_ = state[position + 2].cast<std::size_t>();
    return estimator;
  }

  const Settings& settings() const {
    require_made();
    return settings_;
  }
  const Core& core() const {
    require_made();
    return core_;
  }
  double innovation() const { return innovation_; }
  std::size_t samples() const { return samples_; }
  std::size_t rejected() const { return rejected_; }

 private:
  // Every sample through a copy of the core, which becomes the state when the block is done: a reader in another thread
  // sees the state before the block or the state after it.
  template <class Item, class Observe>
  py::array block(const py::object& output, const py::object& regressor, const py::object& out, const py::dtype& dtype,
                  Observe observe) {
    require_idle();
    const auto checked = samples_of<Real>(output, "output");
    const py::ssize_t size = checked.shape(0);
    py::array result = output_array(out, dtype, size);
    const auto outputs = apart_from(checked, result);
    const auto regressors = apart_from(samples_of<Real>(regressor, "regressor", size), result);
    const auto y = outputs.template unchecked<1>();
    const auto x = regressors.template unchecked<1>();
    auto* const destination = static_cast<char*>(result.mutable_data());
    const py::ssize_t stride = result.strides(0);
    Estimator next = *this;
    busy_ = true;
    run_block(size, [&] {
      Core core = next.core_;
      for (py::ssize_t i = 0; i < size; ++i) {
        const auto step = core.update(y(i), x(i));
        next.count(step);
        *reinterpret_cast<Item*>(destination + i * stride) = observe(core, step);
      }
      next.core_ = core;
    });
    *this = next;
    return result;
  }

  void count(const palpate::Step<Real>& step) {
    if (step.accepted) {
      innovation_ = step.innovation;
      ++samples_;
    } else {
      ++rejected_;
    }
  }

  void require_idle() const {
    require_made();
    if (busy_) {
      throw std::runtime_error("this estimator is processing a block in another thread: give each thread its own");
    }
  }

  void require_made() const {
    if (!made_) {
      throw py::type_error("__init__ of this estimator has not been called");
    }
  }

  Settings settings_;
  Core core_;
  bool made_ = true;
  Real innovation_ = std::numeric_limits<Real>::quiet_NaN();
  std::size_t samples_ = 0;
  std::size_t rejected_ = 0;
  bool busy_ = false;
};
