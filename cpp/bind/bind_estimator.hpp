// SPDX-License-Identifier: MIT
#pragma once

// The Python methods that every estimator has, with the documentation that is the same for all.

#include "estimator.hpp"
#include "fastcall.hpp"
#include "pickling.hpp"

namespace doc {
constexpr auto update = R"(update($self, output, regressor, /)
--

Take one sample and return the ratio after it.

Parameters
----------
output, regressor : float
    Capacitance changes of the hard and the soft channel, pF. Positional only.

Returns
-------
float
    The ratio. A sample that is not finite, or so large that the state would not be, is
    refused: the state stays as it was, and `rejected` counts it.

Raises
------
TypeError
    Not two arguments, or something that float() does not take.
ValueError
    An integer beyond the range of a float.
RuntimeError
    The estimator is in use by another thread.
)";
constexpr auto process = R"(process($self, output, regressor, out=None)
--

Take a block of samples; the same bits as one `update` for each.

Parameters
----------
output, regressor : array_like of real numbers, shape (n,), pF
    Any stride; read in place where the type is the estimator's own.
out : numpy.ndarray, shape (n,), optional
    Where the ratios are written; it may be `output` or `regressor` itself.

Returns
-------
numpy.ndarray, shape (n,)
    The ratio after each sample; `out` where it was given.

Raises
------
TypeError
    Values that are not real numbers; an `out` of another type.
ValueError
    Not one-dimensional, not of one length, or a read-only `out`.
RuntimeError
    The estimator is in use by another thread.
)";
constexpr auto trace = R"(trace($self, output, regressor, out=None)
--

Take a block of samples and return the whole state after each.

Parameters
----------
output, regressor : array_like of real numbers, shape (n,), pF
out : numpy.ndarray, shape (n,), optional
    A structured array as an earlier call returned it.

Returns
-------
numpy.ndarray, shape (n,), structured
    `ratio`; `covariance` (1/pF^2); `innovation` (pF; nan in the row of a refused sample);
    `statistic`; `alarm`; and, from HandoverRls, `standard_error`.

Raises
------
TypeError, ValueError, RuntimeError
    As `process`.
)";
}  // namespace doc

template <class E>
std::string repr(const py::object& self) {
  const auto& estimator = self.cast<const E&>();
  std::string text = "<" + py::type::of(self).attr("__name__").cast<std::string>() + "(";
  const char* separator = "";
  for (const auto& field : E::Settings::fields()) {
    text += separator + std::string(field.name) + "=" + number(estimator.settings().*field.value);
    separator = ", ";
  }
  return text + ") ratio=" + number(estimator.core().ratio()) + " samples=" + std::to_string(estimator.samples()) +
         " rejected=" + std::to_string(estimator.rejected()) + ">";
}

template <class E>
PyObject* updated(E& estimator, double output, double regressor) {
  return PyFloat_FromDouble(estimator.update(output, regressor));
}

template <class E>
PyObject* processed(E& estimator, py::handle output, py::handle regressor, py::handle out) {
  return estimator.process(output, regressor, out);
}

template <class E>
PyObject* traced(E& estimator, py::handle output, py::handle regressor, py::handle out) {
  return estimator.trace(output, regressor, out);
}

template <class E>
void bind_methods(py::class_<E>& type) {
  type.attr("__module__") = "palpate";
  fastcall::def_numbers<E, 2, &updated<E>>(type, "update", doc::update);
  fastcall::def_block<E, &processed<E>>(type, "process", doc::process);
  fastcall::def_block<E, &traced<E>>(type, "trace", doc::trace);
  type.def("reset", &E::reset, "Forget every sample: as newly made with the same settings.")
      .def("__repr__", &repr<E>)
      .def_property_readonly(
          "settings", [](const E& self) { return to_dict(self.settings()); },
          "The parameters, as a dict: `type(e)(**e.settings)` is a new estimator like `e`.")
      .def_property_readonly(
          "ratio", [](const E& self) { return self.core().ratio(); }, "Estimated output / regressor.")
      .def_property_readonly(
          "covariance", [](const E& self) { return self.core().covariance(); },
          "Unscaled covariance P, 1/pF^2: times the variance of the innovation, the variance of the ratio.")
      .def_property_readonly("innovation", &E::innovation,
                             "A-priori error of the last accepted sample, pF; nan before the first.")
      .def_property_readonly(
          "statistic", [](const E& self) { return self.core().statistic(); },
          "CUSUM statistic: pF in AdaptiveRls, standard deviations in HandoverRls; 0 where there is no detector.")
      .def_property_readonly(
          "alarm", [](const E& self) { return self.core().alarm(); },
          "Whether statistic > threshold; False where there is no detector.")
      .def_property_readonly("samples", &E::samples, "Samples accepted so far.")
      .def_property_readonly("rejected", &E::rejected, "Samples refused so far.");
  bind_pickling(type);
}
