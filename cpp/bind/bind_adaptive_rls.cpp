// SPDX-License-Identifier: MIT
#include "bind_estimator.hpp"

namespace {

template <class Real>
struct AdaptiveSettings {
  using Core = palpate::AdaptiveRls<Real>;
  using Row = TraceRow<Real>;
  double steady = 0.995, alarmed = 0.9, drift = 0.01, threshold = 0.05;
  double initial_ratio = 1.0, initial_covariance = 1e4, max_covariance = 1e6;

  static constexpr std::array<Field<AdaptiveSettings>, 7> fields() {
    return {{{"steady", &AdaptiveSettings::steady},
             {"alarmed", &AdaptiveSettings::alarmed},
             {"drift", &AdaptiveSettings::drift},
             {"threshold", &AdaptiveSettings::threshold},
             {"initial_ratio", &AdaptiveSettings::initial_ratio},
             {"initial_covariance", &AdaptiveSettings::initial_covariance},
             {"max_covariance", &AdaptiveSettings::max_covariance}}};
  }

  void check() const {
    check_adaptive(*this);
    check_prior<Real>(*this);
  }

  Core core() const {
    return Core({static_cast<Real>(steady), static_cast<Real>(alarmed)},
                {static_cast<Real>(drift), static_cast<Real>(threshold)}, {1 / static_cast<Real>(max_covariance)},
                static_cast<Real>(initial_ratio), static_cast<Real>(initial_covariance));
  }
};

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
For each sample, with the innovation e of `Rls`: statistic' = max(0, statistic + |e| - drift);
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
