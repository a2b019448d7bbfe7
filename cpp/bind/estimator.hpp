// SPDX-License-Identifier: MIT
#pragma once

// What Python's estimators have in common: a core, its settings, and the counts that the core leaves to its caller.

#include <cstddef>
#include <cstring>
#include <limits>
#include <palpate/tracker.hpp>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "settings.hpp"

using palpate::knows_its_error;

/// NaN where it means nothing yet.
template <class Core>
auto standard_error_of(const Core& core) {
  return core.settled() ? core.standard_error() : std::numeric_limits<typename Core::real_type>::quiet_NaN();
}

/// One row of trace(). The padding is a member, so that equal traces have equal bytes.
template <class Real, bool KnowsItsError>
struct TraceRow {
  Real ratio, covariance, innovation, statistic;
  bool alarm;
  unsigned char padding[sizeof(Real) - 1];
};
template <class Real>
struct TraceRow<Real, true> {
  Real ratio, covariance, innovation, statistic, standard_error;
  bool alarm;
  unsigned char padding[sizeof(Real) - 1];
};

template <class Row, bool knows_its_error>
py::dtype trace_dtype() {
  std::vector<Column> columns{PALPATE_COLUMN(Row, ratio), PALPATE_COLUMN(Row, covariance),
                              PALPATE_COLUMN(Row, innovation), PALPATE_COLUMN(Row, statistic)};
  if constexpr (knows_its_error) {
    columns.push_back(PALPATE_COLUMN(Row, standard_error));
  }
  columns.push_back(PALPATE_COLUMN(Row, alarm));
  return dtype_of<Row>(columns);
}

/// Field by field into its place: a row made elsewhere and copied would wait for its own parts to be stored.
template <class Real, bool KnowsItsError, class Core>
void write_row(TraceRow<Real, KnowsItsError>& row, const Core& core, const palpate::Step<Real>& step) {
  row.ratio = core.ratio();
  row.covariance = core.covariance();
  row.innovation = step.accepted ? step.innovation : std::numeric_limits<Real>::quiet_NaN();
  row.statistic = core.statistic();
  row.alarm = core.alarm();
  std::memset(row.padding, 0, sizeof(row.padding));
  if constexpr (KnowsItsError) {
    row.standard_error = standard_error_of(core);
  }
}

/// The rows of a contiguous array.
template <class Item>
struct Rows {
  Item* data;
  py::ssize_t width;

  explicit Rows(const View<Item>& view) : data(view.items()), width(view.stride / py::ssize_t{sizeof(Item)}) {}
  Item* operator[](py::ssize_t i) const { return data + i * width; }
};

template <class Kind_>
class Estimator {
 public:
  using Kind = Kind_;
  using Core = typename Kind::Core;
  using Real = typename Core::real_type;
  using Row = TraceRow<Real, knows_its_error<Core>>;

  /// The core, and the counts that it leaves to its caller.
  struct State {
    Core core;
    std::size_t samples = 0, rejected = 0;
    Real innovation = std::numeric_limits<Real>::quiet_NaN();  // not beside the core's information: see RatioOf

    /// The regressor, or the address of several.
    template <class Regressor>
    auto take(Real output, Regressor regressor) noexcept {
      const auto step = core.update(output, regressor);
      if (step.accepted) {
        innovation = step.innovation;
        ++samples;
      } else {
        ++rejected;
      }
      return step;
    }
  };

  explicit Estimator(const Settings& settings) : Estimator(settings, {Kind::core(settings)}) {}
  Estimator(const Settings& settings, const State& state) : settings_(settings), state_(state) {}

  double update(double output, double regressor) {
    require_idle(busy_, "estimator");
    state_.take(static_cast<Real>(output), static_cast<Real>(regressor));
    return state_.core.ratio();
  }

  py::object process(const py::object& output, const py::object& regressor, const py::object& out) {
    return block<Real>(output, regressor, out, once<&py::dtype::of<Real>>(), {-1}, {-1},
                       [](Real& to, const Core& core, const palpate::Step<Real>&) { to = core.ratio(); });
  }

  py::object trace(const py::object& output, const py::object& regressor, const py::object& out) {
    return block<Row>(output, regressor, out, once<&trace_dtype<Row, knows_its_error<Core>>>(), {-1}, {-1},
                      [](Row& to, const Core& core, const palpate::Step<Real>& step) { write_row(to, core, step); });
  }

  void reset() {
    require_idle(busy_, "estimator");
    state_ = {Kind::core(settings_)};
  }

  bool operator==(const Estimator& other) const { return settings_ == other.settings_ && state().equal(other.state()); }

  /// Every number of the core, then the innovation (None before the first sample) and the counts.
  py::tuple state() const {
    py::list values;
    for (const Real value : numbers_of(state_.core)) {
      values.append(static_cast<double>(value));
    }
    values.append(state_.samples == 0 ? py::object(py::none()) : py::object(py::float_(state_.innovation)));
    values.append(state_.samples);
    values.append(state_.rejected);
    return py::tuple(values);
  }

