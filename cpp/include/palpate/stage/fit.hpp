// SPDX-License-Identifier: MIT
#pragma once

// Does a touch follow the model output = ratio * regressor? Least squares with the terms that the model leaves out.

#include <cstdint>
#include <limits>
#include <palpate/settings.hpp>
#include <palpate/stage/fit_test.hpp>

namespace palpate {

/// The null stage: without it a touch is not revised, either.
template <class Real>
struct NoFit {
  static constexpr bool fits = false;  ///< there is no test
};

/// Least squares for
///
///     y = r x + c + d t + l x' + k (x / m - 1)^2,   m the mean of x, x' = (x(k+1) - x(k-1)) / 2
///
/// from sums; y is taken minus the first ratio times x, so that float is enough. A term has a flag if it is `significant`
/// and its size is at least `least`; the standard errors are from the residuals or from the noise of the readings,
/// whichever is larger. Terms that noise alone could have made vary are left out (errors in variables).
template <class Real, class Settings = Kept<FitSettings<Real>>>
class Fit : public Settings {
 public:
  using Settings::settings;
  static constexpr bool fits = true;  ///< there is a test
  static constexpr int fewest = 16;   ///< pairs, for a result

  /// A new touch.
  constexpr void reset() noexcept {
    restart(Real(0));
    curved_ = 0;
  }

  /// After a hand-over to a ratio that is changed by this share: the samples before it are forgotten. If the depth
  /// changed, too, the cause may be a curve.
  constexpr void restart(Real change) noexcept {
    const Real n = sums_.at(fit_one, fit_one), mean = n > 0 ? sums_.at(fit_x, fit_one) / n : Real(0);
    const bool deeper = n > 0 && !(magnitude(last_[0].x - mean) < magnitude(mean) / 4);
    curved_ = deeper && magnitude(change) > magnitude(curved_) ? change : curved_;
    sums_ = {};
    pairs_ = 0;
    known_ = 0;
  }

  /// Add a pair with its number; an outlier interrupts the sequence, as a missing pair does.
  constexpr void add(Real output, Real regressor, std::uint32_t number) noexcept {
    if (known_ > 0 && number != number_ + 1) {
      known_ = 0;
    }
    number_ = number;
    if (known_ == 2) {
      take({last_[0].y, last_[0].x}, last_[1].x, regressor);
    }
    known_ = static_cast<std::uint8_t>(known_ + (known_ < 2));
    last_[1] = last_[0];
    last_[0] = {output, regressor};
  }

  /// The noise of a reading of the hard and of the soft channel, standard deviations; the ratio of the estimator.
  constexpr Fitted<Real> result(Real hard_noise, Real soft_noise, Real ratio) const noexcept {
    Fitted<Real> found;
    if (sums_.at(fit_one, fit_one) >= fewest && sums_.at(fit_x, fit_one) > 0) {
      const Real hard = product(hard_noise, hard_noise), soft = product(soft_noise, soft_noise);
      found = FitTest<Real>{settings, sums_, first_, latest_, hard, soft}.result();
    }
    if (magnitude(curved_) > settings.least_curved) {
      found.curve = curved_;
      found.flags = static_cast<std::uint8_t>(found.flags | misfit_curve);
      const Real shift = product(curved_, ratio);
      found.open += product(shift, shift);
      found.offset_ratio = found.offset_error = std::numeric_limits<Real>::quiet_NaN();
    }
    return found;
  }

 private:
  struct Sample {
    Real y, x;
  };

  constexpr void take(const Sample& s, Real before, Real after) noexcept {
    if (!(magnitude(after - 2 * s.x + before) < product(settings.bend, magnitude(s.x)))) {
      return;
    }
    if (pairs_ == 0) {
      first_ = s.y / s.x;
      begin_ = number_;
    }
    pairs_ += 1;
    const Real time = product(static_cast<Real>(number_ - begin_), unit_time);
    const Real values[fit_columns] = {
        s.x, Real(1), time, (after - before) / 2, product(s.x, s.x), s.y - product(first_, s.x)};
    sums_.add(values);
    latest_ = time;
  }

  static constexpr Real unit_time = Real(1) / Real(256);

  FitSums<Real> sums_{};
  Sample last_[2] = {};
  Real first_ = 0, latest_ = 0, curved_ = 0;
  std::uint32_t number_ = 0, begin_ = 0, pairs_ = 0;
  std::uint8_t known_ = 0;
};

}  // namespace palpate
