// SPDX-License-Identifier: MIT
#pragma once

// From the ratio to the modulus of the object: eq. (2) of the paper, its inverse, its derivative and its range.

#include <palpate/arithmetic.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// Whether eq. (2) has a modulus for a ratio.
enum class Reach : unsigned char {
  unknown,    ///< not a number
  too_soft,   ///< below the ratio of an infinitely soft object: no object has it
  within,     ///< (2) has an answer
  too_stiff,  ///< the ratio of a rigid object, or above: too stiff for this probe
};

/// A probe: its ratio on an infinitely soft and on a rigid object, and the modulus half-way between them.
///
/// (2) says k_o = k_h k_s (r - 1) / (k_h - r k_s). Divided through by k_s, with r_rigid = k_h/k_s and a = k_h,
///
///     k_o = a (r - 1) / (r_rigid - r)
///
/// and for an object much larger than the bumps, where k_o is proportional to E,
///
///     E = a (r - r_soft) / (r_rigid - r)
///
/// with a the modulus at r = (r_soft + r_rigid) / 2. r_soft is 1, or the ratio of the channels' gains. Preconditions: soft_ratio < rigid_ratio, half_modulus > 0, finite.
template <class Real>
struct Elasticity {
  static_assert(is_real<Real>, "float or double");
  Real rigid_ratio = Real(10);  ///< ratio on a rigid object
  Real half_modulus = Real(2);  ///< MPa, or any unit for the modulus
  Real soft_ratio = Real(1);    ///< ratio on an infinitely soft object

  /// Whether modulus() has a value for this ratio.
  constexpr Reach reach(Real ratio) const noexcept {
    return !(ratio == ratio)     ? Reach::unknown
           : ratio < soft_ratio  ? Reach::too_soft
           : ratio < rigid_ratio ? Reach::within
                                 : Reach::too_stiff;
  }

  /// E(r); NaN if reach() is not within. r_rigid - r is exact where r > r_rigid / 2 (Sterbenz), so nothing is lost to
  /// cancellation: E is within 2 eps of (2) for this r. What remains is the condition of (2): an error of r changes E by
  /// r (r_rigid - r_soft) / ((r - r_soft) (r_rigid - r)) times as much, relative to each. So a float32 that is rounded to
  /// half an eps gives E to 1 % at E = 1.5e5 half_modulus, far beyond what a probe can tell from rigid.
  constexpr Real modulus(Real ratio) const noexcept {
    const bool has_one = reach(ratio) == Reach::within;
    return has_one ? product(half_modulus, (ratio - soft_ratio) / (rigid_ratio - ratio)) : not_a_number<Real>;
  }

  /// r(E), the inverse, for 0 <= E <= infinity; NaN below 0. Computed from the nearer end, so nothing cancels.
  constexpr Real ratio(Real modulus) const noexcept {
    if (!(modulus >= 0)) {
      return not_a_number<Real>;
    }
    const Real span = rigid_ratio - soft_ratio;
    return modulus < half_modulus ? soft_ratio + product(span, modulus / (modulus + half_modulus))
                                  : rigid_ratio - product(span, half_modulus / (modulus + half_modulus));
  }
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
