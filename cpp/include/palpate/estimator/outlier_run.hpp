// SPDX-License-Identifier: MIT
#pragma once

// Outliers in a row: a change, a slide, or a burst of noise.

#include <palpate/estimator/two_sided_cusum.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// Outliers in a row. After a change of the ratio they are as large as their regressors, in a burst of noise they are not. Many
/// of one sign show that the ratio slides: the last two samples then say more than all since it began.
template <class Real>
class OutlierRun {
 public:
  static constexpr Real slide = 5;  ///< outliers of one sign before a slide

  /// Add an innovation.
  constexpr void add(Real innovation, const WeightedSample<Real>& sample, bool outlier) noexcept {
    if (PALPATE_UNLIKELY(outlier)) {
      extend(innovation, sample.regressor);
    } else if (PALPATE_UNLIKELY(count_ > 0)) {
      count_ = 0;
      length_ = 0;
    }
    innovation_ = innovation;
    last_ = sample;
  }
  /// Judge the outliers from here on only by themselves.
  constexpr void begin_anew() noexcept { length_ = 0; }
  /// Whether this is a burst of noise.
  constexpr bool is_burst() const noexcept { return length_ > 0 && 3 * steps_ > size_; }
  /// Whether the ratio slides.
  constexpr bool is_slide() const noexcept { return count_ > slide && !is_burst(); }
  /// Outliers of one sign, in a row.
  constexpr Real count() const noexcept { return count_; }
  /// The sample before the one that is added next.
  constexpr const WeightedSample<Real>& last() const noexcept { return last_; }

  /// As Rls::visit_state.
  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    for (Real* number :
         {&innovation_, &last_.weight, &last_.output, &last_.regressor, &size_, &steps_, &count_, &length_}) {
      visit(*number);
    }
    visit(sign_);
  }

 private:
  constexpr void extend(Real innovation, Real regressor) noexcept {
    const Real moment = product(innovation, regressor), sign = moment > 0 ? Real(1) : Real(-1);
    const Real step = product(innovation, last_.regressor) - product(innovation_, regressor);
    steps_ = length_ > 0 ? product(Real(0.5), steps_) + magnitude(step) : Real(0);
    size_ = length_ > 0 ? product(Real(0.5), size_) + magnitude(moment) : magnitude(moment);
    count_ = sign == sign_ && count_ > 0 ? count_ + 1 : Real(1);
    length_ += 1;
    sign_ = sign;
  }

  Real innovation_ = 0;
  WeightedSample<Real> last_{};
  Real size_ = 0, steps_ = 0;  // sums of magnitudes, and of steps, times a regressor, half of each before
  Real count_ = 0, sign_ = 0;  // of one sign
  Real length_ = 0;            // of any sign, since it began anew
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
