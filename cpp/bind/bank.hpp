// SPDX-License-Identifier: MIT
#pragma once

// What Python's banks have in common: the states of many estimators with the same settings, and blocks of samples.

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "bank_loops.hpp"
#include "made.hpp"
#include "settings.hpp"
#include "tables.hpp"

/// States of Rls or AdaptiveRls, a structure of arrays.
template <class Settings>
class LaneStates {
 public:
  using Real = typename Settings::Core::real_type;

  LaneStates(const Settings& settings, std::size_t streams)
      : task_(settings.task()), ratio_(streams), information_(streams), statistic_(streams), rejected_(streams) {
    const auto core = settings.core();
    std::fill(ratio_.begin(), ratio_.end(), core.ratio());
    std::fill(information_.begin(), information_.end(), core.information());
  }

  void process(const Real* output, const Real* regressor, Real* ratios, std::size_t frames) {
    BankTask<Real> task = task_;
    task.ratio = ratio_.data();
    task.information = information_.data();
    task.statistic = statistic_.data();
    task.rejected = rejected_.data();
    task.output = output;
    task.regressor = regressor;
    task.ratios = ratios;
    task.streams = size();
    task.frames = frames;
    Settings::loop(bank_loops())(task);
  }

  std::size_t size() const { return ratio_.size(); }
  Real ratio(std::size_t i) const { return ratio_[i]; }
  Real covariance(std::size_t i) const { return Real(1) / information_[i]; }
  Real statistic(std::size_t i) const { return statistic_[i]; }
  bool alarm(std::size_t i) const { return Settings::has_detector && statistic_[i] > task_.threshold; }
  std::uint64_t rejected(std::size_t i) const { return rejected_[i]; }

  std::size_t numbers() const { return 3; }
  template <class Visit>
  void visit(std::size_t i, Visit&& visit) {
    visit(ratio_[i]);
    visit(information_[i]);
    visit(statistic_[i]);
  }
  void set_rejected(std::size_t i, std::uint64_t count) { rejected_[i] = count; }

 private:
  BankTask<Real> task_;
  std::vector<Real> ratio_, information_, statistic_;
  std::vector<std::uint64_t> rejected_;
};

/// Cores one beside the other, for estimators whose steps differ from stream to stream.
template <class Settings>
class CoreStates {
 public:
  using Core = typename Settings::Core;
  using Real = typename Core::real_type;

  CoreStates(const Settings& settings, std::size_t streams) : cores_(streams, settings.core()), rejected_(streams) {}

  void process(const Real* output, const Real* regressor, Real* ratios, std::size_t frames) {
    for (std::size_t k = 0; k < frames; ++k) {
      for (std::size_t i = 0; i < size(); ++i) {
        const std::size_t at = k * size() + i;
        rejected_[i] += !cores_[i].update(output[at], regressor[at]).accepted;
        ratios[at] = cores_[i].ratio();
      }
    }
  }

  std::size_t size() const { return cores_.size(); }
  Real ratio(std::size_t i) const { return cores_[i].ratio(); }
  Real covariance(std::size_t i) const { return cores_[i].covariance(); }
  Real statistic(std::size_t i) const { return cores_[i].statistic(); }
  bool alarm(std::size_t i) const { return cores_[i].alarm(); }
  std::uint64_t rejected(std::size_t i) const { return rejected_[i]; }

  std::size_t numbers() const {
    std::size_t count = 0;
    Core(cores_[0]).visit_state([&](const Real&) { ++count; });
    return count;
  }
  template <class Visit>
  void visit(std::size_t i, Visit&& visit) {
    cores_[i].visit_state(visit);
  }
  void set_rejected(std::size_t i, std::uint64_t count) { rejected_[i] = count; }

 private:
  std::vector<Core> cores_;
  std::vector<std::uint64_t> rejected_;
};

template <class Settings_, class States>
class PyBank : Made {
 public:
  using Settings = Settings_;
  using Real = typename States::Real;
  using Made::operator new;
  using Made::operator delete;

  PyBank(const Settings& settings, py::ssize_t streams) : settings_(settings), states_(settings, checked(streams)) {}

