// SPDX-License-Identifier: MIT
#pragma once

// Change detectors: raise an alarm when the innovations e(k) show that the ratio has changed.
//
// Each has next(innovation), which returns whether there is an alarm; alarm(), the same again; and statistic(). One with
// a state has reset() and visit_state(visit), too.

#include <palpate/settings.hpp>

namespace palpate {

/// The null policy: never an alarm.
template <class Real>
struct NoDetector {
  using real_type = Real;  ///< float or double
  /// No alarm.
  static constexpr bool next(Real) noexcept { return false; }
  /// No alarm.
  static constexpr bool alarm() noexcept { return false; }
  /// 0.
  static constexpr Real statistic() noexcept { return Real(0); }
};

/// Settings of Cusum, in the unit of the output (pF); 0 <= clear_level <= threshold.
template <class Real>
struct CusumSettings {
  Real drift = Real(0.01);      ///< d: what noise may add to |e|, pF
  Real threshold = Real(0.05);  ///< h: an alarm is above it, pF
  Real clear_level = Real(0);   ///< an alarm ends there, pF

  /// As FixedForgetting::visit_fields.
  template <class Self, class Visit>
  static constexpr void visit_fields(Self& s, Visit&& visit) noexcept {
    visit("drift", s.drift, s.drift >= 0 && is_finite(static_cast<float>(s.drift)), "0 <= drift, finite");
    visit("threshold", s.threshold, s.threshold >= 0, "0 <= threshold");
    visit("clear_level", s.clear_level, 0 <= s.clear_level && s.clear_level <= s.threshold,
          "0 <= clear_level <= threshold");
  }
};

/// The cumulative sum of |e| of the paper, two-sided because of the absolute value:
///
///     g(k) = max(0, g(k-1) + |e(k)| - d)
///
/// The alarm is set when g(k) > h, and cleared when g(k) has come back to the clear level: 0 in the paper, so an alarm
/// that is on stays on until g(k) = 0. With clear_level = threshold, alarm(k) = g(k) > h. Page, Biometrika 41 (1954).
template <class Real, class Parameters = Kept<CusumSettings<Real>>>
struct Cusum : Parameters {
  using real_type = Real;  ///< float or double
  using Parameters::settings;
  Real signed_statistic = 0;  ///< g, negative during an alarm: that needs a g above 0, so the sign is never in doubt

  /// Takes e(k). Returns alarm(k).
  constexpr bool next(Real innovation) noexcept {
    // |e| - d first: if |e| <= d, this difference is not positive, so rounding cannot increase g.
    const Real sum = positive_part(statistic() + (magnitude(innovation) - settings.drift));
    const bool on = alarm() ? sum > settings.clear_level : sum > settings.threshold;  // as in SwitchedForgetting
    signed_statistic = on ? -sum : sum;
    return on;
  }
  /// alarm(k).
  constexpr bool alarm() const noexcept { return signed_statistic < 0; }
  /// g(k).
  constexpr Real statistic() const noexcept { return magnitude(signed_statistic); }
  /// Back to 0.
  constexpr void reset() noexcept { signed_statistic = 0; }
  /// As Rls::visit_state.
  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    visit(signed_statistic);
  }
};

}  // namespace palpate
