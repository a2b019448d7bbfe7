// SPDX-License-Identifier: MIT
#include "vectors.hpp"

namespace {

constexpr auto vector_doc =
    R"(Recursive least squares for several coefficients, output = coefficients @ regressors + noise.

Parameters
----------
size : int
    Number of regressors, 1 to 8, or to 7 with an intercept.
intercept : bool
    A last coefficient that is a constant.
false_alarm_interval, smallest_shift : float
    As in `HandoverRls`; the interval is that of all coefficients together.
steady : float, 0 < steady <= 1
    Forgetting factor; the memory is about 2 / (1 - steady) samples.
clip : float, standard deviations, 1 to 100
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
not with its square. A coefficient that the samples do not determine has the standard error nan: of regressors that are
combinations of each other one at least.
`coefficients` +- t `standard_errors` is an interval, with t the quantile of Student's distribution for
`degrees_of_freedom` (`scipy.stats.t.ppf(0.975, ...)`). Noise may be correlated: with r the correlation of the changes that
two samples in a row make in a coefficient, if it is above 0, the variance is multiplied by (1 + r) / (1 - r). The detector
whitens the innovations, learns their size only while it suspects no change, and gives no alarm if other coefficients do not
explain the samples significantly better (F test): then the noise has grown. Any units, from 1e-139 on.

Examples
--------
>>> import palpate
>>> line = palpate.VectorRls(1, intercept=True)
>>> for x, y in [(1.0, 3.0), (2.0, 5.0), (3.0, 7.0)]:
...     innovation = line.update(y, (x,))
>>> line.coefficients.round(9)
array([2., 1.])
)";

constexpr auto vector_update_doc = R"(update($self, output, regressors, /)
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
constexpr auto predict_doc = R"(predict($self, regressors, /)
--

Return the output that regressors predict, and the standard error of this prediction.

Parameters
----------
regressors : sequence of float, or numpy.ndarray, shape (size,)
    Positional only.

Returns
-------
value, standard_error : float
    value = coefficients @ regressors (and the intercept). standard_error = sqrt(x' C x), with x the regressors (and 1) and C
    the variances and covariances of the coefficients, so it is not the sum of their standard errors. It is that of the mean
    output: the noise of a single output comes on top. For Student's t with `degrees_of_freedom`. nan before size + 4 samples,
    also after a change, and where the samples do not determine the prediction; regressors that are combinations of each
    other have one for the same combination.
)";
constexpr auto vector_process_doc = R"(process(self, /, output, regressors, out=None)
--

Take a block of samples; the same bits as one `update` for each.

Parameters
----------
output, regressors : array_like of real numbers, shape (n,) and (n, size); for size 1 both (n,), too
out : numpy.ndarray, contiguous, optional
    Where the coefficients are written.

Returns
-------
numpy.ndarray, shape (n, size), or (n, size + 1) with an intercept
    The coefficients after each sample; `out` if it was given.
)";
constexpr auto vector_trace_doc = R"(trace(self, /, output, regressors, out=None)
--

Take a block of samples and return the whole state after each; parameters and errors as of `process`.

Returns
-------
numpy.ndarray, shape (n,), structured
    `coefficients` and `standard_errors`, each of as many numbers; `innovation` (nan in the row of a refused sample);
    `statistic`; `alarm`.
)";

using Vector = Estimator<VectorKind>;

/// The numbers of a tuple, a list, an array, or of anything else that numpy makes an array of.
AnyVector::Numbers values_of(PyObject* given, py::ssize_t size) {
  AnyVector::Numbers values;
  const bool has_items = PyTuple_CheckExact(given) || PyList_CheckExact(given);
  py::ssize_t i = 0;
  for (; has_items && i < size && PySequence_Fast_GET_SIZE(given) == size; ++i) {  // float(item) may change a list
    values.data()[i] = real_of(PySequence_Fast_GET_ITEM(given, i), "regressors");
  }
  if (i == size) {
    return values;
  }
  const auto object = py::reinterpret_borrow<py::object>(given);
  const View<const double> view(is_plain<double>(object, size) ? py::reinterpret_borrow<py::array>(object)
                                                               : samples_of<double>(object, "regressors", {size}));
  for (i = 0; i < size; ++i) {
    values.data()[i] = view[i];
  }
  return values;
}

double update_vector(Vector& estimator, PyObject* const* given, Py_ssize_t count) {
  if (count != 2) {
    throw type_error("takes exactly an output and regressors (" + std::to_string(count) + " given)");
  }
  const double output = real_of(given[0], "output");
  const AnyVector::Numbers values = values_of(given[1], estimator.numbers().core.width());
  return estimator.take(output, values.data()).innovation;
}

std::pair<double, double> predict(const Vector& estimator, PyObject* const* given, Py_ssize_t count) {
  if (count != 1) {
    throw type_error("takes exactly the regressors (" + std::to_string(count) + " given)");
  }
  const AnyVector& core = estimator.numbers().core;
  const AnyVector::Numbers values = values_of(given[0], core.width());
  const auto [value, standard_error] = core.predict(values.data());
  return {value, standard_error};
}

py::array numbers(const double* values, const AnyVector& core) { return py::array_t<double>(core.count(), values); }

}  // namespace

AnyVector::AnyVector(const Settings& s) : intercept_(s["intercept"] != 0) {
  const auto values = with_cusum<VectorSettings>(s, design::vector_share);
  emplace<0>(static_cast<std::size_t>(s["size"] + s["intercept"]) - 1, {values}, s["initial_covariance"]);
}

Settings VectorKind::defaults() {
  Settings settings;
  settings.add("size", 1);
  settings.add("intercept", 0);
  settings.add_all(goal_settings());
  settings.add_fields<WithoutCusum<VectorSettings>>(false);
  settings.add("initial_covariance", palpate::VectorRls<double, 1>::default_covariance);
  settings.add_fields<WithoutCusum<VectorSettings>>(true);
  return settings;
}

void VectorKind::check(const Settings& s) {
  const double most = s["intercept"] != 0 ? 7 : 8;
  require(s["size"] <= most, "size", s["size"], most == 8 ? "1 to 8" : "1 to 7 with an intercept");
  check_goal(s);
  s.check<WithoutCusum<VectorSettings>>();
  check_covariance<double>(s);
}

void bind_vectors(py::module_& module) {
  const auto made = [](const py::args& places, const py::kwargs& given) {
    const std::size_t sizes = places.size() + given.contains("size");
    if (!places.empty()) {
      given["size"] = places[0];
    }
    const Vector result("VectorRls", given);
    if (sizes != 1) {
      const std::string got = std::to_string(places.size()) + " values without a name";
      refuse<type_error>("VectorRls", got, "size; the others by name");
    }
    return result;
  };
  std::string parameters = VectorKind::defaults().text();
  parameters = "(size, *, intercept=False" + parameters.substr(parameters.find(", false_alarm_interval")) + ")";
  auto type = define_class<Vector>(module, "VectorRls", parameters, vector_doc, made);
  type.fast<&update_vector>("update", vector_update_doc);
  type.fast<&predict>("predict", predict_doc);
  const auto add = define_estimator(type, vector_process_doc, vector_trace_doc);
  add(
      "coefficients", [](const auto& s) { return numbers(s.core.coefficients(), s.core); },
      "Estimates, shape (size,), or (size + 1,) with the intercept last.");
  add(
      "covariance",
      [](const auto& s) {
        const py::ssize_t count = s.core.count();
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
