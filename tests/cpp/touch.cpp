// SPDX-License-Identifier: MIT
// A whole touch at compile time, where undefined behaviour is an error, and what the types promise.

#include <cstdio>
#include <limits>
#include <palpate/palpate.hpp>

#include "samples.hpp"

namespace {

using namespace palpate;

template <class Real>
struct Result {
  Real ratio, covariance, statistic;
  int alarms, accepted;

  constexpr bool operator==(const Result& other) const noexcept {
    return ratio == other.ratio && covariance == other.covariance && statistic == other.statistic &&
           alarms == other.alarms && accepted == other.accepted;
  }
};

template <class Real>
constexpr Result<Real> touch() noexcept {
  constexpr Samples<Real> samples;
  AdaptiveRls<Real> estimator;
  Result<Real> result{};
  for (int i = 0; i < samples.size; ++i) {
    const auto step = estimator.update(samples.output[i], samples.regressor[i]);
    result.alarms += step.alarm;
    result.accepted += step.accepted;
  }
  result.ratio = estimator.ratio();
  result.covariance = estimator.covariance();
  result.statistic = estimator.statistic();
  return result;
}

template <class Real>
constexpr bool settles(Result<Real> result) noexcept {
  return result.accepted == 250 && result.alarms > 0 && result.alarms < 250 &&
         magnitude(result.ratio - Real(3.25)) < Real(0.01) && result.covariance > 0 && result.statistic >= 0;
}

constexpr auto in_double = touch<double>();
constexpr auto in_float = touch<float>();
static_assert(settles(in_double) && settles(in_float));

// Null policies cost nothing, and the real ones their parameters.
static_assert(sizeof(Rls<float>) == 2 * sizeof(float));
static_assert(sizeof(Rls<double>) == 2 * sizeof(double));
static_assert(sizeof(Rls<float, FixedForgetting<float>>) == 3 * sizeof(float));
static_assert(sizeof(FixedRls<float>) == 4 * sizeof(float));
static_assert(sizeof(AdaptiveRls<float>) == 9 * sizeof(float));
static_assert(sizeof(embedded::AdaptiveRls<float>) == 3 * sizeof(float));

// What a Cortex-M needs of a state: no constructor to run, a plain copy.
static_assert(std::is_trivially_copyable_v<AdaptiveRls<float>> && std::is_trivially_destructible_v<AdaptiveRls<float>>);
static_assert(noexcept(AdaptiveRls<double>().update(0.0, 0.0)) && noexcept(AdaptiveRls<double>().reset()));

// Without forgetting every sample counts the same: a mean, exactly.
constexpr double mean_of_two() noexcept {
  Rls<double> estimator({}, {}, {}, 0.0, std::numeric_limits<double>::infinity());
  estimator.update(1.0, 1.0);
  return estimator.update(3.0, 1.0).ratio;
}
static_assert(mean_of_two() == 2.0);

// After reset nothing is left of the samples before it.
template <class Real>
constexpr bool reset_forgets() noexcept {
  AdaptiveRls<Real> fresh;
  AdaptiveRls<Real> used;
  used.update(Real(5), Real(1));
  used.reset();
  const auto first = fresh.update(Real(0.5), Real(0.25));
  const auto again = used.update(Real(0.5), Real(0.25));
  return first.ratio == again.ratio && first.gain == again.gain && fresh.statistic() == used.statistic();
}
static_assert(reset_forgets<float>() && reset_forgets<double>());

// An innovation as large as the drift adds nothing, whatever has been summed so far: no rounding in between.
template <class Real>
constexpr bool drift_is_exact() noexcept {
  constexpr Cusum<Real> detector;
  for (int i = 0; i < 200; ++i) {
    const Real statistic = static_cast<Real>(i) / Real(10);
    if (detector.next(statistic, detector.drift) != statistic) {
      return false;
    }
  }
  return true;
}
static_assert(drift_is_exact<float>() && drift_is_exact<double>());

// Set above the threshold, cleared at 0, or at the level that is chosen; the sign of the statistic is the alarm's.
template <class Real>
constexpr bool alarm_is_held(Real clear_level, int longer) noexcept {
  AdaptiveRls<Real> estimator(SwitchedForgetting<Real>(), {Real(0.5), Real(1), clear_level});
  constexpr Real outputs[] = {Real(1), Real(1.25), Real(0), Real(0), Real(0)};  // g: 0.5, 1.25, 0.75, 0.25, 0
  int alarms = 0;
  for (const Real output : outputs) {
    const bool alarm = estimator.update(output, Real(0)).alarm;
    if (alarm != estimator.alarm() || estimator.statistic() != magnitude(estimator.signed_statistic())) {
      return false;
    }
    alarms += alarm;
  }
  return alarms == 1 + longer && estimator.statistic() == Real(0);
}
static_assert(alarm_is_held<double>(0, 2) && alarm_is_held<double>(0.5, 1) && alarm_is_held<double>(1, 0));
static_assert(alarm_is_held<float>(0, 2) && alarm_is_held<float>(0.5f, 1) && alarm_is_held<float>(1, 0));

template <class Real>
bool refuses_what_is_not_finite() {
  constexpr Real bad[] = {std::numeric_limits<Real>::quiet_NaN(), std::numeric_limits<Real>::infinity(),
                          -std::numeric_limits<Real>::infinity(), std::numeric_limits<Real>::max()};
  AdaptiveRls<Real> estimator;
  estimator.update(Real(0.5), Real(0.25));
  const Real ratio = estimator.ratio();
  const Real information = estimator.information();
  const Real statistic = estimator.statistic();
  bool ok = true;
  for (const Real value : bad) {
    ok = ok && !estimator.update(Real(1), value).accepted;  // max() squared is infinite
    ok = ok && (value == std::numeric_limits<Real>::max() || !estimator.update(value, Real(1)).accepted);
  }
  return ok && ratio == estimator.ratio() && information == estimator.information() &&
         statistic == estimator.statistic();
}

}  // namespace

int main() {
  const bool same = touch<double>() == in_double && touch<float>() == in_float;
  const bool refused = refuses_what_is_not_finite<double>() && refuses_what_is_not_finite<float>();
  std::printf("run time == compile time: %d; refused: %d\n", same, refused);
  return same && refused ? 0 : 1;
}
