// SPDX-License-Identifier: MIT
// Bank: many estimators of one kind, a sample of each at a time.

#include <algorithm>
#include <utility>
#include <variant>
#include <vector>

#include "estimator.hpp"
#include "estimator_kinds.hpp"
#include "vectors.hpp"

namespace {

constexpr auto class_doc =
    R"(Independent estimators for many streams that are sampled together: the bits of as many single ones.

Parameters
----------
estimator : Rls, AdaptiveRls, HandoverRls, VectorRls, or one of them in float32
    Every stream begins as a copy of it, with its settings and its state.
streams : int, 1 <= streams <= 2**32
    Number of streams; `bank[i]` is a copy of the estimator of one.

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

Take one sample of each stream and return their ratios; errors as of `AdaptiveRls.process`.

Parameters
----------
output, regressor : array_like of real numbers, shape (streams,), of VectorRls regressors (streams, size)
out : numpy.ndarray, shape (streams,), contiguous, optional
    Where the ratios are written; it may be `output` or `regressor` itself.

Returns
-------
numpy.ndarray, shape (streams,)
    The ratios. A sample that is not finite is refused, and counted in `rejected`.
)";

constexpr auto process_doc = R"(process(self, /, output, regressor, out=None)
--

Take a block of samples of each stream; the same bits as one `update` for each row, and the same errors.

Parameters
----------
output : array_like of real numbers, shape (n, streams), pF
    Read in place where it is contiguous and of the bank's own type.
regressor : array_like of real numbers, shape (n, streams), or (n,) for all streams; of VectorRls with a last axis of size
out : numpy.ndarray, shape (n, streams), contiguous, optional
    Where the ratios are written; it may be `output` or `regressor` itself.

Returns
-------
numpy.ndarray, shape (n, streams)
    The ratios after each row.
)";

/// The estimators of a bank, of one kind.
template <class Kind>
struct Streams {
  static constexpr bool is_vector = std::is_same_v<Kind, VectorKind>;
  using E = std::conditional_t<is_vector, VectorEstimator, Estimator<Kind>>;
  using Real = typename E::Real;
  Settings settings;
  std::vector<typename E::State> states;

  py::object at(py::ssize_t stream) const { return py::cast(E(settings, states[static_cast<std::size_t>(stream)])); }
  void reset() { std::fill(states.begin(), states.end(), E(settings).numbers()); }

  /// Take a sample of a stream, and write the results where the returned place ends.
  static Real* take(typename E::State& state, Real output, const Real* regressors, Real* to) {
    if constexpr (is_vector) {
      state.take(output, regressors);
      return std::copy_n(state.core.coefficients(), state.core.coefficient_count(), to);
    } else {
      state.take(output, *regressors);
      *to = state.core.ratio();
      return to + 1;
    }
  }

  py::object take(bool is_block, const py::object& output, const py::object& regressor, const py::object& out,
                  bool& busy) {
    constexpr int dense = py::array::c_style;
    const auto streams = static_cast<py::ssize_t>(states.size());
    py::ssize_t width = 1, count = 1;  // of the regressors and of the results of a stream
    if constexpr (is_vector) {
      width = static_cast<py::ssize_t>(states[0].core.size());
      count = static_cast<py::ssize_t>(states[0].core.coefficient_count());
    }
    // (frames, streams, last), without the axes that are not there.
    const auto shape = [&](py::ssize_t frames, bool each, py::ssize_t last) {
      Shape lengths;
      for (const auto& [axis, length] : {std::pair(is_block, frames), {each, streams}, {is_vector && last > 0, last}}) {
        if (axis) {
          lengths.push_back(length);
        }
      }
      return lengths;
    };
    const py::array y = samples_of<Real, dense>(output, "output", shape(-1, true, 0));
    const py::ssize_t frames = is_block ? y.shape(0) : 1;
    const py::array given = real_array(regressor, "regressor");
    const bool is_shared = is_block && given.ndim() == 1 + is_vector;
    const py::array x = samples_of<Real, dense>(given, "regressor", shape(frames, !is_shared, width));
    py::array result = output_array(out, once<&py::dtype::of<Real>>(), shape(frames, true, count), dense);
    const py::array outputs = apart_from(y, result), regressors = apart_from(x, result);
    require_idle(busy, "bank");  // making arrays of the arguments may have run other Python code
    const InUse in_use(busy);
    auto* to = static_cast<Real*>(result.mutable_data());
    auto *to_explain = static_cast<const Real*>(outputs.data()),
         *explains = static_cast<const Real*>(regressors.data());
    run_block(outputs.size(), [&] {
      for (py::ssize_t frame = 0; frame < frames; ++frame) {
        for (auto& state : states) {
          to = take(state, *to_explain++, explains, to);
          explains += is_shared ? 0 : width;
        }
        explains += is_shared ? width : 0;
      }
    });
    return std::move(result);
  }
};

