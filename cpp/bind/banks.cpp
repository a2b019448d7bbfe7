// SPDX-License-Identifier: MIT
// Bank: many estimators of one kind, a sample of each at a time.

#include <algorithm>
#include <memory>

#include "constructors.hpp"
#include "estimator.hpp"
#include "estimator_kinds.hpp"
#include "pickling.hpp"

namespace {

constexpr auto class_doc = R"(Bank(estimator, streams)
--

Independent estimators for many streams that are sampled together.

Parameters
----------
estimator : Rls, AdaptiveRls, HandoverRls, or one of them in float32
    Every stream begins as a copy of it, with its settings and its state.
streams : int, 1 <= streams <= 2**32
    Number of streams.

Raises
------
TypeError, ValueError
    Something else as estimator; a number of streams that is not allowed.

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

constexpr auto update_doc = R"(update($self, output, regressor, out=None)
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

constexpr auto process_doc = R"(process($self, output, regressor, out=None)
--

Take a block of samples of each stream; the same bits as one `update` for each row.

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

Raises
------
TypeError, ValueError, RuntimeError
    As `update`.
)";

enum class Field { ratio, covariance, innovation, statistic, standard_error, alarm, samples, rejected };

/// The estimators of a bank, of whatever kind.
class Streams {
 public:
  virtual ~Streams() = default;
  virtual py::ssize_t size() const = 0;
  virtual py::object estimator(py::ssize_t stream) const = 0;
  virtual void set(py::ssize_t stream, py::handle estimator) = 0;
  virtual void reset() = 0;
  virtual py::object values(Field field) const = 0;
  virtual py::object take(bool is_block, const py::object& output, const py::object& regressor, const py::object& out,
                          bool& busy) = 0;
};

template <class Kind>
class StreamsOf final : public Streams {
  using E = Estimator<Kind>;
  using State = typename E::State;
  using Real = typename E::Real;

 public:
  StreamsOf(const E& estimator, std::size_t streams)
      : settings_(estimator.settings()), states_(streams, estimator.numbers()) {}

  py::ssize_t size() const override { return static_cast<py::ssize_t>(states_.size()); }
  py::object estimator(py::ssize_t stream) const override {
    return py::cast(E(settings_, states_[static_cast<std::size_t>(stream)]));
  }
  void set(py::ssize_t stream, py::handle estimator) override {
    const E& given = methods::reference<E>(estimator);
    if (!(given.settings() == settings_)) {
      throw py::value_error("pickled state: got estimators of different settings, allowed: the same of all");
    }
    states_[static_cast<std::size_t>(stream)] = given.numbers();
  }
  void reset() override { std::fill(states_.begin(), states_.end(), E(settings_).numbers()); }

  py::object values(Field field) const override {
    switch (field) {
      case Field::ratio:
        return each<Real>([](const State& s) { return s.core.ratio(); });
      case Field::covariance:
        return each<Real>([](const State& s) { return s.core.covariance(); });
      case Field::innovation:
        return each<Real>([](const State& s) { return s.innovation; });
      case Field::statistic:
        return each<Real>([](const State& s) { return s.core.statistic(); });
      case Field::alarm:
        return each<bool>([](const State& s) { return s.core.alarm(); });
      case Field::samples:
        return each<std::uint64_t>([](const State& s) { return s.samples; });
      case Field::rejected:
        return each<std::uint64_t>([](const State& s) { return s.rejected; });
      case Field::standard_error:
        break;
    }
    if constexpr (knows_its_error<typename E::Core>) {
      return each<Real>([](const State& s) { return standard_error_of(s.core); });
    } else {
      throw py::attribute_error("standard_error: got a bank of estimators without it, allowed: HandoverRls");
    }
  }

