// SPDX-License-Identifier: MIT
#pragma once

// What Python's banks have in common: the states of many estimators with the same settings, and blocks of samples.

#include <algorithm>
#include <functional>
#include <new>
#include <palpate/handover_bank.hpp>
#include <vector>

#include "arrays.hpp"
#include "bank_loops.hpp"
#include "core_state.hpp"
#include "settings.hpp"

// Arrays that start with a cache line: a SIMD register that is loaded from two lines takes twice as long.
template <class Item>
struct CacheLines {
  using value_type = Item;
  static constexpr std::align_val_t line{64};

  CacheLines() = default;
  template <class Other>
  CacheLines(const CacheLines<Other>&) {}
  Item* allocate(std::size_t size) { return static_cast<Item*>(::operator new(size * sizeof(Item), line)); }
  void deallocate(Item* items, std::size_t) { ::operator delete(items, line); }
  bool operator==(const CacheLines&) const { return true; }
  bool operator!=(const CacheLines&) const { return false; }
};

template <class Item>
using LineVector = std::vector<Item, CacheLines<Item>>;

/// States of Rls or AdaptiveRls, a structure of arrays.
template <class Kind>
class LaneStates {
 public:
  using Core = typename Kind::Core;
  using Real = typename Core::real_type;

  LaneStates(const Settings& settings, std::size_t streams)
      : core_(Kind::core(settings)),
        task_{core_.forgetting().factor(false), core_.forgetting().factor(true), cusum_of(core_.detector()),
              core_.bound().min_information},
        ratio_(streams, core_.ratio()),
        information_(streams, core_.information()),
        signed_statistic_(streams) {}

  void process(const BankBlock<Real>& block) {
    BankTask<Real> task = task_;
    task.ratio = ratio_.data();
    task.information = information_.data();
    task.signed_statistic = signed_statistic_.data();
    task.block = block;
    (bank_loops<Real>().*Kind::loop)(task);
  }

  std::size_t size() const { return ratio_.size(); }
  Core core(std::size_t i) const {
    Core core = core_;
    const Real numbers[] = {ratio_[i], information_[i], signed_statistic_[i]};
    set_numbers(core, numbers);
    return core;
  }
  void set_core(std::size_t i, const Core& core) {
    ratio_[i] = core.ratio();
    information_[i] = core.information();
    signed_statistic_[i] = core.signed_statistic();
  }

 private:
  static CusumNumbers<Real> cusum_of(const palpate::Cusum<Real>& cusum) {
    return {cusum.drift, cusum.threshold, cusum.clear_level};
  }
  static CusumNumbers<Real> cusum_of(const palpate::NoDetector<Real>&) { return {}; }

  Core core_;
  BankTask<Real> task_;
  LineVector<Real> ratio_, information_, signed_statistic_;
};

/// States of HandoverRls: groups of streams.
template <class Kind>
class GroupStates {
 public:
  using Core = typename Kind::Core;
  using Real = typename Core::real_type;

  GroupStates(const Settings& settings, std::size_t streams)
      : lanes_(Kind::core(settings)), numbers_(lanes_.length(streams)), size_(streams) {
    const auto values = settings.values<palpate::HandoverSettings<Real>>();
    std::size_t k = 0;
    values.visit_fields([&](const char*, auto member) { settings_[k++] = values.*member; });
    lanes_.reset(numbers_.data(), streams);
  }

  void process(const BankBlock<Real>& block) { bank_loops<Real>().handover({settings_, numbers_.data(), block}); }

  std::size_t size() const { return size_; }
  Core core(std::size_t i) const { return lanes_.core(numbers_.data(), i); }
  void set_core(std::size_t i, const Core& core) { lanes_.set_core(core, numbers_.data(), i); }

 private:
  palpate::Lanes<Core> lanes_;
  std::array<Real, 7> settings_{};
  LineVector<Real> numbers_;
  std::size_t size_;
};

template <class Kind_, template <class> class States_>
class PyBank {
 public:
  using Kind = Kind_;
  using States = States_<Kind>;
  using Core = typename Kind::Core;
  using Real = typename Core::real_type;

  PyBank(const Settings& settings, py::ssize_t streams)
      : settings_(settings), states_(settings, checked(streams)), rejected_(states_.size()) {
    instruction_set();  // throws here, and not in the first block
  }

