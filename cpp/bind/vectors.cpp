// SPDX-License-Identifier: MIT
#include "vectors.hpp"

namespace {

constexpr auto class_doc =
    R"(Recursive least squares for several coefficients, output = coefficients @ regressors + noise.

Parameters
----------
size : int
    Number of regressors, 1 to 8, or to 7 with an intercept.
intercept : bool
    A last coefficient that is a constant.
steady : float, 0 < steady <= 1
    Forgetting factor; the memory is about 2 / (1 - steady) samples.
drift, threshold : float, standard deviations
    Of the CUSUM on the innovations, a two-sided one for each coefficient.
clip : float, standard deviations
    The detector limits a larger innovation to this; the coefficients leave it out.
alarmed : float, 0 <= alarmed <= steady
    0: at an alarm the coefficients are computed again from the samples since the change, at most 32. Otherwise the
    forgetting factor during an alarm, as in `AdaptiveRls`, and no sample is left out.
initial_covariance : float, 1/regressor^2
    Of the coefficients before the first sample, which are 0; the default says nothing about them.
max_covariance : float, 1/regressor^2
    Bound on the covariance in each direction: without excitation a coefficient stays as it is.

Notes
-----
Without a prior the coefficients are those of least squares with the weights steady**age, from the first sample on. They
are computed by square-root-free Givens rotations (Gentleman 1973): the error grows with the condition of the regressors,
not with its square. A coefficient that the samples do not determine stays, with the standard error nan.
`coefficients` +- t `standard_errors` is an interval, with t the quantile of Student's distribution for
`degrees_of_freedom` (`scipy.stats.t.ppf(0.975, ...)`); it takes the noise for white. Any units, from 1e-139 on.

Examples
--------
>>> import palpate
>>> line = palpate.VectorRls(1, intercept=True)
>>> for x, y in [(1.0, 3.0), (2.0, 5.0), (3.0, 7.0)]:
...     innovation = line.update(y, (x,))
>>> line.coefficients.round(9)
array([2., 1.])
)";

constexpr auto update_doc = R"(update($self, output, regressors, /)
--

Take one sample and return its innovation.

Parameters
----------
output : float
regressors : sequence of float, or numpy.ndarray, shape (size,)
    Positional only, both.

Returns
-------
float
    Output minus its prediction with the coefficients before. A sample that is not finite, or too large (1e139 is not), is
    refused: the state stays, and `rejected` counts it.
)";
constexpr auto process_doc = R"(process(self, /, output, regressors, out=None)
--

Take a block of samples; the same bits as one `update` for each.

Parameters
----------
output : array_like of real numbers, shape (n,)
regressors : array_like of real numbers, shape (n, size)
out : numpy.ndarray, shape (n, size), or (n, size + 1) with an intercept, contiguous, optional
    Where the coefficients are written.

Returns
-------
numpy.ndarray, of the shape of `out`
    The coefficients after each sample.
)";
constexpr auto trace_doc = R"(trace(self, /, output, regressors, out=None)
--

Take a block of samples and return the whole state after each; parameters and errors as of `process`.

Returns
-------
numpy.ndarray, shape (n,), structured
    `coefficients` and `standard_errors`, each of as many numbers; `innovation` (nan in the row of a refused sample);
    `statistic`; `alarm`.
)";

/// The numbers of a tuple, a list, an array, or of anything else that numpy makes an array of.
AnyVector::Numbers values_of(py::handle given, std::size_t size) {
  AnyVector::Numbers values;
  const auto length = static_cast<py::ssize_t>(size);
  if (PyTuple_CheckExact(given.ptr()) && PyTuple_GET_SIZE(given.ptr()) == length) {
    for (std::size_t i = 0; i < size; ++i) {
      values[i] = methods::real_of(PyTuple_GET_ITEM(given.ptr(), static_cast<py::ssize_t>(i)), "regressors");
    }
    return values;
  }
  const auto copy = [&](const View<const double>& view) {
    for (std::size_t i = 0; i < size; ++i) {
      values[i] = view[static_cast<py::ssize_t>(i)];
    }
    return values;
  };
  return is_plain<double>(given, length) ? copy(View<const double>(py::reinterpret_borrow<py::array>(given)))
                                         : copy(View<const double>(samples_of<double>(
                                               py::reinterpret_borrow<py::object>(given), "regressors", {length})));
}

double update(PyObject* self, PyObject* const* given, Py_ssize_t count) {
  if (count != 2) {
    throw py::type_error("takes exactly an output and regressors (" + std::to_string(count) + " given)");
  }
  return methods::object_of<VectorEstimator>(self).update(given[0], given[1]);
}

py::array numbers(const double* values, const AnyVector& core) {
  return py::array_t<double>(static_cast<py::ssize_t>(core.coefficient_count()), values);
}

py::object row_dtype(std::size_t count) {
  const py::dtype real = py::dtype::of<double>();
  py::list fields;
  for (const char* vector : {"coefficients", "standard_errors"}) {
    fields.append(py::make_tuple(vector, real, py::make_tuple(count)));
  }
  for (const char* number : {"innovation", "statistic"}) {
    fields.append(py::make_tuple(number, real));
  }
  fields.append(py::make_tuple("alarm", py::dtype::of<bool>()));
  return py::module_::import("numpy").attr("dtype")(fields, py::arg("align") = true);
}

}  // namespace