  py::object take(bool is_block, const py::object& output, const py::object& regressor, const py::object& out,
                  bool& busy) override {
    const Shape row{size()}, rows{-1, size()};
    const auto y = samples_of<Real, py::array::c_style>(output, "output", is_block ? rows : row);
    const py::ssize_t frames = is_block ? y.shape(0) : 1;
    const py::array given = real_array(regressor, "regressor");
    const bool is_shared = is_block && given.ndim() == 1;
    const auto x = samples_of<Real, py::array::c_style>(given, "regressor",
                                                        is_shared  ? Shape{frames}
                                                        : is_block ? Shape{frames, size()}
                                                                   : row);
    py::array result =
        output_array(out, py::dtype::of<Real>(), is_block ? Shape{frames, size()} : row, py::array::c_style);
    const auto outputs = apart_from(y, result), regressors = apart_from(x, result);
    require_idle(busy, "bank");  // making arrays of the arguments may have run other Python code
    const InUse in_use(busy);
    auto* ratios = static_cast<Real*>(result.mutable_data());
    const Real *to_explain = outputs.data(), *explains = regressors.data();
    run_block(outputs.size(), [&] {
      for (py::ssize_t frame = 0; frame < frames; ++frame) {
        for (State& state : states_) {
          state.take(*to_explain++, *explains);
          explains += is_shared ? 0 : 1;
          *ratios++ = state.core.ratio();
        }
        explains += is_shared ? 1 : 0;
      }
    });
    return result;
  }

 private:
  template <class Item, class Get>
  py::array_t<Item> each(Get get) const {
    py::array_t<Item> result(size());
    std::transform(states_.begin(), states_.end(), result.mutable_data(), get);
    return result;
  }

  Settings settings_;
  std::vector<State> states_;
};

class PyBank {
 public:
  PyBank(py::handle estimator, py::ssize_t streams) : streams_(made(estimator, checked(streams))) {}
  py::object update(py::handle output, py::handle regressor, py::handle out) {
    return take(false, output, regressor, out);
  }
  py::object process(py::handle output, py::handle regressor, py::handle out) {
    return take(true, output, regressor, out);
  }
  void reset() { idle().reset(); }
  py::object settings() const { return at(py::int_(0)).attr("settings"); }
  py::ssize_t size() const { return streams_->size(); }
  py::object at(py::handle stream) const {
    const py::ssize_t given = methods::to_size("stream", py::reinterpret_borrow<py::object>(stream));
    const py::ssize_t i = given < 0 ? given + size() : given;
    if (i < 0 || i >= size()) {
      throw py::index_error("stream: got " + std::to_string(given) + ", allowed: below " + std::to_string(size()));
    }
    return idle().estimator(i);
  }
  template <Field field>
  py::object values() const {
    return idle().values(field);
  }

  /// Copies of all estimators.
  py::tuple state() const {
    py::list estimators;
    for (py::ssize_t i = 0; i < size(); ++i) {
      estimators.append(idle().estimator(i));
    }
    return py::tuple(estimators);
  }
  static PyBank restored(const py::tuple& estimators) {
    PyBank bank(estimators[0], static_cast<py::ssize_t>(estimators.size()));
    for (py::ssize_t i = 0; i < bank.size(); ++i) {
      bank.streams_->set(i, estimators[static_cast<std::size_t>(i)]);
    }
    return bank;
  }
  bool operator==(const PyBank& other) const { return state().equal(other.state()); }

 private:
  static py::ssize_t checked(py::ssize_t streams) {
    if (streams < 1 || streams > py::ssize_t{1} << 32) {
      throw py::value_error("streams: got " + std::to_string(streams) + ", allowed: 1 <= streams <= 2**32");
    }
    return streams;
  }

  template <class... Kinds>
  static std::unique_ptr<Streams> of_kinds(py::handle estimator, py::ssize_t streams) {
    std::unique_ptr<Streams> found;
    (void)((py::isinstance<Estimator<Kinds>>(estimator) &&
            (found = std::make_unique<StreamsOf<Kinds>>(methods::reference<Estimator<Kinds>>(estimator),
                                                        static_cast<std::size_t>(streams)))) ||
           ...);
    return found;
  }
  static std::unique_ptr<Streams> made(py::handle estimator, py::ssize_t streams) {
    auto found = of_kinds<FixedKind<double>, FixedKind<float>, AdaptiveKind<double>, AdaptiveKind<float>,
                          HandoverKind<double>, HandoverKind<float>>(estimator, streams);
    if (!found) {
      throw py::type_error("estimator: got " + py::repr(estimator).cast<std::string>() +
                           ", allowed: an Rls, AdaptiveRls or HandoverRls, for example palpate.HandoverRls()");
    }
    return found;
  }

