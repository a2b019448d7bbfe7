// SPDX-License-Identifier: MIT
#pragma once

// Bounds on the covariance: without excitation (regressor 0) the information R decays as lambda^k and P = 1/R would
// grow without limit (covariance wind-up), and R would reach subnormal numbers, where arithmetic is slow.

#include <palpate/arithmetic.hpp>

namespace palpate {

/// The null policy, for regressors that are never 0 for long.
template <class Real>
struct Unbounded {
  using real_type = Real;  ///< float or double
  /// The information unchanged.
  static constexpr Real limit(Real information) noexcept { return information; }
};

/// P / lambda <= 1 / min_information before each sample, so P never exceeds this limit either.
/// Equivalent to a forgetting factor raised to lambda' = max(lambda, P min_information): see palpate.reference.
template <class Real>
struct BoundedCovariance {
  using real_type = Real;              ///< float or double
  Real min_information = Real(1e-12);  ///< 1 / the largest covariance, pF^2

  /// The information, at least `min_information`.
  constexpr Real limit(Real information) const noexcept {
    return information > min_information ? information : min_information;
  }
  /// As FixedForgetting::visit_fields.
  template <class Self, class Visit>
  static constexpr void visit_fields(Self& s, Visit&& visit) noexcept {
    visit("min_information", s.min_information, s.min_information > 0, "0 < min_information");
  }
};

}  // namespace palpate
