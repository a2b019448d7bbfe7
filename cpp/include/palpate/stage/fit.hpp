// SPDX-License-Identifier: MIT
#pragma once

// Does a touch follow the model output = ratio * regressor? Least squares with the terms that the model leaves out.

#include <cstdint>
#include <limits>
#include <palpate/arithmetic.hpp>
#include <palpate/settings.hpp>
#include <palpate/square_root.hpp>
#include <palpate/stage/sweep.hpp>

namespace palpate {

/// What contradicts the model; several may be set.
enum Misfit : std::uint8_t { misfit_offset = 1, misfit_drift = 2, misfit_lag = 4, misfit_curve = 8 };

/// The sizes of what the model leaves out.
template <class Real>
struct Fitted {
  Real offset = 0;      // the soft bump is reached first, by this share of the mean depth
  Real drift = 0;       // change of the ratio, or of a baseline, during the touch, share of the mean output
  Real lag = 0;         // of the soft channel behind the hard one, pairs
  Real curve = 0;       // output at twice the mean depth, above the straight line, share of the mean output
  Real open = 0;        // variance of the ratio that these leave open, without the drift
  Real open_drift = 0;  // the same by the drift
  Real offset_ratio = std::numeric_limits<Real>::quiet_NaN();  // if only the offset contradicts: of y = r x + c
  Real offset_error = std::numeric_limits<Real>::quiet_NaN();  // its standard error
  std::uint8_t flags = 0;
};

/// The null stage: without it a touch is not revised, either.
template <class Real>
struct NoFit {
  static constexpr bool fits = false;
};

template <class Real>
struct FitSettings {
  Real significant = Real(8);  // standard errors
  Real least = Real(0.002);    // smaller effects have no flag
  Real least_lag = Real(0.08);
  Real least_curved = Real(0.01);  // change of the ratio together with the depth, at a hand-over
  Real noise_gain = Real(0.42);  // of the filters before: variance of a pair for a reading's of 1
  Real bend = Real(0.1);         // pairs are left out where the regressor bends by more than this share of itself
  Real reliable = Real(30);      // the variation of a term over that of its noise
};

/// Least squares for
///   y = r x + c + d t + l x' + k (x / m - 1)^2,   m the mean of x, x' = (x(k+1) - x(k-1)) / 2,
/// from sums; y is taken minus the first ratio times x, so that float is enough. A term has a flag if it is `significant`
/// and its size is at least `least`; the standard errors are from the residuals or from the noise of the readings,
/// whichever is larger. Terms that noise alone could have made vary are left out (errors in variables).
template <class Real, class Settings = Kept<FitSettings<Real>>>
class Fit : public Settings {
 public:
  using Settings::settings;
  static constexpr bool fits = true;
  static constexpr int fewest = 16;

  constexpr void reset() noexcept {
    restart(Real(0));
    curved_ = 0;
  }

  /// After a hand-over to a ratio that is changed by this share: the samples before it are forgotten. If the depth
  /// changed, too, the cause may be a curve.
  constexpr void restart(Real change) noexcept {
    const Real n = sums_.at(one, one), mean = sums_.at(x, one) / n;
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

  /// The noise of a reading of the hard and of the soft channel, standard deviations.
  constexpr Fitted<Real> result(Real hard_noise, Real soft_noise) const noexcept {
    Fitted<Real> found;
    const Real n = sums_.at(one, one), m = sums_.at(x, one) / n;
    if (n >= fewest && m > 0) {
      judge(n, m, product(hard_noise, hard_noise), product(soft_noise, soft_noise), found);
    }
    if (magnitude(curved_) > settings.least_curved) {
      found.curve = curved_;
      found.flags |= misfit_curve;
      found.open += product(curved_, curved_);
    }
    return found;
  }

 private:
  enum Column : int { x, one, t, slope, square, y, columns };
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
    const Real values[columns] = {
        s.x, Real(1), time, (after - before) / 2, product(s.x, s.x), s.y - product(first_, s.x)};
    sums_.add(values);
    latest_ = time;
  }

