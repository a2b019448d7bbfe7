// SPDX-License-Identifier: MIT
#pragma once

// By how much correlated noise makes the variances of coefficients larger.

#include <palpate/estimator/unsuspected_noise.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// The influence of a sample on a coefficient is the change that the sample makes, times the number of samples: the error
/// of the coefficient is the mean of the influences. If these have the autocorrelation rho over one sample, and rho^n over
/// n, the variance of their mean is (1 + rho) / (1 - rho) times that of independent ones. Slow noise beside a slow
/// regressor or an intercept has a large rho, beside a white regressor it has none.
template <class Real, int Size>
class Influence {
 public:
  /// Coefficients before and after a sample, and the number of samples in units that make all influences comparable.
  PALPATE_INLINE constexpr void add(const Real (&before)[Size], const Real (&after)[Size], Real count) noexcept {
    constexpr Real memory = UnsuspectedNoise<Real>::memory, normal = std::numeric_limits<Real>::min();
    count_ = product(memory, count_) + 1;
    for (int i = 0; i < Size; ++i) {
      const Real influence = limited(product(after[i] - before[i], count));
      lag0_[i] = product(memory, lag0_[i]) + (product(influence, influence) + normal);
      lag1_[i] = product(memory, lag1_[i]) + (product(influence, last_[i]) + normal);
      last_[i] = influence;
    }
  }

  /// Factor of the variance of a coefficient. At least 1: a few samples cannot show that rho is below 0.
  ///
  /// The correlation r of n white influences has a variance of 1 / n: r is multiplied by r^2 / (r^2 + 1 / n), the share of
  /// r^2 that is real. Kendall's bias, -(1 + 3 r) / n (Biometrika 41, 1954), is -4 r / n where r is large. Near 0 there is
  /// none: the influences come from errors of forecasts, not from residuals.
  constexpr Real factor(int i) const noexcept {
    if (!(lag0_[i] > 0 && lag1_[i] > 0)) {
      return 1;
    }
    constexpr Real most = (UnsuspectedNoise<Real>::fewest - 1) / (UnsuspectedNoise<Real>::fewest + 1);
    const Real estimate = lag1_[i] / lag0_[i], square = product(product(estimate, estimate), count_);
    const Real unbiased = product(product(estimate, square / (square + 1)), 1 + 4 / (count_ + 4));
    const Real rho = unbiased < most ? unbiased : most;
    return (1 + rho) / (1 - rho);
  }

  /// As Rls::visit_state.
  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    visit(count_);
    for (int i = 0; i < Size; ++i) {
      visit(last_[i]), visit(lag0_[i]), visit(lag1_[i]);
    }
  }

 private:
  // So that the sum of 200 squares is finite.
  static constexpr Real limited(Real value) noexcept {
    constexpr Real most = std::is_same_v<Real, float> ? Real(1e18) : Real(1e152);
    const Real below = value < most ? value : most;
    return below > -most ? below : -most;
  }

  Real last_[Size] = {}, lag0_[Size] = {}, lag1_[Size] = {};  // sums of products of influences over 0 and 1 samples
  Real count_ = 0;                                            // sum of their weights
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
