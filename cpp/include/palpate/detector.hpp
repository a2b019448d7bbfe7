// SPDX-License-Identifier: MIT
#pragma once

// Change detectors: watch the innovation e(k), raise an alarm when the ratio has changed.

#include <palpate/arithmetic.hpp>

namespace palpate {

/// The null policy: no alarm, ever. `Value` is a Real, or a pack of them: see bank.hpp.
template <class Real>
struct NoDetector {
  using real_type = Real;
  static constexpr Real statistic = Real(0);

  constexpr bool update(Real /*innovation*/) noexcept { return false; }
  template <class Value>
  static constexpr Value next(Value statistic_before, Value /*innovation*/) noexcept {
    return statistic_before;
  }
  constexpr void reset() noexcept {}
  template <class Visit>
  constexpr void visit_state(Visit&&) noexcept {}
  constexpr bool is_finite() const noexcept { return true; }
  constexpr bool alarm() const noexcept { return false; }
  static constexpr Real limit() noexcept { return Real(0); }
};

/// The paper's cumulative sum of |e|, two-sided by the absolute value:
///   g(k) = max(0, g(k-1) + |e(k)| - d),  alarm(k) = g(k) > h.
/// drift d and threshold h in the unit of the output (pF). Page, Biometrika 41 (1954).
template <class Real>
struct Cusum {
  using real_type = Real;
  Real drift = Real(0.01);
  Real threshold = Real(0.05);
  Real statistic = Real(0);

  constexpr bool update(Real innovation) noexcept {
    statistic = next(statistic, innovation);
    return alarm();
  }
  template <class Value>
  constexpr Value next(Value statistic_before, Value innovation) const noexcept {
    // |e| - d first: when |e| <= d that difference is not positive, so rounding cannot make g rise.
    return positive_part(statistic_before + (magnitude(innovation) - drift));
  }
  constexpr void reset() noexcept { statistic = Real(0); }
  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    visit(statistic);
  }
  constexpr bool is_finite() const noexcept { return palpate::is_finite(statistic); }
  constexpr bool alarm() const noexcept { return statistic > threshold; }
  constexpr Real limit() const noexcept { return threshold; }
  template <class Visit>
  static constexpr void visit_fields(Visit&& visit) noexcept {
    visit("drift", &Cusum::drift);
    visit("threshold", &Cusum::threshold);
  }
};

}  // namespace palpate
