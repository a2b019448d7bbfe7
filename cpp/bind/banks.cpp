// SPDX-License-Identifier: MIT
// Bank: many estimators of one kind, a sample of each at a time.

#include <algorithm>
#include <utility>
#include <variant>
#include <vector>

#include "estimator.hpp"
#include "estimator_kinds.hpp"

namespace {

constexpr auto class_doc = R"(Independent estimators for many streams that are sampled together.

Parameters
----------
estimator : Rls, AdaptiveRls, HandoverRls, or one of them in float32
    Every stream begins as a copy of it, with its settings and its state.
streams : int, 1 <= streams <= 2**32
    Number of streams.

Notes
-----
The bits of as many single estimators. `bank[i]` is a copy of the estimator of a stream.

Examples
--------
>>> import palpate
>>> bank = palpate.Bank(palpate.AdaptiveRls(drift=0.005), 3)
>>> bank.update([0.5, 0.6, 0.7], [0.25, 0.25, 0.25]).round(2)
array([2. , 2.4, 2.8])
>>> bank[2].samples
1
)";

constexpr auto update_doc = R"(update(self, /, output, regressor, out=None)
--

Take one sample of each stream and return their ratios.

Parameters
----------
output, regressor : array_like of real numbers, shape (streams,), pF
out : numpy.ndarray, shape (streams,), contiguous, optional
    Where the ratios are written; it may be `output` or `regressor` itself.

Returns
-------
numpy.ndarray, shape (streams,)
    The ratios. A sample that is not finite is refused, and counted in `rejected`.

Raises
------
TypeError, ValueError
    Values that are not real numbers; another shape; an `out` of another type.
RuntimeError
    The bank is in use by another thread.
)";

constexpr auto process_doc = R"(process(self, /, output, regressor, out=None)
--

Take a block of samples of each stream; the same bits as one `update` for each row, and the same errors.

Parameters
----------
output : array_like of real numbers, shape (n, streams), pF
    Read in place where it is contiguous and of the bank's own type.
regressor : array_like of real numbers, shape (n, streams), or (n,) for all streams, pF
out : numpy.ndarray, shape (n, streams), contiguous, optional
    Where the ratios are written; it may be `output` or `regressor` itself.

Returns
-------
numpy.ndarray, shape (n, streams)
    The ratios after each row.
)";

template <class Kind>
struct Streams {
  using E = Estimator<Kind>;
  using State = typename E::State;
  using Real = typename E::Real;
  Settings settings;
  std::vector<State> states;
};

class Bank {
 public:
  Bank(py::handle estimator, py::ssize_t streams) {
    if (streams < 1 || streams > py::ssize_t{1} << 32) {
      throw py::value_error("streams: got " + std::to_string(streams) + ", allowed: 1 <= streams <= 2**32");
    }
    if (!(fill<FixedKind<double>>(estimator, streams) || fill<FixedKind<float>>(estimator, streams) ||
          fill<AdaptiveKind<double>>(estimator, streams) || fill<AdaptiveKind<float>>(estimator, streams) ||
          fill<HandoverKind<double>>(estimator, streams) || fill<HandoverKind<float>>(estimator, streams))) {
      throw py::type_error("estimator: got " + methods::shown(estimator) +
                           ", allowed: an Rls, AdaptiveRls or HandoverRls, for example palpate.HandoverRls()");
    }
  }
  /// Of copies of all its estimators.
  explicit Bank(const py::tuple& estimators) : Bank(estimators[0], static_cast<py::ssize_t>(estimators.size())) {
    const auto set = [&](auto& bank) {
      using E = typename std::decay_t<decltype(bank)>::E;
      for (std::size_t i = 0; i < bank.states.size(); ++i) {
        const auto& given = estimators[i].template cast<const E&>();
        if (!(given.settings() == bank.settings)) {
          throw py::value_error("pickled state: got estimators of different settings, allowed: the same of all");
        }
        bank.states[i] = given.numbers();
      }
    };
    std::visit(set, streams_);
  }

