// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include "estimator.hpp"
#include "estimator_kinds.hpp"

namespace {

constexpr auto rls_doc = R"(Recursive least squares for output = ratio * regressor, with one forgetting factor.

Parameters
----------
forgetting : float, 0 < forgetting <= 1
    Weight of the past at each sample, lambda; the memory is about 2 / (1 - forgetting) samples.
initial_ratio : float
    The ratio before the first sample; 1 is an infinitely soft object.
initial_covariance : float, 1/pF^2
    Uncertainty of the initial ratio. It counts as much as one sample without noise whose regressor is
    initial_covariance ** -0.5 pF: 1e-6 pF for the default, less than the noise of any converter. So the first
    sample decides, and initial_ratio is where the first innovation is counted from.
max_covariance : float, 1/pF^2
    Bound on the covariance, reached when the regressor stays at 0. While only noise comes in, the ratio follows
    the noise: leave such samples out, as the scenes do.

Notes
-----
With x the regressor, R = 1/P and e = output - ratio * x: R' = lambda R + x^2, ratio' = ratio + (x / R') e. This is
the paper's covariance form, eq. (3) and steps 1-4, inverted. All capacitances are in pF: in farads a covariance of
1e12 would mean that the initial ratio is certain.

Examples
--------
>>> import palpate
>>> estimator = palpate.Rls(forgetting=0.99)
>>> round(estimator.update(0.5, 0.25), 4)
2.0
>>> estimator.process([0.52, 0.5], [0.26, 0.25]).round(4)
array([2., 2.])
)";

constexpr auto adaptive_doc = R"(The paper's estimator: a forgetting factor switched by a CUSUM change detector.

Parameters
----------
steady : float, 0 < steady <= 1
    Forgetting factor while the alarm is off.
alarmed : float, 0 < alarmed <= steady
    Forgetting factor while the alarm is on.
drift : float, pF
    Innovations smaller than this are ignored by the detector, d.
threshold : float, pF
    The alarm is set when the statistic is larger than this, h; inf for never.
clear_level : float, pF, 0 <= clear_level <= threshold
    The alarm is cleared when the statistic has come back to this: 0 as in the paper, or `threshold` for an alarm
    that is on exactly while the statistic is above the threshold.
initial_ratio, initial_covariance, max_covariance : float
    As in `Rls`.

Notes
-----
For each sample, with the innovation e of `Rls`: statistic' = max(0, statistic + abs(e) - drift);
alarm' = statistic' > (clear_level if alarm else threshold); then the update of `Rls` with the
forgetting factor that alarm' selects. drift, threshold and clear_level are in pF: they fit one press and one noise
level. The paper gives drift (0.01), the two factors and that the alarm is cleared at 0; threshold, initial_covariance
and max_covariance are choices, see "The paper's choices" in the documentation.

Examples
--------
>>> import palpate
>>> estimator = palpate.AdaptiveRls(drift=0.005)
>>> for _ in range(100):
...     ratio = estimator.update(0.50, 0.25)
>>> for _ in range(40):
...     ratio = estimator.update(0.65, 0.25)
>>> round(ratio, 2), estimator.alarm
(2.56, True)
)";

constexpr auto handover_doc =
    R"(The ratio of any two signals, output = ratio * regressor + noise, with a standard error, and with two detectors of a change.

Parameters
----------
false_alarm_interval : float, samples, 10 to 1e12, or inf
    Mean time between false alarms of white noise; inf for no alarm. The longer, the later a change is found.
smallest_shift : float, standard deviations, 0 < smallest_shift <= 1.5 clip
    The shift of the innovations that the CUSUM finds soonest for this interval; the windows find smaller ones. See
    `palpate.design.cusum`.
clip : float, standard deviations, 1 to 100
    The CUSUM limits a larger innovation to this; the ratio leaves it out.
smoothing : float, 0 < smoothing <= 1
    Share of a new regressor in the instrument, the running mean of the regressors.
guard : float, samples, 0 to 100
    First samples after a change that the new ratio leaves out, where filters smear them.
initial_ratio : float
    The ratio before the first sample with a regressor.

Notes
-----
With x the regressor, w the mean of the regressors before it, the ratio is sum of w * output / sum of w x over a window of the
newest samples: the longest one that agrees with all shorter ones. Noise in x does not bias the ratio of an x that keeps its size
for a while, because w does not contain it. Where the mean is no forecast, as of an x around 0, w is x: then the ratio is too small
by the share of the noise in the mean square of x, which `standard_error` does not contain. What is large or fast is found by a
CUSUM; then only the samples since it was last 0 are left. What is small or slow is found by the windows.
`standard_error` is how the ratio of blocks of samples scatters: slow noise is in it, and so is how far the newest half of the
window is from its mean. The 95 % interval is the ratio +- 1.96 `standard_error`. Values from 1e140 on (float32: 1e16) are
refused; regressors below 1e-139 (float32: 1e-18) count as 0.

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

