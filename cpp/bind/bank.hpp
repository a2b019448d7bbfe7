// SPDX-License-Identifier: MIT
#pragma once

// What Python's banks have in common: the states of many estimators with the same settings, and blocks of samples.

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "bank_loops.hpp"
#include "block.hpp"
#include "core_numbers.hpp"
#include "in_lines.hpp"
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

  std::vector<Real> numbers(std::size_t i) const { return {ratio_[i], information_[i], statistic_[i]}; }
  bool set_numbers(std::size_t i, const Real* n) {
    ratio_[i] = n[0];
    information_[i] = n[1];
    statistic_[i] = n[2];
    return palpate::is_finite(n[0]) && palpate::is_finite(n[1]) && n[1] > 0 && palpate::is_finite(n[2]) && n[2] >= 0;
  }
  void set_rejected(std::size_t i, std::uint64_t count) { rejected_[i] = count; }

 private:
  BankTask<Real> task_;
  LineVector<Real> ratio_, information_, statistic_;
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

  std::vector<Real> numbers(std::size_t i) const { return numbers_of(cores_[i]); }
  bool set_numbers(std::size_t i, const Real* n) { return ::set_numbers(cores_[i], n); }
  Real standard_error(std::size_t i) const {
    return cores_[i].settled() ? cores_[i].standard_error() : std::numeric_limits<Real>::quiet_NaN();
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
  py::object take(py::handle output_given, py::handle regressor_given, py::handle out_given, int dimensions) {
    require_idle();
    if (dimensions == 1) {
      if (py::object done = take_dense(output_given, regressor_given, out_given)) {
        return done;
      }
    }
    const auto output = py::reinterpret_borrow<py::object>(output_given);
    const auto regressor = py::reinterpret_borrow<py::object>(regressor_given);
    const auto out = py::reinterpret_borrow<py::object>(out_given);
    const auto outputs = table_of<Real>(output, "output", dimensions, streams(), -1);
    const py::ssize_t frames = dimensions == 1 ? 1 : outputs.shape(0);
    const auto regressors = table_of<Real>(regressor, "regressor", dimensions, streams(), frames);
    py::array result = table_out(out, outputs, py::dtype::of<Real>());
    const auto y = table_apart(outputs, result), x = table_apart(regressors, result);
    require_idle();  // making arrays of the arguments may have run other Python code
    auto* const ratios = static_cast<Real*>(result.mutable_data());
    busy_ = true;
    run_block(outputs.size(), [&] { states_.process(y.data(), x.data(), ratios, static_cast<std::size_t>(frames)); });
    busy_ = false;
    rows_ += static_cast<std::size_t>(frames);
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

  /// (rows, numbers of each stream's state, refused samples): to pickle, to copy and to compare.
  py::tuple state() const {
    require_idle();
    const auto width = static_cast<py::ssize_t>(states_.numbers(0).size());
    py::array_t<double> numbers({streams(), width});
    double* place = numbers.mutable_data();
    for (std::size_t i = 0; i < states_.size(); ++i) {
      for (const Real value : states_.numbers(i)) {
        *place++ = static_cast<double>(value);
      }
    }
    const auto rejected = each<std::uint64_t>([](const States& s, std::size_t i) { return s.rejected(i); });
    return py::make_tuple(rows_, numbers, rejected);
  }

  static PyBank restored(const Settings& settings, const py::tuple& state) {
    if (state.size() != 3) {
      throw py::value_error("pickled state: got " + std::to_string(state.size()) + " items, allowed: 3");
    }
    if (const py::array counts(state[2]); counts.dtype().kind() != 'u') {
      throw py::value_error("pickled state: got refused samples of " + py::str(counts.dtype()).cast<std::string>() +
                            ", allowed: unsigned integers");
    }
    const auto numbers = py::array_t<Real, py::array::c_style | py::array::forcecast>(py::object(state[1]));
    const auto rejected = py::array_t<std::uint64_t, py::array::c_style | py::array::forcecast>(py::object(state[2]));
    PyBank bank(settings, rejected.size());
    const auto width = static_cast<py::ssize_t>(bank.states_.numbers(0).size());
    if (numbers.ndim() != 2 || numbers.shape(0) != bank.streams() || numbers.shape(1) != width) {
      throw py::value_error("pickled state: got shape " + shape_of(numbers) + ", allowed: what a bank was pickled as");
    }
    for (py::ssize_t i = 0; i < bank.streams(); ++i) {
      if (!bank.states_.set_numbers(static_cast<std::size_t>(i), numbers.data() + i * width)) {
        throw py::value_error(
            "pickled state: got a state that no stream can be in, allowed: finite numbers, an "
            "information > 0, a statistic >= 0");
      }
      bank.states_.set_rejected(static_cast<std::size_t>(i), rejected.data()[i]);
    }
    bank.rows_ = state[0].cast<std::size_t>();
    return bank;
  }

  bool operator==(const PyBank& other) const {
    const auto bytes = [](const PyBank& b) { return b.state().attr("__getitem__")(1).attr("tobytes")(); };
    const auto refused = [](const PyBank& b) { return b.state().attr("__getitem__")(2).attr("tobytes")(); };
    return equal(settings_, other.settings_) && rows_ == other.rows_ && bytes(*this).equal(bytes(other)) &&
           refused(*this).equal(refused(other));
  }

  const Settings& settings() const {
    require_made();
    return settings_;
  }
  py::ssize_t streams() const {
    require_made();
    return static_cast<py::ssize_t>(states_.size());
  }
  std::size_t rows() const {
    require_made();
    return rows_;
  }

 private:
  /// The short way of one row: arrays that can be read and written where they are. Nothing where they cannot.
  py::object take_dense(py::handle output, py::handle regressor, py::handle out) {
    const py::dtype& real = once<&py::dtype::of<Real>>();
    const auto y = dense_view<Real>(output, real), x = dense_view<Real>(regressor, real);
    if (y.size != streams() || x.size != streams()) {
      return {};
    }
    py::object result =
        out.is_none() ? py::object(py::array(real, streams())) : py::reinterpret_borrow<py::object>(out);
    const auto ratios = dense_view<Real>(result, real, writeable);
    if (ratios.size != streams() || !apart(y, ratios) || !apart(x, ratios)) {
      return {};
    }
    states_.process(y.items(), x.items(), ratios.items(), 1);
    ++rows_;
    return result;
  }

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
  std::size_t rows_ = 0;
  bool busy_ = false;
};
