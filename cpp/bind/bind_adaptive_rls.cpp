// SPDX-License-Identifier: MIT
#include "bind_estimator.hpp"
#include "estimator_settings.hpp"

namespace {

constexpr auto class_doc = R"(The paper's estimator: a forgetting factor switched by a CUSUM change detector.

Parameters
----------
steady, alarmed : float, 0 < alarmed <= steady <= 1
    Forgetting factor while the alarm is off, and while it is on.
drift : float, pF
    Innovations smaller than this are ignored by the detector, d.
threshold : float, pF
    The alarm is on while the statistic is larger than this, h; inf for never.
initial_ratio, initial_covariance, max_covariance : float
    As in `Rls`.

Raises
------
ValueError
    A parameter out of its range.

Notes
-----
For each sample, with the innovation e of `Rls`: statistic' = max(0, statistic + abs(e) - drift);
alarm = statistic' > threshold; then the update of `Rls` with the forgetting factor that the
alarm selects. drift and threshold are in pF: they fit one press and
one noise level.

Examples
--------
>>> import palpate
>>> estimator = palpate.AdaptiveRls(drift=0.005)
>>> for _ in range(100):
...     ratio = estimator.update(0.50, 0.25)
>>> for _ in range(40):
...     ratio = estimator.update(0.65, 0.25)
>>> round(ratio, 2), estimator.alarm
(2.55, True)
)";

template <class Real>
void bind(py::module_& module, const char* name, const char* doc) {
  using Settings = AdaptiveSettings<Real>;
  py::class_<Estimator<Settings>> type(module, name, doc);
  type.def(py::init([](double steady, double alarmed, double drift, double threshold, double initial_ratio,
                       double initial_covariance, double max_covariance) {
             const Settings settings{steady,        alarmed, drift, threshold, initial_ratio, initial_covariance,
                                     max_covariance};
             settings.check();
             return Estimator<Settings>(settings);
           }),
           py::kw_only(), py::arg("steady") = Settings{}.steady, py::arg("alarmed") = Settings{}.alarmed,
           py::arg("drift") = Settings{}.drift, py::arg("threshold") = Settings{}.threshold,
           py::arg("initial_ratio") = Settings{}.initial_ratio,
           py::arg("initial_covariance") = Settings{}.initial_covariance,
           py::arg("max_covariance") = Settings{}.max_covariance);
  bind_methods(type);
}

}  // namespace

void bind_adaptive_rls(py::module_& module) {
  bind<double>(module, "AdaptiveRls", class_doc);
  bind<float>(module, "AdaptiveRls32",
              "`AdaptiveRls` in float32: bit for bit what the C++ header computes with `float`.");
}
