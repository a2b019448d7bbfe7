// SPDX-License-Identifier: MIT
#include "bind_estimator.hpp"
#include "estimator_settings.hpp"

namespace {

constexpr auto class_doc = R"(Recursive least squares for output = ratio * regressor, with one forgetting factor.

Parameters
----------
forgetting : float, 0 < forgetting <= 1
    Weight of the past at each sample, lambda; the memory is about 2 / (1 - forgetting) samples.
initial_ratio : float
    The ratio before the first sample; 1 is an infinitely soft object.
initial_covariance : float, 1/pF^2
    How little that is trusted: it counts as much as one noise-free sample with a regressor
    of initial_covariance ** -0.5 pF, 0.01 pF for the default.
max_covariance : float, 1/pF^2
    Bound on the covariance, reached when the regressor stays at 0.

Raises
------
ValueError
    A parameter out of its range.

Notes
-----
With x the regressor, R = 1/P and e = output - ratio * x: R' = lambda R + x^2,
ratio' = ratio + (x / R') e; the paper's covariance form, eq. (3) and steps 1-4,
inverted. All capacitances in pF: in farads a covariance of 1e4 would mean that the
initial ratio is certain.

Examples
--------
>>> import palpate
>>> estimator = palpate.Rls(forgetting=0.99)
>>> round(estimator.update(0.5, 0.25), 4)
1.9984
>>> estimator.process([0.52, 0.5], [0.26, 0.25]).round(4)
array([1.9992, 1.9995])
)";

template <class Real>
void bind(py::module_& module, const char* name, const char* doc) {
  using Settings = RlsSettings<Real>;
  py::class_<Estimator<Settings>> type(module, name, doc);
  type.def(py::init([](double forgetting, double initial_ratio, double initial_covariance, double max_covariance) {
             const Settings settings{forgetting, initial_ratio, initial_covariance, max_covariance};
             settings.check();
             return Estimator<Settings>(settings);
           }),
           py::kw_only(), py::arg("forgetting") = Settings{}.forgetting,
           py::arg("initial_ratio") = Settings{}.initial_ratio,
           py::arg("initial_covariance") = Settings{}.initial_covariance,
           py::arg("max_covariance") = Settings{}.max_covariance);
  bind_methods(type);
}

}  // namespace

void bind_rls(py::module_& module) {
  bind<double>(module, "Rls", class_doc);
  bind<float>(module, "Rls32",
              "`Rls` in float32: bit for bit what the C++ header computes with `float`. With forgetting = 1 only for "
              "some 1e7 samples.");
}
