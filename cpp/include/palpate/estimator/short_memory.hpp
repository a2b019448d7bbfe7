// SPDX-License-Identifier: MIT
#pragma once

// The last few samples alone: for a ratio that moves within 32 samples.

#include <palpate/estimator/two_sided_cusum.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// A ratio with a memory of three samples, and how far it is behind. It is read while it predicts eight times better than
/// the windows do, and once it is, while four times. A lag or an offset of the output looks like a motion where the regressor changes its
/// sign: then it is not read.
template <class Real>
class ShortMemory {
 public:
  static constexpr Real forgetting = Real(0.3);  ///< weight of the past
  static constexpr Real better = 8;              ///< mean square errors of the windows, over its own
  static constexpr Real judged = 8;              ///< samples by which both are judged
  static constexpr Real one_sign = 64;           ///< samples without a change of sign
  static constexpr Real transient = 10;          ///< first samples

  /// Whether it is read.
  constexpr bool is_read() const noexcept { return reads_ > 0; }
  /// The ratio, less what it is behind.
  constexpr Real ratio() const noexcept { return ratio_ + product(forgetting / (1 - forgetting), trend_); }
  /// Mean step of the ratio, a sample.
  constexpr Real trend() const noexcept { return trend_; }
  /// Mean square of what it did not predict.
  constexpr Real miss() const noexcept { return own_miss_; }

  /// Add the n-th sample, which the windows predicted with the ratio `other`; errors larger than both `most` and theirs count as that.
  PALPATE_INLINE constexpr void add(const WeightedSample<Real>& s, Real other, Real most, Real n) noexcept {
    const Real share = mean_share(n, 1 / judged);
    const Real other_error = s.output - product(other, s.regressor), error = s.output - product(ratio_, s.regressor);
    const Real other_square = product(other_error, other_error), square = product(error, error);
    const Real limit = other_square > most ? other_square : most;
    other_miss_ = normal_or_0(other_miss_ + product(share, other_square - other_miss_));
    own_miss_ = normal_or_0(own_miss_ + product(share, (square < limit ? square : limit) - own_miss_));
    information_ = normal_or_0(product(forgetting, information_)) + product(s.weight, s.regressor);
    if (PALPATE_LIKELY(information_ > 0)) {
      const Real step = product(s.weight / information_, error);
      ratio_ += step;
      trend_ = normal_or_0(trend_ + product(share, step - trend_));
    }
  }
  /// Whether it is read from now on.
  PALPATE_INLINE constexpr void choose(Real regressor, Real before, Real n) noexcept {
    same_ = product(before, regressor) < 0 ? Real(0) : same_ + 1;
    const Real times = is_read() ? better / 2 : better;
    reads_ = same_ >= one_sign && n > transient && other_miss_ > product(times, own_miss_) ? Real(1) : Real(0);
  }
  /// After a change: from this ratio and information on. The mean step and the errors stay.
  constexpr void restart(Real ratio, Real information) noexcept {
    ratio_ = ratio;
    information_ = information;
    reads_ = 0;
  }

  /// As Rls::visit_state.
  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    for (Real* number : {&ratio_, &information_, &trend_, &own_miss_, &other_miss_, &same_, &reads_}) {
      visit(*number);
    }
  }

 private:
  Real ratio_ = 0, information_ = 0;
  Real trend_ = 0;                      // mean step of the ratio
  Real own_miss_ = 0, other_miss_ = 0;  // mean squares
  Real same_ = one_sign, reads_ = 0;    // samples since the regressor changed its sign; 1: it is read
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
