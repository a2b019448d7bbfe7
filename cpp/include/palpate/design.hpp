// SPDX-License-Identifier: MIT
#pragma once

// The design of a CUSUM from the interval between its false alarms. Only for computers, in double: it needs a heap, <cmath>
// and <vector>. palpate.hpp does not include it, and no header for a microcontroller may.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <palpate/arithmetic.hpp>
#include <type_traits>
#include <vector>

namespace palpate {
inline namespace PALPATE_NAMESPACE {
namespace design {

// Ranges of what cusum takes.
constexpr double shortest_interval = 10, longest_interval = 1e12;  ///< samples
constexpr double least_clip = 1, most_clip = 100;               ///< below 1 mostly the sign of the innovation remains
constexpr double largest_shift = 1.5;                           ///< in clips
constexpr double least_threshold = 1e-3, most_threshold = 128;  ///< standard deviations

/// What a user wants of a detector. The defaults stand for the default drift and threshold of an estimator's settings.
struct Goal {
  double false_alarm_interval = 1e7;  ///< mean time between false alarms, samples; infinite: no alarm
  double smallest_shift = 1.5;        ///< of the innovations that matters, standard deviations
};

// An estimator may have several detectors, so each must be rarer than the estimator's goal. The interval of one two-sided CUSUM
// is false_alarm_interval times this share. The default Goal then gives the default thresholds, 10, 12 and 11:
// tests/cpp/design.cpp.
constexpr double handover_share = 1.1558;  ///< of the interval of one CUSUM
constexpr double vector_share = 25.12;     ///< for 8 coefficients
constexpr double window_share = 5.363;     ///< of AdaptiveWindow: its default is 11

/// The tests of the windows have as many false alarms as one independent test in so many samples. The default interval then
/// gives a limit of 5 standard deviations.
constexpr double samples_of_a_test = 5.733;

/// Design of a two-sided CUSUM for standardised, uncorrelated innovations.
struct Cusum {
  double drift;                 ///< standard deviations
  double threshold;             ///< standard deviations; NaN: it would be above most_threshold
  double false_alarm_interval;  ///< mean time between false alarms, samples
  double delay;                 ///< mean time to the alarm after the smallest shift, samples
};

namespace detail {

/// The statistic of a one-sided CUSUM as a Markov chain (Brook and Evans, Biometrika 59, 1972): states of equal width, the
/// first one around 0. With q(m) the probability of m states upwards, and row i of Q that from the state i,
///
///     (I - Q) mu = 1,   Q_ij = q(j - i) for j > 0,   Q_i0 = sum of q(m) over m <= -i
///
/// where mu_0 is the mean run length. From 0 the statistic makes excursions, each to the alarm or to below the first state,
/// where the next one begins. The visits v of the states in an excursion are T' v = (1, 0, ...), T_ij = (i == j) - q(j - i), and
/// mu_0 = sum of v / sum of v_i P(alarm from i) (Page, Biometrika 41, 1954): sums of positive numbers, where a solution of
/// the equations above would lose all digits at a run length of 1e16.
class Chain {
 public:
  Chain(double drift, double threshold, double shift, double clip)
      : states_(std::max<std::size_t>(400, static_cast<std::size_t>(10 * threshold))) {
    const double width = threshold / (static_cast<double>(states_) - 0.5);
    for (std::size_t k = 0; k < 2 * states_; ++k) {
      const double distance = static_cast<double>(k) - static_cast<double>(states_) + 0.5;
      limits_.push_back(distance * width + drift);
    }
    for (std::size_t k = 0; k + 1 < limits_.size(); ++k) {
      steps_.push_back(below(limits_[k + 1], shift, clip) - below(limits_[k], shift, clip));
    }
    for (std::size_t i = 0; i < states_; ++i) {
      alarms_.push_back(above(limits_[2 * states_ - 1 - i], shift, clip));
    }
  }

  double run_length() const {
    double length = 0, alarms = 0;
    const std::vector<double> visits = visited();
    for (std::size_t i = 0; i < states_; ++i) {
      length += visits[i];
      alarms += visits[i] * alarms_[i];
    }
    return length / alarms;
  }

 private:
  // Of a normal variable of this mean, clipped.
  static double below(double limit, double mean, double clip) {
    return limit >= clip ? 1 : limit < -clip ? 0 : std::erfc((mean - limit) / std::sqrt(2.0)) / 2;
  }
  static double above(double limit, double mean, double clip) {
    return limit >= clip ? 0 : limit < -clip ? 1 : std::erfc((limit - mean) / std::sqrt(2.0)) / 2;
  }

  double step(std::size_t up, std::size_t down) const { return steps_[states_ - 1 + up - down]; }

  /// T' v = (1, 0, ...), T' w = (..., 0, 1), by Levinson's recursion over the number of states n. With
  /// a = sum of q(n - i) v_i and b = sum of q(-i) w_i, i from 1 to n - 1, the next ones are
  ///     v' = ((v, 0) + a (0, w)) / (1 - a b),   w' = ((0, w) + b (v, 0)) / (1 - a b).
  std::vector<double> visited() const {
    std::vector<double> v(states_), w(states_);
    v[0] = w[0] = 1 / (1 - step(0, 0));
    for (std::size_t n = 1; n < states_; ++n) {
      double a = 0, b = 0;
      for (std::size_t i = 0; i < n; ++i) {
        a += step(n - i, 0) * v[i];
        b += step(0, i + 1) * w[i];
      }
      const double scale = 1 / (1 - a * b);
      for (std::size_t i = n + 1; i-- > 0;) {
        const double last = i > 0 ? w[i - 1] : 0;
        w[i] = scale * (last + b * v[i]);
        v[i] = scale * (v[i] + a * last);
      }
    }
    return v;
  }

  std::size_t states_;
  std::vector<double> limits_, steps_, alarms_;
};

}  // namespace detail

/// Mean number of samples from 0 to the alarm of a one-sided CUSUM, g' = max(0, g + z - drift) with innovations z of mean
/// `shift`, clipped: an error of 2 % or less at a clip of 3. Infinite above 1e15, or if no alarm is possible.
/// Precondition: 0 <= threshold <= 1000.
inline double run_length(double drift, double threshold, double shift = 0, double clip = 3) {
  constexpr double none = std::numeric_limits<double>::infinity();
  if (!(clip > drift)) {
    return none;
  }
  const double length = detail::Chain(drift, threshold, shift, clip).run_length();
  return length < 1e15 ? length : none;
}

namespace detail {

/// The smallest threshold with a run length that is long enough, and the logarithm of this run length over the wanted one.
struct Bisection {
  double drift, clip, wanted;
  double threshold = 1, reached = 0;

  void run() {
    constexpr double near = 5e-4,
                     cell = 5e-5;  // tolerances of run length and threshold, relative; a run length may jump
    double low = least_threshold;
    for (reached = excess(threshold); reached < 0 && threshold < most_threshold; reached = excess(threshold)) {
      low = threshold;
      threshold *= 2;
    }
    while (reached > near && threshold - low > cell * threshold) {
      const double middle = std::sqrt(low * threshold), at_middle = excess(middle);
      if (at_middle < 0) {
        low = middle;
      } else {
        threshold = middle;
        reached = at_middle;
      }
    }
    threshold = reached < -near ? std::numeric_limits<double>::quiet_NaN() : threshold;
  }

 private:
  double excess(double at) const { return std::log(run_length(drift, at, 0, clip) / wanted); }
};

}  // namespace detail

/// The CUSUM for a wanted interval between false alarms and a smallest shift; its drift is half of the shift (Lorden 1971).
/// Preconditions: see the ranges above.
inline Cusum cusum(double false_alarm_interval, double smallest_shift, double clip = 3) {
  const double drift = smallest_shift / 2;
  detail::Bisection found{drift, clip, 2 * false_alarm_interval};  // two sides alarm twice as often as one
  found.run();
  const double delay = found.threshold > 0 ? run_length(drift, found.threshold, smallest_shift, clip) : found.threshold;
  return {drift, found.threshold, false_alarm_interval * std::exp(found.reached), delay};
}

/// The normal deviate that is exceeded, up or down, with this probability; 0 for 1 and more.
inline double normal_deviate(double probability) {
  double low = 0, high = 40;
  while (high - low > 1e-12) {
    const double middle = (low + high) / 2;
    (std::erfc(middle / std::sqrt(2.0)) > probability ? low : high) = middle;
  }
  return low;
}

/// Whether settings have the limit of windows.
template <class Settings, class = void>
inline constexpr bool has_windows = false;
template <class Settings>
inline constexpr bool has_windows<Settings, std::void_t<decltype(Settings::cut)>> = true;

/// HandoverSettings, AdaptiveWindowSettings or VectorSettings with their detectors for a goal, at their clip. With the defaults of both
/// there is nothing to compute. The threshold is NaN where no CUSUM is possible.
template <class Settings>
Settings with_cusum(Settings settings, const Goal& goal, double share) {
  using Real = decltype(settings.threshold);
  constexpr Settings usual;
  constexpr Goal usual_goal;
  const double interval = goal.false_alarm_interval, shift = goal.smallest_shift;
  const bool is_usual = interval == usual_goal.false_alarm_interval && shift == usual_goal.smallest_shift;
  if (is_usual && settings.clip == usual.clip) {
    settings.drift = usual.drift;
    settings.threshold = usual.threshold;
    if constexpr (has_windows<Settings>) {
      settings.cut = usual.cut;
    }
    return settings;
  }
  const bool has_alarms = interval <= longest_interval;
  settings.drift = Real(shift / 2);
  settings.threshold = has_alarms ? Real(cusum(share * interval, shift, double(settings.clip)).threshold)
                                  : std::numeric_limits<Real>::infinity();
  if constexpr (has_windows<Settings>) {
    settings.cut =
        has_alarms ? Real(normal_deviate(samples_of_a_test / interval)) : std::numeric_limits<Real>::infinity();
  }
  return settings;
}

}  // namespace design
}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
