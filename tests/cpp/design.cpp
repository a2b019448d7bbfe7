// SPDX-License-Identifier: MIT
// The design of a CUSUM: published run lengths, and that the default thresholds are worth the default goal.

#include <cmath>
#include <cstdio>
#include <limits>
#include <palpate/design.hpp>
#include <palpate/estimator/handover.hpp>
#include <palpate/estimator/vector_rls.hpp>

namespace {

using namespace palpate;

constexpr double infinity = std::numeric_limits<double>::infinity();
int wrong = 0;

void check(bool right, const char* what) {
  if (!right) {
    std::printf("wrong: %s\n", what);
    ++wrong;
  }
}

bool near(double found, double expected, double relative) {
  return std::abs(found - expected) <= relative * std::abs(expected);
}

// Without clipping: Brook and Evans, Biometrika 59 (1972), section 4.3. A chain of 400 states is 5e-4 off.
void run_lengths() {
  check(near(design::run_length(0.5, 3, 1, 100), 6.40, 1.5e-3), "run length after a shift of 1");
  check(near(design::run_length(0.5, 3, 0, 100), 117.59, 6e-4), "run length without a shift");
  check(design::run_length(3, 1) == infinity, "no alarm is possible");
  check(design::run_length(0.75, 30) == infinity, "longer than 1e15");
  check(near(design::run_length(0, 0, 0), 2, 1e-12), "a threshold of 0: the first positive innovation");
}

void designs() {
  const design::Cusum found = design::cusum(1e5, 1.5);
  check(found.drift == 0.75, "the drift is half of the shift");
  check(near(found.false_alarm_interval, 1e5, 1e-3), "the interval is the one that was wanted");
  check(near(2 * found.false_alarm_interval, design::run_length(0.75, found.threshold), 1e-12), "and the threshold's");
  check(found.delay == design::run_length(0.75, found.threshold, 1.5), "the delay is that of the threshold");
  check(std::isnan(design::cusum(1e9, 1e-3).threshold), "a shift that is too small");
}

// The share of each estimator belongs to its default threshold: without the constants the design is the same.
template <class Settings>
void defaults_are_worth_their_goal(double share) {
  constexpr design::Goal goal;
  const design::Cusum computed = design::cusum(share * goal.false_alarm_interval, goal.smallest_shift);
  check(near(computed.threshold, double(Settings().threshold), 1e-3), "threshold of the default goal");
  check(computed.drift == double(Settings().drift), "drift of the default goal");
}

template <class Settings>
void settings_for_a_goal(double share) {
  Settings given;
  given.clip = 4;
  given.steady = decltype(given.steady)(0.9);
  const Settings other = design::with_cusum(given, {1e4, 2}, share);
  using Real = decltype(given.threshold);
  check(valid(other) && other.steady == given.steady, "the other settings stay");
  check(other.drift == 1 && other.threshold == Real(design::cusum(share * 1e4, 2, 4).threshold), "for a goal");
  const Settings usual = design::with_cusum(Settings(), design::Goal(), share);
  check(usual.threshold == Settings().threshold && usual.drift == Settings().drift, "the defaults are constants");
  check(design::with_cusum(given, {infinity, 1}, share).threshold == std::numeric_limits<Real>::infinity(), "never");
  check(!valid(design::with_cusum(given, {1e9, 1e-3}, share)), "a threshold that is not possible is not valid");
}

}  // namespace

int main() {
  run_lengths();
  designs();
  defaults_are_worth_their_goal<HandoverSettings<double>>(design::handover_share);
  defaults_are_worth_their_goal<VectorSettings<double>>(design::vector_share);
  settings_for_a_goal<HandoverSettings<double>>(design::handover_share);
  settings_for_a_goal<HandoverSettings<float>>(design::handover_share);
  settings_for_a_goal<VectorSettings<double>>(design::vector_share);
  return wrong;
}