  /// dimensions 1: one sample of each stream; 2: a block of them.
  template <int dimensions>
  py::object take(py::handle output_given, py::handle regressor_given, py::handle out_given) {
    require_idle(busy_, "bank");
    if constexpr (dimensions == 1) {
      if (py::object done = take_dense(output_given, regressor_given, out_given)) {
        return done;
      }
    }
    const auto output = py::reinterpret_borrow<py::object>(output_given);
    const auto regressor = py::reinterpret_borrow<py::object>(regressor_given);
    const auto out = py::reinterpret_borrow<py::object>(out_given);
    Shape shape{streams()};
    if constexpr (dimensions == 2) {
      shape.insert(shape.begin(), -1);
    }
    const auto outputs = samples_of<Real, py::array::c_style>(output, "output", shape);
    const py::ssize_t frames = dimensions == 1 ? 1 : outputs.shape(0);
    shape[0] = outputs.shape(0);
    const auto regressors = samples_of<Real, py::array::c_style>(regressor, "regressor", shape);
    py::array result = output_array(out, py::dtype::of<Real>(), shape, py::array::c_style);
    const auto y = apart_from(outputs, result), x = apart_from(regressors, result);
    require_idle(busy_, "bank");  // making arrays of the arguments may have run other Python code
    auto* const ratios = static_cast<Real*>(result.mutable_data());
    const InUse in_use(busy_);
    run_block(outputs.size(), [&] { process(y.data(), x.data(), ratios, static_cast<std::size_t>(frames)); });
    rows_ += static_cast<std::size_t>(frames);
    return result;
  }

  void reset() {
    require_idle(busy_, "bank");
    *this = PyBank(settings_, streams());
  }

  /// (rows, numbers of each stream's state, refused samples): to pickle, to copy and to compare.
  py::tuple state() const {
    require_idle(busy_, "bank");
    const auto width = static_cast<py::ssize_t>(numbers_of(states_.core(0)).size());
    py::array_t<double> numbers({streams(), width});
    double* place = numbers.mutable_data();
    for (std::size_t i = 0; i < states_.size(); ++i) {
      for (const Real value : numbers_of(states_.core(i))) {
        *place++ = static_cast<double>(value);
      }
    }
    return py::make_tuple(rows_, numbers, rejected());
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
    const auto width = static_cast<py::ssize_t>(numbers_of(bank.states_.core(0)).size());
    if (numbers.ndim() != 2 || numbers.shape(0) != bank.streams() || numbers.shape(1) != width) {
      throw py::value_error("pickled state: got shape " + shape_of(numbers) + ", allowed: what a bank was pickled as");
    }
    for (std::size_t i = 0; i < bank.states_.size(); ++i) {
      auto core = bank.states_.core(i);
      if (!set_numbers(core, numbers.data() + static_cast<py::ssize_t>(i) * width)) {
        throw py::value_error(
            "pickled state: got a state that no stream can be in, allowed: finite numbers, an "
            "information > 0, a statistic >= 0");
      }
      bank.states_.set_core(i, core);
      bank.rejected_[i] = rejected.data()[i];
    }
    bank.rows_ = state[0].cast<std::size_t>();
    return bank;
  }

  bool operator==(const PyBank& other) const {
    const auto bytes = [](const PyBank& b, int k) { return b.state().attr("__getitem__")(k).attr("tobytes")(); };
    return settings_ == other.settings_ && rows_ == other.rows_ && bytes(*this, 1).equal(bytes(other, 1)) &&
           bytes(*this, 2).equal(bytes(other, 2));
  }

  const Settings& settings() const { return settings_; }
  py::ssize_t streams() const { return static_cast<py::ssize_t>(states_.size()); }
  std::size_t rows() const { return rows_; }
  py::dict settings_dict() const { return settings_.dict(); }
  py::object ratio() const { return of_cores<Real>(&Core::ratio); }
  py::object covariance() const { return of_cores<Real>(&Core::covariance); }
  py::object statistic() const { return of_cores<Real>(&Core::statistic); }
  py::object standard_error() const { return of_cores<Real>(&standard_error_of<Core>); }
  py::object alarm() const { return of_cores<bool>(&Core::alarm); }
  py::object rejected() const {
    return each<std::uint64_t>([this](std::size_t i) { return rejected_[i]; });
  }
  py::object samples() const {
    return each<std::uint64_t>([this](std::size_t i) { return rows_ - rejected_[i]; });
  }

 private:
  /// One number of each stream.
  template <class Item, class Get>
  py::array_t<Item> each(Get get) const {
    require_idle(busy_, "bank");
    py::array_t<Item> result(streams());
    auto values = result.template mutable_unchecked<1>();
    for (py::ssize_t i = 0; i < streams(); ++i) {
      values(i) = get(static_cast<std::size_t>(i));
    }
    return result;
  }

  template <class Item, class Get>
  py::array_t<Item> of_cores(Get get) const {
    return each<Item>([&](std::size_t i) { return std::invoke(get, states_.core(i)); });
  }

  void process(const Real* output, const Real* regressor, Real* ratios, std::size_t frames) {
    states_.process({output, regressor, ratios, rejected_.data(), states_.size(), frames});
  }

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
    process(y.items(), x.items(), ratios.items(), 1);
    ++rows_;
    return result;
  }

  static std::size_t checked(py::ssize_t streams) {
    if (streams < 1 || streams > py::ssize_t{1} << 32) {
      throw py::value_error("streams: got " + std::to_string(streams) + ", allowed: 1 <= streams <= 2**32");
    }
    return static_cast<std::size_t>(streams);
  }

  Settings settings_;
  States states_;
  std::vector<std::uint64_t> rejected_;
  std::size_t rows_ = 0;
  bool busy_ = false;
};
