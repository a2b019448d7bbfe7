// SPDX-License-Identifier: MIT
#pragma once

// What Python's estimators have in common: a core, its settings, and the counts that the core leaves to its caller.

#include <cstddef>
#include <limits>
#include <stdexcept>

#include "arrays.hpp"
#include "settings.hpp"

/// One row of trace(). The padding is a member, so that equal traces have equal bytes.
template <class Real>
struct TraceRow {
  Real ratio, covariance, innovation, statistic;
  bool alarm;
  unsigned char padding[sizeof(Real) - 1];

  static py::dtype dtype() {
    const py::object real = py::dtype::of<Real>();
    py::list names, formats, offsets;
    const auto add = [&](const char* name, const py::object& format, std::size_t offset) {
      names.append(name), formats.append(format), offsets.append(offset);
    };
    add("ratio", real, offsetof(TraceRow, ratio));
    add("covariance", real, offsetof(TraceRow, covariance));
    add("innovation", real, offsetof(TraceRow, innovation));
    add("statistic", real, offsetof(TraceRow, statistic));
    add("alarm", py::dtype::of<bool>(), offsetof(TraceRow, alarm));
    return py::dtype(names, formats, offsets, sizeof(TraceRow));
  }
};

template <class Settings_>
class Estimator {
 public:
  using Settings = Settings_;
  using Core = typename Settings::Core;
  using Real = typename Core::real_type;
  using Row = TraceRow<Real>;

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
    return block<Row>(output, regressor, out, Row::dtype(), [](const Core& core, const palpate::Step<Real>& step) {
      const Real innovation = step.accepted ? step.innovation : std::numeric_limits<Real>::quiet_NaN();
      return Row{core.ratio(), core.covariance(), innovation, core.detector().statistic, core.alarm(), {}};
    });
  }

  void reset() {
    require_idle();
    *this = Estimator(settings_);
  }

  bool operator==(const Estimator& other) const {
    return equal(settings_, other.settings_) && state().equal(other.state());
  }

  py::tuple state() const {
    return py::make_tuple(core_.ratio(), core_.information(), core_.detector().statistic,
                          samples_ == 0 ? py::object(py::none()) : py::object(py::float_(innovation_)), samples_,
                          rejected_);
  }

  static Estimator restored(const Settings& settings, const py::tuple& state) {
    Estimator estimator(settings);
    const auto ratio = state[0].cast<Real>();
    const auto information = state[1].cast<Real>();
    const auto statistic = state[2].cast<Real>();
    if (!palpate::is_finite(ratio) || !palpate::is_finite(statistic) || !palpate::is_finite(information) ||
        information <= 0 || statistic < 0) {
      throw py::value_error("pickled state: got " + py::repr(state).cast<std::string>() +
                            ", allowed: a finite ratio, a finite information > 0, a finite statistic >= 0");
    }
    auto detector = estimator.core_.detector();
    if constexpr (!std::is_empty_v<decltype(detector)>) {
      detector.statistic = statistic;
    }
    estimator.core_.restore(ratio, information, detector);
    estimator.innovation_ = state[3].is_none() ? estimator.innovation_ : state[3].cast<Real>();
    estimator.samples_ = state[4].cast<std::size_t>();
    estimator.rejected_ = state[5].cast<std::size_t>();
    return estimator;
  }

  const Settings& settings() const { return settings_; }
  const Core& core() const { return core_; }
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
    if (busy_) {
      throw std::runtime_error("this estimator is processing a block in another thread: give each thread its own");
    }
  }

  Settings settings_;
  Core core_;
  Real innovation_ = std::numeric_limits<Real>::quiet_NaN();
  std::size_t samples_ = 0;
  std::size_t rejected_ = 0;
  bool busy_ = false;
};
