// SPDX-License-Identifier: MIT
#pragma once

// Whether a sample may change the state.

#include <palpate/arithmetic.hpp>

namespace palpate {

/// The null policy: every sample is accepted. For samples that were checked before: they and their squares must be
/// finite. After one NaN or infinity the ratio is NaN until the next reset.
struct Unchecked {
  /// Always true.
  template <class Real>
  static constexpr bool passes(Real, Real, Real) noexcept {
    return true;
  }
};

/// Accepts a sample only if ratio, information and statistic are finite after it.
struct Checked {
  /// Whether all three are finite.
  template <class Real>
  static constexpr bool passes(Real ratio, Real information, Real statistic) noexcept {
    return is_finite(ratio) && is_finite(information) && is_finite(statistic);
  }
};

}  // namespace palpate
