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

constexpr auto bank_doc =
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

constexpr auto bank_process_doc = R"(process(self, /, output, regressor, out=None)
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
  using E = Estimator<Kind>;
  using Real = typename E::Real;
  Settings settings;
  std::vector<typename E::State> states;

  py::ssize_t size() const { return static_cast<py::ssize_t>(states.size()); }
  py::object at(py::ssize_t stream) const { return py::cast(E(settings, states.data()[stream])); }
  void set(std::size_t stream, py::handle estimator) { states[stream] = estimator.cast<const E&>().numbers(); }
  void reset() { std::fill(states.begin(), states.end(), E(settings).numbers()); }
  py::array array_of(const py::list& values) const { return py::array_t<Real>(values); }

  py::object take(bool is_block, const py::object& output, const py::object& regressor, const py::object& out,
                  Busy& busy) {
    constexpr int dense = py::array::c_style;
    const py::ssize_t streams = size(), width = states[0].core.width();
    const py::array y = samples_of<Real, dense>(output, "output", axes({is_block ? -1 : no_axis, streams}));
    const py::ssize_t frames = is_block ? y.shape(0) : no_axis;
    const py::array given = real_array(regressor, "regressor");
    const bool is_shared = is_block && given.ndim() == 1 + Kind::Core::is_vector;
    const py::array x =
        samples_of<Real, dense>(given, "regressor", axes({frames, is_shared ? no_axis : streams, width}));
    py::array result =
        output_array(out, once<&py::dtype::of<Real>>(), axes({frames, streams, states[0].core.count()}), dense);
    const py::array outputs = apart_from(y, result), regressors = apart_from(x, result);
    const std::lock_guard in_use(busy);
    auto* to = static_cast<Real*>(result.mutable_data());
    auto *to_explain = static_cast<const Real*>(outputs.data()),
         *explains = static_cast<const Real*>(regressors.data());
    const Real* const end = to_explain + outputs.size();
    const py::ssize_t next = Kind::Core::is_vector ? width : 1;
    run_block(outputs.size(), [&] {
      while (to_explain != end) {
        for (auto& state : states) {
          state.take(*to_explain++, explains);
          to = state.core.write(to);
          explains += is_shared ? 0 : next;
        }
        explains += is_shared ? next : 0;
      }
    });
    return std::move(result);
  }
};

template <class... Kinds>
class BankOf {
 public:
  BankOf(py::handle estimator, py::ssize_t streams) {
    if (streams < 1 || streams > py::ssize_t{1} << 32) {
      refuse<value_error>("streams", streams, "1 <= streams <= 2**32");
    }
    if (!(make<Kinds>(estimator, static_cast<std::size_t>(streams)) || ...)) {
      refuse<type_error>("estimator", shown(estimator),
                         "an Rls, AdaptiveRls, HandoverRls or VectorRls, for example palpate.HandoverRls()");
    }
  }

  /// Pickled as copies of all its estimators.
  py::tuple pickled() const { return py::make_tuple(estimators()); }
  static BankOf restored(const py::tuple& state) {
    const py::tuple estimators = state[0];
    BankOf bank(estimators[0], static_cast<py::ssize_t>(estimators.size()));
    for (std::size_t i = 0; i < estimators.size(); ++i) {
      std::visit([&](auto& streams) { streams.set(i, estimators[i]); }, bank.streams_);
    }
    return bank;
  }

  template <bool is_block>
  py::object take(const py::object& output, const py::object& regressor, const py::object& out) {
    return std::visit([&](auto& bank) { return bank.take(is_block, output, regressor, out, busy_); }, streams_);
  }
  void reset() {
    busy_.require_idle();
    std::visit([](auto& bank) { bank.reset(); }, streams_);
  }
  py::ssize_t size() const {
    return std::visit([](const auto& bank) { return bank.size(); }, streams_);
  }
  py::object at(py::handle stream) const {
    const py::ssize_t given = to_size(stream, "stream"), i = given < 0 ? given + size() : given;
    if (i < 0 || i >= size()) {
      refuse<py::index_error>("stream", given, "below " + std::to_string(size()));
    }
    return of([&](const auto& bank) { return bank.at(i); });
  }
  py::tuple estimators() const {
    py::list all;
    for (py::ssize_t i = 0; i < size(); ++i) {
      all.append(at(py::int_(i)));
    }
    return py::tuple(all);
  }
  bool operator==(const BankOf& other) const { return estimators().equal(other.estimators()); }

