// SPDX-License-Identifier: MIT
#pragma once

// Forgetting policies: how much of the information R = 1/P gathered so far still counts at the next sample.
// A memory of about 2 / (1 - lambda) samples: 400 at 0.995, 20 at 0.9 (the paper's rule).

#include <palpate/arithmetic.hpp>

namespace palpate {

/// The null policy, lambda = 1: every sample counts the same for ever. In float, R stops growing at 2^24 x^2 and
/// samples after that number count too much: for so many take double. See bench/accuracy/stability.py.
template <class Real>
struct NoForgetting {
  using real_type = Real;
  constexpr Real discount(Real information, bool /*alarm*/) const noexcept { return information; }
  static constexpr Real factor(bool /*alarm*/) noexcept { return Real(1); }
};

/// Ordinary RLS: one lambda.
template <class Real>
struct FixedForgetting {
  using real_type = Real;
  Real forgetting = Real(0.995);

  constexpr Real discount(Real information, bool /*alarm*/) const noexcept { return product(forgetting, information); }
  constexpr Real factor(bool /*alarm*/) const noexcept { return forgetting; }
  /// Give the name of each setting, and the member, to `visit`.
  template <class Visit>
  static constexpr void visit_fields(Visit&& visit) noexcept {
    visit("forgetting", &FixedForgetting::forgetting);
  }
};

/// The paper's: lambda = alarmed while the detector's alarm is on, steady otherwise.
template <class Real>
struct SwitchedForgetting {
  using real_type = Real;
  Real steady = Real(0.995);
  Real alarmed = Real(0.9);

  // A branch that is predicted, not a select: a select would put the detector and the division of every sample on the
  // path from one ratio to the next, three times as long.
  constexpr Real discount(Real information, bool alarm) const noexcept {
    if (PALPATE_UNLIKELY(alarm)) {
      return product(alarmed, information);
    }
    return product(steady, information);
  }
  constexpr Real factor(bool alarm) const noexcept { return alarm ? alarmed : steady; }
  template <class Visit>
  static constexpr void visit_fields(Visit&& visit) noexcept {
    visit("steady", &SwitchedForgetting::steady);
    visit("alarmed", &SwitchedForgetting::alarmed);
  }
};

}  // namespace palpate