  constexpr void judge(Real n, Real m, Real hard, Real soft, Fitted<Real>& found) const noexcept {
    Sweep<Real, columns> all = sums_;
    const Real noise = product(settings.noise_gain, soft);
    const Real floor = product(product(n, noise), settings.reliable);
    all.sweep(one);
    all.sweep(t);
    const Real spread = all.at(x, x);
    const bool varies = spread > floor && all.sweep(x);
    if (!varies) {
      all = sums_;
      all.sweep(x);
      all.sweep(t);
      weigh(all, n - 2, first_ + all.at(x, y), m, hard, soft, false, false, found);
      return;
    }
    // Noise of x^2, given x, and of x'.
    const Real of_square = 4 * spread / n * floor + 2 * product(floor, noise), of_slope = product(Real(0.45), floor);
    const bool whole = all.at(square, square) > of_square && all.sweep(square) && all.at(slope, slope) > of_slope &&
                       all.sweep(slope) && all.error(x) * floor < 1 && all.error(square) * of_square < 1 &&
                       all.error(slope) * of_slope < 1 && several(n, m, spread);
    if (!whole) {
      all = sums_;
      all.sweep(one);
      all.sweep(t);
      all.sweep(x);
    }
    const Real ratio = first_ + all.at(x, y) + (whole ? 2 * product(m, all.at(square, y)) : Real(0));
    const Real free = n - (whole ? 5 : 3);
    weigh(all, free, ratio, m, hard, soft, several(n, m, spread), whole, found);
    if (found.flags == misfit_offset) {
      take_offset(n, residual(all.at(y, y) / free, ratio, hard, soft), hard, soft, found);
    }
  }

  // The variation of x is that of at least two pairs: spread^2 / sum (x - m)^4. One alone is a transient, which the
  // filters do not match.
  constexpr bool several(Real n, Real m, Real spread) const noexcept {
    const auto& s = sums_;
    const Real m2 = product(m, m);
    const Real fourth = s.at(square, square) - 4 * product(m, s.at(x, square)) + 6 * product(m2, s.at(x, x)) -
                        4 * product(product(m2, m), s.at(x, one)) + product(product(m2, m2), n);
    return product(spread, spread) > 2 * fourth;
  }

  constexpr void weigh(const Sweep<Real, columns>& all, Real free, Real ratio, Real m, Real hard, Real soft,
                       bool varies, bool whole, Fitted<Real>& found) const noexcept {
    const Real mean = magnitude(product(ratio, m)), s2 = residual(all.at(y, y) / free, ratio, hard, soft);
    const auto size = [&](Real value, Real error, Real least, std::uint8_t flag) {
      const Real ratio2 = product(value, value), limit = product(product(error, s2), Real(1));
      const Real share = value / mean;
      if (ratio2 > 16 * limit && flag != misfit_lag && !(found.flags & misfit_lag)) {
        const Real size = product(magnitude(share) < 1 ? share : Real(1), ratio);
        (flag == misfit_drift ? found.open_drift : found.open) += product(size, size) / (flag == misfit_drift ? 4 : 1);
      }
      const Real significant = product(settings.significant, settings.significant);
      const Real by = flag == misfit_lag ? value / ratio : share;
      found.flags |= ratio2 > product(significant, limit) && magnitude(by) > least ? flag : std::uint8_t(0);
      return by;
    };
    found.drift = size(product(all.at(t, y), latest_), product(all.error(t), product(latest_, latest_)), settings.least,
                       misfit_drift);
    if (!varies) {
      return;
    }
    if (whole) {  // first: where a channel lags, the transients of a press look like an offset and a curve
      found.lag = size(all.at(slope, y), all.error(slope), settings.least_lag, misfit_lag);
    }
    const Real m2 = product(m, m);
    const Real bend = whole ? all.at(square, y) : Real(0);
    const Real spare = whole ? product(m2, product(m2, all.error(square)) + 2 * all.at(one, square)) : Real(0);
    found.offset = -size(all.at(one, y) - product(m2, bend), all.error(one) + spare, settings.least, misfit_offset);
    if (whole) {
      found.curve = size(product(m2, bend), product(product(m2, m2), all.error(square)), settings.least, misfit_curve);
    }
  }

  constexpr Real residual(Real rest, Real ratio, Real hard, Real soft) const noexcept {
    const Real sensors = hard + product(product(ratio, ratio), soft), seen = rest / settings.noise_gain;
    return seen > sensors ? seen : sensors;
  }

  // Where the offset alone explains the residuals: they are not larger than those with all terms.
  constexpr void take_offset(Real n, Real with_all, Real hard, Real soft, Fitted<Real>& found) const noexcept {
    Sweep<Real, columns> line = sums_;
    line.sweep(one);
    line.sweep(x);
    const Real ratio = first_ + line.at(x, y), s2 = residual(line.at(y, y) / (n - 2), ratio, hard, soft);
    if (s2 < 2 * with_all) {
      found.offset_ratio = ratio;
      found.offset_error = square_root(product(line.error(x), s2));
    }
  }

  static constexpr Real unit_time = Real(1) / Real(256);

  Sweep<Real, columns> sums_{};
  Sample last_[2] = {};
  Real first_ = 0, latest_ = 0, curved_ = 0;
  std::uint32_t number_ = 0, begin_ = 0, pairs_ = 0;
  std::uint8_t known_ = 0;
};

}  // namespace palpate
