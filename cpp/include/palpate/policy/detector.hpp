// SPDX-License-Identifier: MIT
#pragma once

// Change detectors: raise an alarm when the innovations e(k) show that the ratio has changed.
//
// The estimator keeps one number for both, the signed statistic: its magnitude is the statistic, and it is negative
// during an alarm. An alarm needs a statistic above 0, so there is no doubt about the sign.

#include <palpate/arithmetic.hpp>

namespace palpate {

/// The null policy: never an alarm.
template <class Real>
struct NoDetector {
  using real_type = Real;                       ///< float or double
  static constexpr bool has_statistic = false;  ///< it keeps nothing

  /// The statistic unchanged.
  static constexpr Real next(Real statistic, Real /*innovation*/) noexcept { return statistic; }
  /// The alarm unchanged.
  static constexpr bool alarm(Real /*statistic*/, bool before) noexcept { return before; }
};

/// The cumulative sum of |e| of the paper, two-sided because of the absolute value:
///
///     g(k) = max(0, g(k-1) + |e(k)| - d)
///
/// The alarm is set when g(k) > h, and cleared when g(k) has come back to the clear level: 0 in the paper, so an alarm
/// that is on stays on until g(k) = 0. With clear_level = threshold, alarm(k) = g(k) > h.
/// drift d, threshold h and the clear level in the unit of the output (pF); 0 <= clear_level <= threshold.
/// Page, Biometrika 41 (1954).
template <class Real>
struct Cusum {
  using real_type = Real;                      ///< float or double
  static constexpr bool has_statistic = true;  ///< the estimator keeps g for it
  Real drift = Real(0.01);                     ///< d: what noise may add to |e|, pF
  Real threshold = Real(0.05);                 ///< h: an alarm is above it, pF
  Real clear_level = Real(0);                  ///< an alarm ends there, pF

  /// g(k) from g(k-1) and e(k).
  constexpr Real next(Real statistic, Real innovation) const noexcept {
    // |e| - d first: if |e| <= d, this difference is not positive, so rounding cannot increase g.
    return positive_part(statistic + (magnitude(innovation) - drift));
  }
  /// alarm(k) from g(k) and alarm(k-1).
  constexpr bool alarm(Real statistic, bool before) const noexcept {  // branches, as in SwitchedForgetting
    return before ? statistic > clear_level : statistic > threshold;
  }

  /// As FixedForgetting::visit_fields.
  template <class Visit>
  static constexpr void visit_fields(Visit&& visit) noexcept {
    visit("drift", &Cusum::drift);
    visit("threshold", &Cusum::threshold);
    visit("clear_level", &Cusum::clear_level);
  }
};

}  // namespace palpate
