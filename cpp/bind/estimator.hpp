// SPDX-License-Identifier: MIT
#pragma once

// What Python's estimators have in common: a core, its settings, and the counts that the core leaves to its caller.

#include <pybind11/stl.h>

#include <array>
#include <cstddef>
#include <cstring>
#include <limits>
#include <palpate/tracker.hpp>
#include <vector>

#include "arrays.hpp"
#include "detector.hpp"
#include "settings.hpp"

template <class Core>
using HasStandardError = decltype(std::declval<const Core&>().standard_error());
template <class Core>
inline constexpr bool knows_its_error = palpate::detail::has<HasStandardError, Core>;

template <class Core>
using SaysPossible = decltype(std::declval<const Core&>().possible());
/// Whether unpickled numbers can be a state.
template <class Core>
bool possible(const Core& core) {
  if constexpr (palpate::detail::has<SaysPossible, Core>) {
    return core.possible();
  } else {
    return core.information() > 0 && core.statistic() >= 0;
  }
}

/// NaN where it means nothing yet.
template <class Core>
auto standard_error_of(const Core& core) {
  return core.settled() ? core.standard_error() : std::numeric_limits<typename Core::real_type>::quiet_NaN();
}

/// The dtype of the rows of trace(): of `count` coefficients, or (0) of a ratio.
template <class Real, bool knows_its_error>
const py::dtype& row_dtype(std::size_t count) {
  static std::array<py::gil_safe_call_once_and_store<py::dtype>, 9> made;
  const auto make = [count] {
    const bool is_vector = count > 0;
    const auto real = py::dtype::of<Real>();
    const auto each = is_vector ? py::dtype::from_args(py::make_tuple(real, py::make_tuple(count))) : real;
    Fields fields;
    py::ssize_t end = 0;
    const auto add = [&](const char* name, const py::dtype& type) {
      fields.push_back({name, end, 0, "", type});
      end += type.itemsize();
    };
    add(is_vector ? "coefficients" : "ratio", each);
    add(is_vector ? "standard_errors" : "covariance", each);
    add("innovation", real);
    add("statistic", real);
    if (knows_its_error) {
      add("standard_error", real);
    }
    const py::ssize_t size = end + real.itemsize();
    add("alarm", py::dtype::of<bool>());
    return dtype_of(fields, size, is_vector);
  };
  return made[count].call_once_and_store_result(make).get_stored();
}

template <class Kind>
class Estimator {
 public:
  using Core = typename Kind::Core;
  using Real = typename Core::real_type;
  static constexpr Real nan = std::numeric_limits<Real>::quiet_NaN();

  /// The core, and the counts that it leaves to its caller.
  struct State {
    Core core;
    std::size_t samples = 0, rejected = 0;
    Real innovation = nan;  // not beside the core's information: see RatioOf

    auto take(Real output, const Real* regressors) noexcept {
      const auto step = core.take(output, regressors);
      if (PALPATE_LIKELY(step.accepted)) {
        innovation = step.innovation;
        ++samples;
      } else {
        ++rejected;
      }
      return step;
    }
  };

  Estimator(const char* name, const py::dict& given) : Estimator(Kind::defaults().with(name, given)) {}
  explicit Estimator(const Settings& settings)
      : settings_(settings), state_{(Kind::check(settings), Kind::core(settings))} {}
  Estimator(const Settings& settings, const State& state) : settings_(settings), state_(state) {}

  auto take(Real output, const Real* regressors) {
    busy_.require_idle();
    return state_.take(output, regressors);
  }

  py::object process(const py::object& output, const py::object& regressor, const py::object& out) {
    const auto write = [](Real* to, const Core& core, const auto&) { core.write(to); };
    return block(output, regressor, out, once<&py::dtype::of<Real>>(), state_.core.count(), write);
  }

  py::object trace(const py::object& output, const py::object& regressor, const py::object& out) {
    Real on = 0;
    std::memset(&on, 1, 1);  // True, with the padding: equal traces have equal bytes
    const auto write = [on](Real* to, const Core& core, const auto& step) {
      to = core.write_spread(core.write(to));
      *to++ = step.accepted ? step.innovation : nan;
      *to++ = core.statistic();
      if constexpr (knows_its_error<Core>) {
        *to++ = standard_error_of(core);
      }
      *to = core.alarm() ? on : Real(0);
    };
    const auto count = Core::is_vector ? static_cast<std::size_t>(state_.core.count()) : 0;
    return block(output, regressor, out, row_dtype<Real, knows_its_error<Core>>(count), no_axis, write);
  }

  void reset() {
    busy_.require_idle();
    state_ = {Kind::core(settings_)};
  }

  bool operator==(const Estimator& other) const { return pickled().equal(other.pickled()); }

  /// Every number of the core, then the innovation (None before the first sample) and the counts.
  py::tuple state() const {
    py::list values = py::cast(numbers_of(state_.core));
    values.append(state_.samples == 0 ? py::none() : py::cast(state_.innovation));
    values.append(state_.samples);
    values.append(state_.rejected);
    return py::tuple(values);
  }
  py::tuple pickled() const { return py::make_tuple(settings_.dict(), state()); }