  static Estimator restored(const py::dict& values, const py::tuple& pickled) {
    const Settings settings = Kind::defaults().with("pickled settings", values);
    Kind::check(settings);
    Estimator estimator(settings);
    State& state = estimator.state_;
    std::vector<Real> numbers = numbers_of(state.core);
    const std::size_t count = numbers.size();
    bool allowed = values.size() == settings.size() && pickled.size() == count + 3;
    for (std::size_t i = 0; allowed && i < count; ++i) {
      numbers[i] = pickled[i].cast<Real>();
      allowed = palpate::is_finite(numbers[i]);
    }
    const Real* place = numbers.data();
    state.core.visit_state([&](Real& value) { value = *place++; });
    if (!allowed || !(state.core.information() > 0 && state.core.statistic() >= 0)) {
      throw py::value_error("pickled state: got " + methods::shown(pickled) +
                            ", allowed: this version's numbers, finite, an information > 0, a statistic >= 0");
    }
    const py::object innovation = pickled[count];
    state.innovation = innovation.is_none() ? state.innovation : innovation.cast<Real>();
    state.samples = pickled[count + 1].cast<std::size_t>();
    state.rejected = pickled[count + 2].cast<std::size_t>();
    return estimator;
  }

  const Settings& settings() const { return settings_; }
  const State& numbers() const { return state_; }

 protected:
  // Every sample through a copy of the core, which becomes the state when the block is done: a reader in another thread
  // sees the state before the block or the state after it. The shapes of the regressors and of the results begin with n.
  template <class Item, bool rows = false, class Observe>
  py::object block(const py::object& output, const py::object& regressor, const py::object& out, const py::dtype& dtype,
                   Shape regressors_shape, Shape shape, Observe observe) {
    require_idle(busy_, "estimator");
    constexpr int flags = rows ? py::array::c_style : 0;
    const py::array y_given = samples_of<Real, flags>(output, "output", {-1});
    const py::ssize_t size = regressors_shape[0] = shape[0] = y_given.shape(0);
    const py::array x_given = samples_of<Real, flags>(regressor, rows ? "regressors" : "regressor", regressors_shape);
    const py::array written = output_array(out, dtype, shape, flags);  // last: an __array__ may have changed it
    const py::array y_apart = apart_from(y_given, written), x_apart = apart_from(x_given, written);
    const View<const Real> y(y_apart), x(x_apart);
    const View<Item> to(written);
    require_idle(busy_, "estimator");  // making arrays of the arguments may have run other Python code
    const InUse in_use(busy_);
    State next = state_;
    const auto take = [&next, observe, size](auto outputs, auto regressors, auto results) {
      Core core = next.core;
      Real innovation = next.innovation;
      std::size_t rejected = 0;
      for (py::ssize_t i = 0; i < size; ++i) {
        const auto step = core.update(outputs[i], regressors[i]);
        if (PALPATE_UNLIKELY(!step.accepted)) {
          ++rejected;
        } else {
          innovation = step.innovation;
        }
        observe(results[i], core, step);
      }
      next.core = core;
      next.innovation = innovation;
      next.rejected += rejected;
      next.samples += static_cast<std::size_t>(size) - rejected;
    };
    const auto loop = [&] {
      if constexpr (rows) {
        take(y.items(), Rows(x), Rows(to));
      } else if (y.dense() && x.dense() && to.dense()) {
        take(y.items(), x.items(), to.items());
      } else {
        take(y, x, to);
      }
    };
    run_block(size, loop, rows ? 256 : 4096);
    state_ = next;
    return written;
  }

  Settings settings_;
  State state_;
  bool busy_ = false;

 private:
  // visit_state is noexcept: nothing may throw while it runs.
  static std::vector<Real> numbers_of(Core core) {
    std::size_t count = 0;
    core.visit_state([&](const Real&) { ++count; });
    std::vector<Real> numbers(count);
    Real* place = numbers.data();
    core.visit_state([&](const Real& value) { *place++ = value; });
    return numbers;
  }
};

/// What all estimators have in Python; `explains` is the name of the second argument.
template <class E>
void define_estimator(py::class_<E>& type, const char* process_doc, const char* trace_doc, const char* explains) {
  const auto pickled = [](const py::object& self) {
    const auto& estimator = self.cast<const E&>();
    return py::make_tuple(estimator.settings().dict(), estimator.state(), py::getattr(self, "__dict__", py::dict()));
  };
  const auto restored = [](const py::tuple& state) {
    return std::pair(E(E::restored(state[0], state[1])), state[2].cast<py::dict>());
  };
  const auto output = py::arg("output"), regressor = py::arg(explains);
  const auto out = py::arg("out") = py::none();
  methods::define_display(type, "estimator");
  methods::define_copies(type);
  type.def("process", &E::process, output, regressor, out, (process_doc + std::string(methods::raises)).c_str())
      .def("trace", &E::trace, output, regressor, out, trace_doc)
      .def("reset", &E::reset, "reset(self, /)\n--\n\nForget all samples; the settings stay.")
      .def(py::pickle(pickled, restored))
      .def_property_readonly(
          "settings", [](const E& estimator) { return estimator.settings().dict(); },
          "The parameters, as a dict: `type(e)(**e.settings)` is a new estimator like `e`.");
}

/// A property that is get(State).
template <class E, class Get>
void define_number(py::class_<E>& type, const char* name, Get get, const char* doc) {
  type.def_property_readonly(name, [get](const E& estimator) { return get(estimator.numbers()); }, doc);
}

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
template <class Add>
void visit_properties(Add&& add) {
  add("ratio", [](const auto& s) { return s.core.ratio(); }, "Estimated output / regressor.");
  add(
      "covariance", [](const auto& s) { return s.core.covariance(); },
      "Unscaled covariance P, 1/pF^2; P times the variance of the innovation is the variance of the ratio.");
  visit_counts(add);
}
inline constexpr auto standard_error_doc =
    "Standard deviation of the ratio; nan for the first 40 samples or so, and for 16 after a change.";