  py::object update(const py::object& output, const py::object& regressor, const py::object& out) {
    return take(false, output, regressor, out);
  }
  py::object process(const py::object& output, const py::object& regressor, const py::object& out) {
    return take(true, output, regressor, out);
  }

  void reset() {
    require_idle(busy_, "bank");
    const auto fill = [](auto& bank) {
      using E = typename std::decay_t<decltype(bank)>::E;
      std::fill(bank.states.begin(), bank.states.end(), E(bank.settings).numbers());
    };
    std::visit(fill, streams_);
  }

  py::ssize_t size() const {
    return std::visit([](const auto& bank) { return static_cast<py::ssize_t>(bank.states.size()); }, streams_);
  }
  py::object at(py::handle stream) const {
    const py::ssize_t given = methods::to_size(stream, "stream"), i = given < 0 ? given + size() : given;
    if (i < 0 || i >= size()) {
      throw py::index_error("stream: got " + std::to_string(given) + ", allowed: below " + std::to_string(size()));
    }
    require_idle(busy_, "bank");
    const auto get = [&](const auto& bank) {
      using E = typename std::decay_t<decltype(bank)>::E;
      return py::cast(E(bank.settings, bank.states[static_cast<std::size_t>(i)]));
    };
    return std::visit(get, streams_);
  }
  py::tuple estimators() const {
    py::tuple all(size());
    for (py::ssize_t i = 0; i < size(); ++i) {
      all[static_cast<std::size_t>(i)] = at(py::int_(i));
    }
    return all;
  }
  bool operator==(const Bank& other) const { return estimators().equal(other.estimators()); }

  /// An array of what get(state) gives for each stream.
  template <class Get>
  py::array each(Get get) const {
    require_idle(busy_, "bank");
    const auto values = [&](const auto& bank) -> py::array {
      py::array_t<decltype(get(bank.states[0]))> result(size());
      std::transform(bank.states.begin(), bank.states.end(), result.mutable_data(), get);
      return result;
    };
    return std::visit(values, streams_);
  }

 private:
  template <class Kind>
  bool fill(py::handle estimator, py::ssize_t streams) {
    const bool found = py::isinstance<Estimator<Kind>>(estimator);
    if (found) {
      const auto& given = estimator.cast<const Estimator<Kind>&>();
      streams_ = Streams<Kind>{given.settings(), std::vector(static_cast<std::size_t>(streams), given.numbers())};
    }
    return found;
  }

  py::object take(bool is_block, const py::object& output, const py::object& regressor, const py::object& out) {
    require_idle(busy_, "bank");
    return std::visit([&](auto& bank) { return taken(bank, is_block, output, regressor, out); }, streams_);
  }

  template <class Kind>
  py::object taken(Streams<Kind>& bank, bool is_block, const py::object& output, const py::object& regressor,
                   const py::object& out) {
    using Real = typename Streams<Kind>::Real;
    constexpr int dense = py::array::c_style;
    const auto streams = static_cast<py::ssize_t>(bank.states.size());
    const auto matrix = [&](const py::object& value, const char* name, py::ssize_t frames) {
      return is_block ? samples_of<Real, dense>(value, name, {frames, streams})
                      : samples_of<Real, dense>(value, name, {streams});
    };
    const py::array y = matrix(output, "output", -1);
    const py::ssize_t frames = is_block ? y.shape(0) : 1;
    const py::array given = real_array(regressor, "regressor");
    const bool is_shared = is_block && given.ndim() == 1;
    const auto x =
        is_shared ? samples_of<Real, dense>(given, "regressor", {frames}) : matrix(given, "regressor", frames);
    const py::dtype& dtype = once<&py::dtype::of<Real>>();
    py::array result =
        is_block ? output_array(out, dtype, {frames, streams}, dense) : output_array(out, dtype, {streams}, dense);
    const py::array outputs = apart_from(y, result), regressors = apart_from(x, result);
    require_idle(busy_, "bank");  // making arrays of the arguments may have run other Python code
    const InUse in_use(busy_);
    auto* ratios = static_cast<Real*>(result.mutable_data());
    auto *to_explain = static_cast<const Real*>(outputs.data()),
         *explains = static_cast<const Real*>(regressors.data());
    run_block(outputs.size(), [&] {
      for (py::ssize_t frame = 0; frame < frames; ++frame) {
        for (auto& state : bank.states) {
          state.take(*to_explain++, *explains);
          explains += is_shared ? 0 : 1;
          *ratios++ = state.core.ratio();
        }
        explains += is_shared ? 1 : 0;
      }
    });
    return std::move(result);
  }

