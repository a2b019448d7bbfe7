// SPDX-License-Identifier: MIT
#pragma once

// Whether a sample may change the state.

#include <palpate/arithmetic.hpp>

namespace palpate {

/// The null policy: every sample is taken. For samples that something else has checked already, as they must be finite,
/// and their squares, too: one NaN, or an infinity, and the estimator has no ratio before its next reset.
struct Unchecked {
  template <class Real>
  static constexpr bool passes(Real, Real, Real) noexcept {
    return true;
  }
};

/// Only a sample after which ratio, information and statistic are finite.
struct Checked {
  template <class Real>
  static constexpr bool passes(Real ratio, Real information, Real statistic) noexcept {
    return is_finite(ratio) && is_finite(information) && is_finite(statistic);
  }
};

}  // namespace palpate