class Bank {
 public:
  Bank(py::handle estimator, py::ssize_t streams) {
    if (streams < 1 || streams > py::ssize_t{1} << 32) {
      throw py::value_error("streams: got " + std::to_string(streams) + ", allowed: 1 <= streams <= 2**32");
    }
    const bool found = choose(estimator, static_cast<std::size_t>(streams), streams_);
    if (!found) {
      throw py::type_error(
          "estimator: got " + methods::shown(estimator) +
          ", allowed: an Rls, AdaptiveRls, HandoverRls or VectorRls, for example palpate.HandoverRls()");
    }
  }
  /// Of copies of all its estimators.
  explicit Bank(const py::tuple& estimators) : Bank(estimators[0], static_cast<py::ssize_t>(estimators.size())) {
    const auto set = [&](auto& bank) {
      for (std::size_t i = 0; i < estimators.size(); ++i) {
        bank.states[i] = estimators[i].template cast<const typename std::decay_t<decltype(bank)>::E&>().numbers();
      }
    };
    std::visit(set, streams_);
  }

  /// Of the bank's own type.
  py::array array_of(const py::list& values) const {
    const auto make = [&](const auto& bank) -> py::array {
      return py::array_t<typename std::decay_t<decltype(bank)>::Real>(values);
    };
    return std::visit(make, streams_);
  }

  template <bool is_block>
  py::object take(const py::object& output, const py::object& regressor, const py::object& out) {
    require_idle(busy_, "bank");
    return std::visit([&](auto& bank) { return bank.take(is_block, output, regressor, out, busy_); }, streams_);
  }
  void reset() {
    require_idle(busy_, "bank");
    std::visit([](auto& bank) { bank.reset(); }, streams_);
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
    return std::visit([&](const auto& bank) { return bank.at(i); }, streams_);
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
  template <class... Kinds>
  static bool choose(py::handle estimator, std::size_t streams, std::variant<Streams<Kinds>...>& chosen) {
    const auto is_of = [&](auto* kind) {
      using Chosen = std::remove_pointer_t<decltype(kind)>;
      const bool found = py::isinstance<typename Chosen::E>(estimator);
      if (found) {
        const auto& given = estimator.cast<const typename Chosen::E&>();
        chosen = Chosen{given.settings(), std::vector(streams, given.numbers())};
      }
      return found;
    };
    return (is_of(static_cast<Streams<Kinds>*>(nullptr)) || ...);
  }

  std::variant<Streams<FixedKind<double>>, Streams<FixedKind<float>>, Streams<AdaptiveKind<double>>,
               Streams<AdaptiveKind<float>>, Streams<HandoverKind<double>>, Streams<HandoverKind<float>>,
               Streams<VectorKind>>
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
  type.def("update", &Bank::take<false>, output, regressor, out, update_doc)
      .def("process", &Bank::take<true>, output, regressor, out, process_doc)
      .def("reset", &Bank::reset, "reset(self, /)\n--\n\nForget all samples; the settings stay.")
      .def("__len__", &Bank::size, "__len__(self, /)\n--\n\n")
      .def("__getitem__", &Bank::at, "__getitem__(self, stream, /)\n--\n\nA copy of the estimator of a stream.")
      .def("__repr__", &repr, "__repr__(self, /)\n--\n\n")
      .def(py::pickle(pickled, restored))
      .def_property_readonly("streams", &Bank::size, "Number of streams.")
      .def_property_readonly(
          "settings", [](const Bank& bank) { return py::object(bank.at(py::int_(0)).attr("settings")); },
          "The parameters of all estimators, as a dict.");
  const auto add = [&](const char* name, auto get, const std::string& doc) {
    const auto each = [get](const Bank& bank) { return bank.each(get); };
    type.def_property_readonly(name, each, (doc + " An array, of each stream.").c_str());
  };
  visit_counts(add);
  const auto attribute = [&](const char* name, const char* owners) {
    const auto get = [=](const Bank& bank) {
      py::list values;
      for (const py::handle estimator : bank.estimators()) {
        if (!py::hasattr(estimator, name)) {
          throw py::attribute_error(std::string(name) + ": got a bank of estimators without it, allowed: " + owners);
        }
        values.append(estimator.attr(name));
      }
      return bank.array_of(values);
    };
    const std::string doc = std::string("Of ") + owners + ", as there: an array, of each stream.";
    type.def_property_readonly(name, get, doc.c_str());
  };
  const auto scalars = "Rls, AdaptiveRls and HandoverRls";
  attribute("ratio", scalars);
  attribute("covariance", "all estimators");
  attribute("standard_error", "HandoverRls");
  for (const char* name : {"coefficients", "standard_errors", "degrees_of_freedom"}) {
    attribute(name, "VectorRls");
  }
}