  std::variant<Streams<FixedKind<double>>, Streams<FixedKind<float>>, Streams<AdaptiveKind<double>>,
               Streams<AdaptiveKind<float>>, Streams<HandoverKind<double>>, Streams<HandoverKind<float>>>
      streams_;
  bool busy_ = false;
};

std::string repr(const Bank& bank) {
  const auto kind = py::type::of(bank.at(py::int_(0))).attr("__name__").cast<std::string>();
  return "<Bank of " + std::to_string(bank.size()) + " " + kind + ">";
}

}  // namespace

void bind_banks(py::module_& module) {
  const auto made = [](py::handle estimator, py::handle streams) {
    return Bank(estimator, methods::to_size(streams, "streams"));
  };
  const auto pickled = [](const py::object& self) {
    return py::make_tuple(self.cast<const Bank&>().estimators(), py::getattr(self, "__dict__", py::dict()));
  };
  const auto restored = [](const py::tuple& state) {
    return std::pair(Bank(state[0].cast<py::tuple>()), state[1].cast<py::dict>());
  };
  const auto output = py::arg("output"), regressor = py::arg("regressor");
  const auto out = py::arg("out") = py::none();
  auto type = methods::define_class<Bank>(module, "Bank", "(estimator, streams)", class_doc, made, py::arg("estimator"),
                                          py::arg("streams"));
  methods::define_copies(type);
  type.def("update", &Bank::update, output, regressor, out, update_doc)
      .def("process", &Bank::process, output, regressor, out, process_doc)
      .def("reset", &Bank::reset, "reset(self, /)\n--\n\nForget all samples; the settings stay.")
      .def("__len__", &Bank::size, "__len__(self, /)\n--\n\n")
      .def("__getitem__", &Bank::at, "__getitem__(self, stream, /)\n--\n\nA copy of the estimator of a stream.")
      .def("__repr__", &repr, "__repr__(self, /)\n--\n\n")
      .def(py::pickle(pickled, restored))
      .def_property_readonly("streams", &Bank::size, "Number of streams.")
      .def_property_readonly(
          "settings", [](const Bank& bank) { return py::object(bank.at(py::int_(0)).attr("settings")); },
          "The parameters of all estimators, as a dict.");
  const auto field = [&](const char* name, auto get, const char* doc) {
    type.def_property_readonly(name, [get](const Bank& bank) { return bank.each(get); }, doc);
  };
  field("ratio", [](const auto& s) { return s.core.ratio(); }, "Estimated output / regressor of each stream.");
  field("covariance", [](const auto& s) { return s.core.covariance(); }, "Unscaled covariance of each stream, 1/pF^2.");
  field(
      "innovation", [](const auto& s) { return s.innovation; },
      "A-priori error of the last accepted sample of each stream, pF; nan before the first.");
  field(
      "statistic", [](const auto& s) { return s.core.statistic(); },
      "CUSUM statistic of each stream; 0 without a detector.");
  field("alarm", [](const auto& s) { return s.core.alarm(); }, "Whether the alarm of each stream is on.");
  field("samples", [](const auto& s) { return std::uint64_t{s.samples}; }, "Samples of each stream accepted so far.");
  field("rejected", [](const auto& s) { return std::uint64_t{s.rejected}; }, "Samples of each stream refused so far.");
  const auto standard_error = [](const auto& s) {
    if constexpr (knows_its_error<std::decay_t<decltype(s.core)>>) {
      return standard_error_of(s.core);
    } else {
      throw py::attribute_error("standard_error: got a bank of estimators without it, allowed: HandoverRls");
      return s.core.ratio();
    }
  };
  field("standard_error", standard_error,
        "Standard deviation of the ratio of each stream, of HandoverRls only; nan where it is not known.");
}