template <std::size_t... I>
AnyVector::Cores AnyVector::made(const Settings& s, std::index_sequence<I...>) {
  const palpate::Kept<palpate::VectorSettings<double>> kept{s.values<palpate::VectorSettings<double>>()};
  Cores cores;
  const auto index = static_cast<std::size_t>(s["size"] + s["intercept"]) - 1;
  ((index == I ? void(cores.emplace<I>(kept, s["initial_covariance"])) : void()), ...);
  return cores;
}

AnyVector::AnyVector(const Settings& s)
    : size_(static_cast<std::size_t>(s["size"])),
      intercept_(s["intercept"] != 0),
      core_(made(s, std::make_index_sequence<most>())) {}

Settings VectorKind::defaults() {
  using V = palpate::VectorSettings<double>;
  Settings settings;
  settings.add("size", 1);
  settings.add("intercept", 0);
  settings.add_fields<V>(false);
  settings.add("initial_covariance", palpate::VectorRls<double, 1>::default_covariance);
  settings.add_fields<V>(true);
  return settings;
}

void VectorKind::check(const Settings& s) {
  const double most = s["intercept"] != 0 ? 7 : 8;
  require(s["size"] <= most, "size", s["size"], most == 8 ? "1 to 8" : "1 to 7 with an intercept");
  s.check<palpate::VectorSettings<double>>();
  check_covariance<double>(s);
}

double VectorEstimator::update(py::handle output, py::handle regressors) {
  require_idle(busy_, "estimator");
  const double y = methods::real_of(output.ptr(), "output");
  const AnyVector::Numbers values = values_of(regressors, state_.core.size());
  require_idle(busy_, "estimator");  // a number's own code may have run
  return state_.take(y, values.data()).innovation;
}

py::object VectorEstimator::process(const py::object& output, const py::object& regressors, const py::object& out) {
  const auto write = [](double* to, const AnyVector& core, const auto&) {
    std::copy_n(core.coefficients(), core.coefficient_count(), to);
  };
  const auto columns = static_cast<py::ssize_t>(state_.core.coefficient_count());
  return block<double, true>(output, regressors, out, once<&py::dtype::of<double>>(),
                             {-1, static_cast<py::ssize_t>(state_.core.size())}, {-1, columns}, write);
}

py::object VectorEstimator::trace(const py::object& output, const py::object& regressors, const py::object& out) {
  const auto write = [](double* to, const AnyVector& core, const auto& step) {
    const std::size_t count = core.coefficient_count();
    to = std::copy_n(core.coefficients(), count, to);
    to = std::copy_n(core.standard_errors().begin(), count, to);
    *to++ = step.accepted ? step.innovation : std::numeric_limits<double>::quiet_NaN();
    *to++ = core.statistic();
    *to = 0;  // the padding, too
    std::memset(to, core.alarm(), 1);
  };
  const auto dtype = row_dtype(state_.core.coefficient_count()).cast<py::dtype>();
  return block<double, true>(output, regressors, out, dtype, {-1, static_cast<py::ssize_t>(state_.core.size())}, {-1},
                             write);
}

void bind_vectors(py::module_& module) {
  using E = VectorEstimator;
  const auto made = [](const py::args& places, const py::kwargs& given) {
    const Settings named = VectorKind::defaults().with("VectorRls", given);
    if (places.size() + given.contains("size") != 1) {
      throw py::type_error("VectorRls: got " + std::to_string(places.size()) +
                           " values without a name, allowed: size; the others by name");
    }
    const Settings settings = places.empty() ? named : named.with("VectorRls", py::dict(py::arg("size") = places[0]));
    VectorKind::check(settings);
    return E(settings);
  };
  std::string parameters = VectorKind::defaults().text();
  parameters = "(size, *, intercept=False" + parameters.substr(parameters.find(", steady")) + ")";
  auto type = methods::define_class<E>(module, "VectorRls", parameters, class_doc, made);
  methods::define_fast<&update>(type, "update", update_doc);
  define_estimator(type, process_doc, trace_doc, "regressors");
  const auto add = [&](const char* name, auto get, const char* doc) { define_number(type, name, get, doc); };
  visit_counts(add);
  add(
      "coefficients", [](const auto& s) { return numbers(s.core.coefficients(), s.core); },
      "Estimates, shape (size,), or (size + 1,) with the intercept last.");
  add(
      "covariance",
      [](const auto& s) {
        const auto count = static_cast<py::ssize_t>(s.core.coefficient_count());
        py::array_t<double> matrix({count, count});
        for (py::ssize_t c = 0; c < count; ++c) {
          std::copy_n(s.core.covariance(static_cast<int>(c)).begin(), count, matrix.mutable_data(c, 0));
        }
        return matrix;
      },
      "Unscaled covariance P, square, 1/regressor^2: for noise of variance 1 and without forgetting.");
  add(
      "standard_errors", [](const auto& s) { return numbers(s.core.standard_errors().data(), s.core); },
      "Standard deviations of the coefficients; nan before size + 4 samples, also after a change, and of a coefficient "
      "that the samples do not determine.");
  add(
      "degrees_of_freedom", [](const auto& s) { return s.core.degrees_of_freedom(); },
      "Of `standard_errors`, for Student's t; 0 while they are nan.");
}
