// SPDX-License-Identifier: MIT
#pragma once

// Forgetting policies: the fraction lambda of the information R = 1/P that remains at the next sample.
// A memory of about 2 / (1 - lambda) samples: 400 at 0.995, 20 at 0.9 (the paper's rule).
//
// Each has discount(information, innovation, regressor, alarm): the information R of the samples before, the innovation e
// and the regressor x of this one, and whether the detector has an alarm with it. It returns lambda R.

#include <palpate/arithmetic.hpp>

namespace palpate {

/// The null policy, lambda = 1: all samples have the same weight for ever. In float, R stops growing at 2^24 x^2, and
/// later samples have too much weight: for so many samples use double.
template <class Real>
struct NoForgetting {
  using real_type = Real;  ///< float or double
  /// The information unchanged.
  static constexpr Real discount(Real information, Real, Real, bool) noexcept { return information; }
};

/// Ordinary RLS: one lambda.
template <class Real>
struct FixedForgetting {
  using real_type = Real;         ///< float or double
  Real forgetting = Real(0.995);  ///< lambda, above 0 and up to 1

  /// lambda R.
  constexpr Real discount(Real information, Real, Real, bool) const noexcept {
    return product(forgetting, information);
  }
  /// Call `visit` with the name of each setting, a reference to it, whether it is allowed, and what is allowed.
  template <class Self, class Visit>
  static constexpr void visit_fields(Self& s, Visit&& visit) noexcept {
    visit("forgetting", s.forgetting, 0 < s.forgetting && s.forgetting <= 1, "0 < forgetting <= 1");
  }
};

/// The policy of the paper: lambda = alarmed during an alarm of the detector, otherwise steady.
template <class Real>
struct SwitchedForgetting {
  using real_type = Real;     ///< float or double
  Real steady = Real(0.995);  ///< lambda without an alarm, above 0 and up to 1
  Real alarmed = Real(0.9);   ///< lambda during an alarm

  /// lambda R.
  // A predicted branch, not a select: with a select every ratio would wait for the detector and the division, and take
  // three times as long.
  constexpr Real discount(Real information, Real, Real, bool alarm) const noexcept {
    if (PALPATE_UNLIKELY(alarm)) {
      return product(alarmed, information);
    }
    return product(steady, information);
  }
  /// As FixedForgetting::visit_fields.
  template <class Self, class Visit>
  static constexpr void visit_fields(Self& s, Visit&& visit) noexcept {
    visit("steady", s.steady, 0 < s.steady && s.steady <= 1, "0 < steady <= 1");
    visit("alarmed", s.alarmed, 0 < s.alarmed && s.alarmed <= s.steady, "0 < alarmed <= steady");
  }
};

}  // namespace palpate
