// SPDX-License-Identifier: MIT
#pragma once

// What Python's estimators have in common: a core, its settings, and the counts that the core leaves to its caller.

#include <cstddef>
#include <limits>
#include <stdexcept>

#include "block.hpp"
#include "core_numbers.hpp"
#include "made.hpp"
#include "settings.hpp"
#include "trace_row.hpp"

template <class Settings_>
class Estimator : Made {
 public:
  using Made::operator new;
  using Made::operator delete;
  using Settings = Settings_;
  using Core = typename Settings::Core;
  using Real = typename Core::real_type;
  using Row = typename Settings::Row;

  explicit Estimator(const Settings& settings) : settings_(settings), core_(settings.core()) {}

  double update(double output, double regressor) {
    require_idle();
    count(core_.update(static_cast<Real>(output), static_cast<Real>(regressor)));
    return core_.ratio();
  }

  PyObject* process(py::handle output, py::handle regressor, py::handle out) {
    return block<Real>(output, regressor, out, once<&py::dtype::of<Real>>(),
                       [](Real& to, const Core& core, const palpate::Step<Real>&) { to = core.ratio(); });
  }

  PyObject* trace(py::handle output, py::handle regressor, py::handle out) {
    return block<Row>(output, regressor, out, once<&Row::dtype>(),
                      [](Row& to, const Core& core, const palpate::Step<Real>& step) { to.take(core, step); });
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
    for (const Real value : numbers_of(core_)) {
      values.append(static_cast<double>(value));
    }
    values.append(samples_ == 0 ? py::object(py::none()) : py::object(py::float_(innovation_)));
    values.append(samples_);
    values.append(rejected_);
    return py::tuple(values);
  }

  static Estimator restored(const Settings& settings, const py::tuple& state) {
    Estimator estimator(settings);
    std::vector<Real> numbers = numbers_of(estimator.core_);
    const std::size_t count = numbers.size();
    if (state.size() != count + 3) {
      refuse(state);
    }
    for (std::size_t i = 0; i < count; ++i) {
      numbers[i] = state[i].cast<Real>();
    }
    if (!set_numbers(estimator.core_, numbers.data())) {
      refuse(state);
    }
    const py::object innovation = state[count];
    estimator.innovation_ = innovation.is_none() ? estimator.innovation_ : innovation.cast<Real>();
    estimator.samples_ = state[count + 1].cast<std::size_t>();
    estimator.rejected_ = state[count + 2].cast<std::size_t>();
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
  double innovation() const {
    require_made();
    return innovation_;
  }
  std::size_t samples() const {
    require_made();
    return samples_;
  }
  std::size_t rejected() const {
    require_made();
    return rejected_;
  }

 private:
  // Every sample through a copy of the core, which becomes the state when the block is done: a reader in another thread
  // sees the state before the block or the state after it.
  template <class Item, class Observe>
  PyObject* block(py::handle output, py::handle regressor, py::handle out, const py::dtype& dtype, Observe observe) {
    require_idle();
    const Block<Real, Item> block(output, regressor, out, once<&py::dtype::of<Real>>(), dtype);
    require_idle();  // making arrays of the arguments may have run other Python code
    Estimator next = *this;
    busy_ = true;
    block.run([&](auto y, auto x, auto to, py::ssize_t size) {
      Core core = next.core_;
      Real innovation = next.innovation_;
      std::size_t rejected = 0;
      for (py::ssize_t i = 0; i < size; ++i) {
        const auto step = core.update(y[i], x[i]);
        if (PALPATE_UNLIKELY(!step.accepted)) {
          ++rejected;
        } else {
          innovation = step.innovation;
        }
        observe(to[i], core, step);
      }
      next.core_ = core;
      next.innovation_ = innovation;
      next.rejected_ += rejected;
      next.samples_ += static_cast<std::size_t>(size) - rejected;
    });
    *this = next;
    return py::object(block.result).release().ptr();
  }

  [[noreturn]] static void refuse(const py::tuple& state) {
    throw py::value_error("pickled state: got " + py::repr(state).cast<std::string>() +
                          ", allowed: finite numbers, an information > 0, a statistic >= 0");
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

  Settings settings_;
  Core core_;
  std::size_t samples_ = 0;
  std::size_t rejected_ = 0;
  Real innovation_ = std::numeric_limits<Real>::quiet_NaN();  // not beside the core's information: see RatioOf
  bool busy_ = false;
};