constexpr auto update_doc = R"(update($self, output, regressor, /)
--

Take one sample and return the ratio after it.

Parameters
----------
output, regressor : float
    Capacitance changes of the hard and the soft channel, pF. Positional only.

Returns
-------
float
    The ratio. A sample that is not finite, that is too large (1e139 pF, in float32 1e15, is not, for any
    estimator), or that would make the state infinite, is refused: the state stays, and `rejected` counts it.
)";
constexpr auto process_doc = R"(process(self, /, output, regressor, out=None)
--

Take a block of samples; the same bits as one `update` for each.

Parameters
----------
output, regressor : array_like of real numbers, shape (n,), pF
    Any stride; read in place if the type is the estimator's own.
out : numpy.ndarray, shape (n,), optional
    Where the ratios are written; it may be `output` or `regressor` itself.

Returns
-------
numpy.ndarray, shape (n,)
    The ratio after each sample; `out` if it was given.
)";
constexpr auto trace_doc = R"(trace(self, /, output, regressor, out=None)
--

Take a block of samples and return the whole state after each; errors as of `process`.

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
)";

template <class E>
double update(E& estimator, PyObject* const* given, Py_ssize_t count) {
  using Real = typename E::Real;
  const auto [output, regressor] = numbers_of<2>(given, count, {"output", "regressor"});
  const auto x = static_cast<Real>(regressor);
  estimator.take(static_cast<Real>(output), &x);
  return estimator.numbers().core.ratio();
}

constexpr auto predict_output_doc = R"(predict($self, regressor, /)
--

Return what the output of a regressor is, and the standard error of that: its noise is not in it.

Parameters
----------
regressor : float

Returns
-------
value, standard_error : tuple of float
    In the unit of the output; the error is nan where `standard_error` is.
)";

template <class E>
std::pair<double, double> predict_output(const E& estimator, PyObject* const* given, Py_ssize_t count) {
  const auto [regressor] = numbers_of<1>(given, count, {"regressor"});
  const auto& core = estimator.numbers().core;
  const auto error = static_cast<double>(standard_error_of(core));
  return {static_cast<double>(core.ratio()) * regressor, error * std::abs(regressor)};
}

template <class State>
std::optional<std::uint64_t> change_at(const State& state) {
  const auto since = static_cast<std::uint64_t>(state.core.since_change());
  return since < state.samples ? std::optional<std::uint64_t>(state.samples - since) : std::nullopt;
}

template <class Kind>
void define(py::module_& module, const std::string& name, const char* doc) {
  using E = Estimator<Kind>;
  const auto made = [name](const py::args& places, const py::kwargs& given) {
    if (!places.empty()) {
      refuse<type_error>(name, "too many values without a name", "names only");
    }
    return E(name.c_str(), given);
  };
  auto type = define_class<E>(module, name.c_str(), "(*, " + Kind::defaults().text() + ")", doc, made);
  type.template fast<&update<E>>("update", update_doc);
  const auto add = define_estimator(type, process_doc, trace_doc);
  add("ratio", [](const auto& s) { return s.core.ratio(); }, "Estimated output / regressor.");
  add(
      "covariance", [](const auto& s) { return s.core.covariance(); },
      "Unscaled covariance P, 1/pF^2; P times the variance of the innovation is the variance of the ratio.");
  if constexpr (knows_its_error<typename E::Core>) {
    add(
        "standard_error", [](const auto& s) { return standard_error_of(s.core); },
        "Standard error of the ratio: the 95 % interval is +- 1.96 of it. nan for the first 20 samples or so.");
    add(
        "noise", [](const auto& s) { return std::sqrt(s.core.innovation_variance()); },
        "Standard deviation of the innovations, in the unit of the output; 0 before the first one that counts.");
    add("change_at", &change_at<typename E::State>,
        "Where the last change began, about: so many accepted samples were before it; None if there was no change.");
    type.template fast<&predict_output<E>>("predict", predict_output_doc);
  }
}

template <template <class> class Kind>
void define_both(py::module_& module, const std::string& name, const char* doc, const std::string& note = "") {
  define<Kind<double>>(module, name, doc);
  const auto in_float = "`" + name + "` in float32: bit for bit what the C++ header computes with `float`." + note;
  define<Kind<float>>(module, name + "32", in_float.c_str());
}

}  // namespace

void bind_estimators(py::module_& module) {
  define_both<FixedKind>(module, "Rls", rls_doc, " With forgetting = 1 only for some 1e7 samples.");
  define_both<AdaptiveKind>(module, "AdaptiveRls", adaptive_doc);
  define_both<WindowKind>(module, "HandoverRls", handover_doc);
}
