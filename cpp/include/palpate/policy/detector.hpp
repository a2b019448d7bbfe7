// SPDX-License-Identifier: MIT
#pragma once

// Change detectors: raise an alarm when the innovations e(k) show that the ratio has changed.

#include <palpate/arithmetic.hpp>

namespace palpate {

/// The null policy: never an alarm. `Value` is a Real, or a pack of them: see bank.hpp.
template <class Real>
struct NoDetector {
  using real_type = Real;
  static constexpr bool has_statistic = false;

  template <class Value>
  static constexpr Value next(Value statistic, Value /*innovation*/) noexcept {
    return statistic;
  }
  static constexpr Real limit() noexcept { return Real(0); }
};

/// The cumulative sum of |e| of the paper, two-sided because of the absolute value:
///   g(k) = max(0, g(k-1) + |e(k)| - d),  alarm(k) = g(k) > h.
/// drift d and threshold h in the unit of the output (pF). Page, Biometrika 41 (1954). The estimator keeps g.
template <class Real>
struct Cusum {
  using real_type = Real;
  static constexpr bool has_statistic = true;
  Real drift = Real(0.01);
  Real threshold = Real(0.05);

  /// g(k) from g(k-1) and e(k).
  template <class Value>
  constexpr Value next(Value statistic, Value innovation) const noexcept {
    // |e| - d first: if |e| <= d, this difference is not positive, so rounding cannot increase g.
    return positive_part(statistic + (magnitude(innovation) - drift));
  }
  constexpr Real limit() const noexcept { return threshold; }

  template <class Visit>
  static constexpr void visit_fields(Visit&& visit) noexcept {
    visit("drift", &Cusum::drift);
    visit("threshold", &Cusum::threshold);
  }
};

}  // namespace palpate