  Streams& idle() const {
    require_idle(busy_, "bank");
    return *streams_;
  }
  py::object take(bool is_block, py::handle output, py::handle regressor, py::handle out) {
    const auto kept = [](py::handle given) { return py::reinterpret_borrow<py::object>(given); };
    return idle().take(is_block, kept(output), kept(regressor), kept(out), busy_);
  }

  std::unique_ptr<Streams> streams_;
  bool busy_ = false;
};

py::tuple pickled_bank(py::handle self) {
  return py::make_tuple(methods::reference<PyBank>(self).state(), py::getattr(self, "__dict__", py::dict()));
}
PyBank unpickled_bank(py::handle self, py::handle state) {
  return of_pickled(state, [&](const py::tuple& given) {
    PyBank bank = PyBank::restored(given[0].cast<py::tuple>());
    if (const auto own = given[1].cast<py::dict>(); !own.empty()) {
      py::setattr(self, "__dict__", own);
    }
    return bank;
  });
}

std::string repr(const PyBank& bank) {
  const auto kind = py::type::of(bank.at(py::int_(0))).attr("__name__").cast<std::string>();
  return "<Bank of " + std::to_string(bank.size()) + " " + kind + ">";
}

PyObject* init(PyObject* self, PyObject* const* arguments, Py_ssize_t count, PyObject* keywords) {
  static const methods::Parameters parameters("__init__($self, estimator, streams)\n--");
  return methods::guarded([&] {
    const auto places = static_cast<std::size_t>(PyVectorcall_NARGS(static_cast<std::size_t>(count)));
    const auto given = parameters.in_order<2>(arguments, places, keywords);
    methods::construct<PyBank>(self, [&] {
      return PyBank(given[0], methods::to_size("streams", py::reinterpret_borrow<py::object>(given[1])));
    });
    Py_RETURN_NONE;
  });
}

}  // namespace

void bind_banks(py::module_& module) {
  py::class_<PyBank> type(module, "Bank", class_doc);
  type.attr("__module__") = "palpate";
  auto& constructor = methods::definition("__init__($self, estimator, streams)\n--\n\n", methods::as_method(&init),
                                          METH_FASTCALL | METH_KEYWORDS);
  methods::add(type, "__init__", PyDescr_NewMethod(reinterpret_cast<PyTypeObject*>(type.ptr()), &constructor));
  methods::define<&PyBank::update>(type, update_doc);
  methods::define<&PyBank::process>(type, process_doc);
  methods::define<&PyBank::reset>(type, "reset($self)\n--\n\nForget all samples; the settings stay.");
  methods::define<&PyBank::size>(type, "__len__($self, /)\n--\n\n");
  methods::define<&PyBank::at>(type, "__getitem__($self, stream, /)\n--\n\nA copy of the estimator of a stream.");
  methods::define<&repr>(type, "__repr__($self, /)\n--\n\n");
  define_copies<&pickled_bank, &unpickled_bank>(type);
  methods::property<&PyBank::size>(type, "streams", "Number of streams.");
  methods::property<&PyBank::settings>(type, "settings", "The parameters of all estimators, as a dict.");
  methods::property<&PyBank::values<Field::ratio>>(type, "ratio", "Estimated output / regressor of each stream.");
  methods::property<&PyBank::values<Field::covariance>>(type, "covariance",
                                                        "Unscaled covariance of each stream, 1/pF^2.");
  methods::property<&PyBank::values<Field::innovation>>(
      type, "innovation", "A-priori error of the last accepted sample of each stream, pF; nan before the first.");
  methods::property<&PyBank::values<Field::statistic>>(type, "statistic",
                                                       "CUSUM statistic of each stream; 0 without a detector.");
  methods::property<&PyBank::values<Field::standard_error>>(
      type, "standard_error",
      "Standard deviation of the ratio of each stream, of HandoverRls only; nan where it is not known.");
  methods::property<&PyBank::values<Field::alarm>>(type, "alarm", "Whether the alarm of each stream is on.");
  methods::property<&PyBank::values<Field::samples>>(type, "samples", "Samples of each stream accepted so far.");
  methods::property<&PyBank::values<Field::rejected>>(type, "rejected", "Samples of each stream refused so far.");
}