  /// An array of the attribute of all estimators.
  py::array attribute(const char* name, const char* owners) const {
    py::list values;
    for (const py::handle estimator : estimators()) {
      if (!py::hasattr(estimator, name)) {
        refuse<py::attribute_error>(name, "a bank of estimators without it", owners);
      }
      values.append(estimator.attr(name));
    }
    return of([&](const auto& bank) { return bank.array_of(values); });
  }
  /// An array of what get(state) gives for each stream.
  template <class Get>
  py::array each(Get get) const {
    return of([&](const auto& bank) -> py::array {
      py::array_t<decltype(get(bank.states[0]))> result(size());
      std::transform(bank.states.begin(), bank.states.end(), result.mutable_data(), get);
      return result;
    });
  }

 private:
  /// What get(streams) gives.
  template <class Get>
  auto of(Get get) const {
    busy_.require_idle();
    return std::visit(get, streams_);
  }
  /// False: the estimator is of another kind.
  template <class Kind>
  bool make(py::handle estimator, std::size_t streams) {
    const bool fits = py::isinstance<Estimator<Kind>>(estimator);
    if (fits) {
      const auto& given = estimator.cast<const Estimator<Kind>&>();
      streams_ = Streams<Kind>{given.settings(), std::vector(streams, given.numbers())};
    }
    return fits;
  }

  std::variant<Streams<Kinds>...> streams_;
  Busy busy_{"bank"};
};

using Bank = BankOf<FixedKind<double>, FixedKind<float>, AdaptiveKind<double>, AdaptiveKind<float>, WindowKind<double>,
                    WindowKind<float>, VectorKind>;

std::string repr(const Bank& bank) {
  const auto kind = text_of(py::type::of(bank.at(py::int_(0))).attr("__name__"));
  return "<Bank of " + std::to_string(bank.size()) + " " + kind + ">";
}

}  // namespace

void bind_banks(py::module_& module) {
  const auto made = [](py::handle estimator, py::handle streams) {
    return Bank(estimator, to_size(streams, "streams"));
  };
  const auto output = py::arg("output"), regressor = py::arg("regressor");
  const auto out = py::arg("out") = py::none();
  auto type = define_class<Bank>(module, "Bank", "(estimator, streams)", bank_doc, made, py::arg("estimator"),
                                 py::arg("streams"));
  define_copies(type);
  type.def("update", &Bank::take<false>, output, regressor, out, R"(update(self, /, output, regressor, out=None)
--

Take one sample of each stream and return their ratios, shape (streams,).

As `process` for one row, the shapes without n: output and regressor (streams,), of VectorRls regressors (streams, size).)")
      .def("process", &Bank::take<true>, output, regressor, out, bank_process_doc)
      .def("reset", &Bank::reset, reset_doc)
      .def("__len__", &Bank::size, "__len__(self, /)\n--\n\n")
      .def("__getitem__", &Bank::at, "__getitem__(self, stream, /)\n--\n\nA copy of the estimator of a stream.")
      .def("__repr__", &repr, "__repr__(self, /)\n--\n\n");
  type.property("streams", &Bank::size, "Number of streams.")
      .property(
          "settings", [](const Bank& bank) { return py::object(bank.at(py::int_(0)).attr("settings")); },
          "The parameters of all estimators, as a dict.");
  const auto add = [&](const char* name, auto get, const std::string& doc) {
    const auto each = [get](const Bank& bank) { return bank.each(get); };
    type.property(name, each, doc + " An array, of each stream.");
  };
  visit_counts(add);
  const auto attribute = [&](const char* name, const char* owners) {
    type.property(
        name, [=](const Bank& bank) { return bank.attribute(name, owners); },
        std::string("Of ") + owners + ", as there: an array, of each stream.");
  };
  attribute("ratio", "Rls, AdaptiveRls and HandoverRls");
  attribute("covariance", "all estimators");
  attribute("standard_error", "HandoverRls");
  for (const char* name : {"coefficients", "standard_errors", "degrees_of_freedom"}) {
    attribute(name, "VectorRls");
  }
}