  static Estimator restored(const py::tuple& both) {
    const py::dict values = both[0];
    const py::tuple pickled = both[1];
    Estimator estimator("pickled settings", values);
    State& state = estimator.state_;
    std::vector<Real> numbers = numbers_of(state.core);
    const std::size_t count = numbers.size();
    bool allowed = values.size() == estimator.settings_.dict().size() && pickled.size() == count + 3;
    for (std::size_t i = 0; allowed && i < count; ++i) {
      numbers[i] = pickled[i].cast<Real>();
      allowed = palpate::is_finite(numbers[i]);
    }
    const Real* place = numbers.data();
    state.core.visit_state([&](Real& value) { value = *place++; });
    if (!allowed || !possible(state.core)) {
      refuse<value_error>("pickled state", shown(pickled),
                          "this version's numbers, finite, an information > 0, a statistic >= 0");
    }
    const py::object innovation = pickled[count];
    state.innovation = innovation.is_none() ? state.innovation : innovation.cast<Real>();
    state.samples = pickled[count + 1].cast<std::size_t>();
    state.rejected = pickled[count + 2].cast<std::size_t>();
    return estimator;
  }

  const Settings& settings() const { return settings_; }
  const State& numbers() const { return state_; }

 private:
  // Every sample through a copy of the core, which becomes the state when the block is done: a reader in another thread
  // sees the state before the block or the state after it. A result has an axis of `columns`, or is one item.
  template <class Write>
  py::object block(const py::object& output, const py::object& regressor, const py::object& out, const py::dtype& dtype,
                   py::ssize_t columns, Write write) {
    constexpr int flags = Core::is_vector ? py::array::c_style : 0;
    const py::array y_given = samples_of<Real, flags>(output, "output", {-1});
    const py::ssize_t size = y_given.shape(0);
    const Shape rows = axes({size, state_.core.width()});
    const py::array x_given = samples_of<Real, flags>(regressor, Core::explains, rows);
    const py::array written = output_array(out, dtype, axes({size, columns}), flags);  // last: an __array__ may have
    const View<const Real> y(apart_from(y_given, written)), x(apart_from(x_given, written));  // changed it
    const View<Real> to(written);
    const std::lock_guard in_use(busy_);
    State next = state_;
    const auto loop = [&next, y, x, to, write, size] {  // by value: 1.6 times as fast as by reference
      State state = next;
      for (py::ssize_t i = 0; i < size; ++i) {
        const auto step = state.take(y[i], &x[i]);
        write(&to[i], state.core, step);
      }
      next = state;
    };
    run_block(size, loop, Core::is_vector ? 256 : 4096);
    state_ = next;
    return written;
  }

  static std::vector<Real> numbers_of(Core core) {
    std::vector<Real> numbers;
    numbers.reserve(sizeof(Core));  // each takes a byte or more, and visit_state is noexcept: nothing may throw in it
    core.visit_state([&](const Real& value) { numbers.push_back(value); });
    return numbers;
  }

  Settings settings_;
  State state_;
  Busy busy_{"estimator"};
};

/// The properties of an estimator, and of each stream of a bank: calls add(name, its value in a State, doc).
template <class Add>
void visit_counts(Add&& add) {
  add(
      "innovation", [](const auto& s) { return s.innovation; },
      "A-priori error of the last accepted sample, in the unit of the output; nan before the first.");
  add(
      "statistic", [](const auto& s) { return s.core.statistic(); },
      "CUSUM statistic: in AdaptiveRls in the unit of the output, else in standard deviations; 0 without a detector.");
  add("alarm", [](const auto& s) { return s.core.alarm(); }, "Whether the alarm is on; False without a detector.");
  add("samples", [](const auto& s) { return std::uint64_t{s.samples}; }, "Samples accepted so far.");
  add("rejected", [](const auto& s) { return std::uint64_t{s.rejected}; }, "Samples refused so far.");
}

/// What all estimators have in Python. Returns a function that adds a property: its name, its value in a State, its doc.
template <class E>
auto define_estimator(Class<E>& type, const char* process_doc, const char* trace_doc) {
  const auto output = py::arg("output"), regressor = py::arg(E::Core::explains);
  const auto out = py::arg("out") = py::none();
  define_display(type, "estimator_line", "estimator_card");
  define_copies(type);
  type.def("process", &E::process, output, regressor, out, (process_doc + std::string(raises)).c_str())
      .def("trace", &E::trace, output, regressor, out, trace_doc)
      .def("reset", &E::reset, reset_doc);
  type.property(
      "settings", [](const E& estimator) { return estimator.settings().dict(); },
      "The parameters, as a dict: `type(e)(**e.settings)` is a new estimator like `e`.");
  const auto add = [&type](const char* name, auto get, const char* doc) {
    type.property(name, [get](const E& estimator) { return get(estimator.numbers()); }, doc);
  };
  visit_counts(add);
  add(
      "threshold", [](const auto& s) { return threshold_of(s.core); },
      "The alarm is set when `statistic` is larger than this; inf without a detector.");
  return add;
}