  /// dimensions 1: one sample of each stream; 2: a block of them.
  py::array take(const py::object& output, const py::object& regressor, const py::object& out, int dimensions) {
    require_idle();
    const auto outputs = table_of<Real>(output, "output", dimensions, streams(), -1);
    const py::ssize_t frames = dimensions == 1 ? 1 : outputs.shape(0);
    const auto regressors = table_of<Real>(regressor, "regressor", dimensions, streams(), frames);
    const py::array result = table_out(out, outputs, py::dtype::of<Real>());
    const auto y = table_apart(outputs, result), x = table_apart(regressors, result);
    require_idle();  // making arrays of the arguments may have run other Python code
    auto* const ratios = static_cast<Real*>(const_cast<void*>(result.data()));
    busy_ = true;
    run_block(outputs.size(), [&] { states_.process(y.data(), x.data(), ratios, static_cast<std::size_t>(frames)); });
    busy_ = false;
    samples_ += static_cast<std::size_t>(frames);
    return result;
  }

  void reset() {
    require_idle();
    *this = PyBank(settings_, streams());
  }

  /// One number of each stream.
  template <class Item, class Get>
  py::array_t<Item> each(Get get) const {
    require_idle();
    py::array_t<Item> result(streams());
    auto values = result.template mutable_unchecked<1>();
    for (py::ssize_t i = 0; i < streams(); ++i) {
      values(i) = static_cast<Item>(get(states_, static_cast<std::size_t>(i)));
    }
    return result;
  }

  /// (settings, samples, numbers of the states, rejected): to pickle, to copy and to compare.
  py::tuple state() const {
    require_idle();
    States states = states_;
    py::array_t<double> numbers({streams(), static_cast<py::ssize_t>(states.numbers())});
    double* place = numbers.mutable_data();
    for (std::size_t i = 0; i < states.size(); ++i) {
      states.visit(i, [&](const Real& value) { *place++ = static_cast<double>(value); });
    }
    const auto rejected = each<std::uint64_t>([](const States& s, std::size_t i) { return s.rejected(i); });
    return py::make_tuple(to_dict(settings_), samples_, numbers, rejected);
  }

  static PyBank restored(const py::tuple& state) {
    const auto settings = from_dict<Settings>(state[0].cast<py::dict>());
    settings.check();
    const auto numbers = py::array_t<double, py::array::c_style | py::array::forcecast>(py::object(state[2]));
    const auto rejected = py::array_t<std::uint64_t, py::array::c_style | py::array::forcecast>(py::object(state[3]));
    PyBank bank(settings, rejected.size());
    const auto width = static_cast<py::ssize_t>(bank.states_.numbers());
    if (numbers.ndim() != 2 || numbers.shape(0) != bank.streams() || numbers.shape(1) != width) {
      throw py::value_error("pickled state: got shape " + shape_of(numbers) + ", allowed: what a bank was pickled as");
    }
    const double* value = numbers.data();
    for (std::size_t i = 0; i < bank.states_.size(); ++i) {
      bank.states_.visit(i, [&](Real& number) {
        number = static_cast<Real>(*value++);
        if (!palpate::is_finite(number)) {
          throw py::value_error("pickled state: got a number that is not finite, allowed: finite numbers");
        }
      });
      bank.states_.set_rejected(i, rejected.data()[i]);
    }
    bank.samples_ = state[1].cast<std::size_t>();
    return bank;
  }

  const Settings& settings() const {
    require_made();
    return settings_;
  }
  py::ssize_t streams() const {
    require_made();
    return static_cast<py::ssize_t>(states_.size());
  }
  std::size_t samples() const { return samples_; }

 private:
  static std::size_t checked(py::ssize_t streams) {
    if (streams < 1 || streams > py::ssize_t{1} << 32) {
      throw py::value_error("streams: got " + std::to_string(streams) + ", allowed: 1 <= streams <= 2**32");
    }
    return static_cast<std::size_t>(streams);
  }

  void require_idle() const {
    require_made();
    if (busy_) {
      throw std::runtime_error("this bank is processing a block in another thread: give each thread its own");
    }
  }

  Settings settings_;
  States states_;
  std::size_t samples_ = 0;
  bool busy_ = false;
};
