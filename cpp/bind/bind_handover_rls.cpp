// SPDX-License-Identifier: MIT
#include "bind_estimator.hpp"
#include "estimator_settings.hpp"

namespace {

constexpr auto class_doc =
    R"(The estimator for a probe in a hand: instrumental variables, and a detector that scales itself.

Parameters
----------
steady : float, 0 < steady <= 1
    Forgetting factor.
drift, threshold : float, standard deviations
    Of the two-sided CUSUM on the innovations; see `palpate.design.cusum`.
clip : float, standard deviations
    A larger innovation counts as this to the detector, and not at all to the ratio.
smoothing : float, 0 < smoothing <= 1
    Share of a new regressor in the instrument, their running mean.
initial_ratio, initial_covariance, max_covariance : float
    As in `Rls`.

Raises
------
ValueError
    A parameter out of its range.

Notes
-----
With w the mean of the regressors x so far, and e = output - ratio * x: R' = steady R + w x,
ratio' = ratio + (w / R') e. Noise and tremor in x do not bias the ratio, as w does not carry
them; regressors have to keep their sign, as in one touch. At an alarm the ratio is taken from
the samples since the CUSUM was last 0. `standard_error` rests on the innovations' own
correlation: an autoregression of order 1 or 2.

Examples
--------
>>> import palpate
>>> estimator = palpate.HandoverRls()
>>> for _ in range(100):
...     ratio = estimator.update(0.50, 0.25)
>>> for _ in range(5):
...     ratio = estimator.update(0.65, 0.25)
>>> round(ratio, 3)
2.6
)";

template <class Real>
void bind(py::module_& module, const char* name, const char* doc) {
  using Settings = HandoverSettings<Real>;
  using E = Estimator<Settings>;
  const Settings defaults;
  py::class_<E> type(module, name, doc);
  type.def(py::init([](double steady, double drift, double threshold, double clip, double smoothing,
                       double initial_ratio, double initial_covariance, double max_covariance) {
             const Settings settings{steady,    drift,         threshold,          clip,
                                     smoothing, initial_ratio, initial_covariance, max_covariance};
             settings.check();
             return E(settings);
           }),
           py::kw_only(), py::arg("steady") = defaults.steady, py::arg("drift") = defaults.drift,
           py::arg("threshold") = defaults.threshold, py::arg("clip") = defaults.clip,
           py::arg("smoothing") = defaults.smoothing, py::arg("initial_ratio") = defaults.initial_ratio,
           py::arg("initial_covariance") = defaults.initial_covariance,
           py::arg("max_covariance") = defaults.max_covariance);
  bind_methods(type);
  type.def_property_readonly(
      "standard_error",
      [](const E& self) {
        return self.core().settled() ? static_cast<double>(self.core().standard_error())
                                     : std::numeric_limits<double>::quiet_NaN();
      },
      "Standard deviation of the ratio; nan for the first 40 samples or so, and for 16 after a change.");
}

}  // namespace

void bind_handover_rls(py::module_& module) {
  bind<double>(module, "HandoverRls", class_doc);
  bind<float>(module, "HandoverRls32",
              "`HandoverRls` in float32: bit for bit what the C++ header computes with `float`.");
}
