// SPDX-License-Identifier: MIT
#pragma once

// Codes of a converter that are coarser than the noise.

#include <palpate/arithmetic.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// The step of a channel's codes: the largest number of which all differences between its readings are multiples
/// (Euclid's algorithm). It is proven by three of them, of several codes or within a touch; neither a press from one
/// number to another nor a ramp, of equal differences, is a proof.
template <class Real>
class CodeStep {
  static constexpr std::uint8_t proven = 3, fine = 255;  // fine: below a few millionths of a reading

 public:
  constexpr void add(Real value, bool held) noexcept {
    const Real change = value - last_;
    last_ = value;
    if (PALPATE_UNLIKELY(times_ != fine && is_finite(change))) {
      if (const Real difference = magnitude(change); difference > 0) {
        const Real least = product(magnitude(value) + difference, Real(1e-6));
        refine(difference, least, magnitude(change - change_) > least, held);
      }
      change_ = change;
    }
  }
  /// The step, if noise does not move the readings from code to code; else 0: the noise contains the rounding. Half a step
  /// is the noise floor that Baseline takes for codes; 0.51 is above it whatever is rounded.
  constexpr Real coarse(Real noise) const noexcept {
    return times_ == proven && !(noise > product(Real(0.51), step_)) ? step_ : Real(0);
  }

 private:
  constexpr void refine(Real difference, Real least, bool differs, bool held) noexcept {
    const Real before = step_;
    step_ = difference;
    for (Real rest = before < 1000 * difference ? before : Real(0); rest > least;) {
      const Real codes = step_ / rest,
                 left = step_ - product(rest, static_cast<Real>(static_cast<int>(codes + Real(0.5))));
      step_ = rest;
      rest = magnitude(left);
    }
    if (!(step_ > 8 * least)) {
      times_ = fine;
    } else if (before - step_ > least || before == 0 || (!differs && times_ < proven)) {
      times_ = 0;
    } else {
      times_ = static_cast<std::uint8_t>(times_ + (times_ < proven && (held || difference > step_ + least)));
    }
  }

  Real last_ = 0, change_ = 0, step_ = 0;
  std::uint8_t times_ = 0;
};

/// The steps of both channels.
template <class Real>
struct CodeSteps {
  CodeStep<Real> hard, soft;

  constexpr void add(Real hard_value, Real soft_value, bool held) noexcept {
    hard.add(hard_value, held);
    soft.add(soft_value, held);
  }
  /// The larger step of a channel whose codes are coarser than its noise: a change by one code is no contact.
  constexpr Real coarser(Real hard_noise, Real soft_noise) const noexcept {
    const Real of_hard = hard.coarse(hard_noise), of_soft = soft.coarse(soft_noise);
    return of_hard > of_soft ? of_hard : of_soft;
  }
};

/// The null version: no code is coarse.
struct NoCodeStep {
  /// As CodeStep::coarse.
  template <class Real>
  static constexpr Real coarse(Real) noexcept {
    return 0;
  }
};

/// The same of both channels.
struct NoCodeSteps {
  static constexpr NoCodeStep hard{}, soft{};  ///< of each channel
  /// @{
  /// As the function of CodeSteps of this name.
  template <class Real>
  static constexpr void add(Real, Real, bool) noexcept {}
  template <class Real>
  static constexpr int coarser(Real, Real) noexcept {
    return 0;
  }
  /// @}
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
