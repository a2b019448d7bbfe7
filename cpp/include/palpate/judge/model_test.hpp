// SPDX-License-Identifier: MIT
#pragma once

// Does a touch follow the model output = ratio * regressor? Least squares with the terms that the model leaves out.

#include <palpate/estimate.hpp>
#include <palpate/judge/normal_equations.hpp>
#include <palpate/square_root.hpp>
#include <palpate/stage/matched_pair.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// What contradicts the model; several may be set.
enum Misfit : std::uint8_t {
  misfit_offset = 1,    ///< the bumps do not begin at the same depth
  misfit_drift = 2,     ///< the ratio, or a baseline, drifts
  misfit_lag = 4,       ///< one channel is behind the other
  misfit_curve = 8,     ///< the output is no straight line of the regressor
  misfit_tilt = 16,     ///< the ratio over the swept depth is another one
  misfit_changed = 32,  ///< the ratio changed shortly before the end
  misfit_step = 64,     ///< a channel jumped within the touch
  misfit_jumped = 128,  ///< the touch is a jump of the channels
};

/// The sizes of what the model leaves out.
template <class Real>
struct Misfits {
  Real offset = 0;       ///< the soft bump is reached first, by this share of the mean depth
  Real drift = 0;        ///< change of the ratio, or of a baseline, during the touch, share of the mean output
  Real drift_error = 0;  ///< its standard error; 0: the touch is too short to show a drift
  Real lag = 0;          ///< of the soft channel behind the hard one, pairs; of a slow movement, see `bend`
  /// tan^2(a / 2), a the phase of the movement from pair to pair: a lag of d pairs appears as tan(a d) / sin a
  Real bend = 0;
  Real curve = 0;       ///< output at twice the mean depth, above the straight line, share of the mean output
  Real tilt = 0;        ///< the ratio above the level ratio, share of it
  Real open = 0;        ///< variance of the ratio that these leave open, without the drift
  Real open_drift = 0;  ///< the same by the drift
  Real offset_ratio = not_a_number<Real>;  ///< if only the offset contradicts: of y = r x + c
  Real offset_error = not_a_number<Real>;  ///< its standard error
  std::uint8_t flags = 0;                  ///< of Misfit
};

/// The columns of the sums; x is the regressor minus `origin`, and y the output minus `first` times the regressor.
enum Term : int { term_x, term_one, term_time, term_slope, term_square, term_y, term_count };
/// The sums of their products.
template <class Real>
using TermSums = NormalEquations<Real, term_count>;

/// Tests the terms of y = r x + c + d t + l x' + k (x / m - 1)^2, m the mean of x.
template <class Real>
struct TermTests {
  static constexpr Real significant = Real(8);     // standard errors, for a flag
  static constexpr Real least = Real(0.002);       // smaller effects have no flag
  static constexpr Real least_bent = Real(0.005);  // the same for an offset or a curve: gauges are bent, by .5 %/pF
  static constexpr Real least_lag = Real(0.08);    // and for a lag, pairs

  const TermSums<Real>& sums;
  Real bends;                  // of the squares of the second differences of x
  Real first, origin, length;  // as above; of the touch, in units of t
  Real hard, soft;             // variances of a reading
  Real n = sums.at(term_one, term_one), centre = sums.at(term_x, term_one) / n, m = origin + centre;
  Real ratio_ = 0, variance_ = 0;
  Misfits<Real> found_{};

  constexpr Misfits<Real> result() noexcept {
    TermSums<Real> solved = sums;
    const Model model = solve(solved);
    const Real bend = model == Model::whole ? solved.at(term_square, term_y) : Real(0);
    ratio_ = first + solved.at(term_x, term_y) + 2 * product(centre, bend);
    variance_ = residual(solved.at(term_y, term_y) / (n - static_cast<Real>(model)), ratio_);
    test_drift(solved);
    if (model == Model::whole) {  // first: where a channel lags, the transients of a press look like the others
      test_lag(solved);
    }
    if (model != Model::drift) {
      test_offset(solved, model == Model::whole);
    }
    if (model == Model::whole) {
      test_curve(solved);
    }
    // A choice: from an offset of half of the depth on no ratio is taken. With a larger limit fewer of them have none.
    if (found_.flags == misfit_offset && magnitude(found_.offset) < Real(0.5)) {
      take_offset();
    }
    return found_;
  }

 private:
  /// The number of terms: r x and d t; c, too; all.
  enum class Model : std::uint8_t { drift = 2, line = 3, whole = 5 };

  // The variance of the noise of x', half the difference of two values at a distance of 2 pairs, is
  // (1 - rho) / 2 times the variance of the noise of x. rho = 0.098 is the correlation of the filtered noise at lag 2:
  // 2 b2 (1/2 - b2) / 0.42, with b2 = 0.045 of MatchedPair at 26 ms.
  static constexpr Real slope_noise = Real(0.45);

  // The largest model whose terms vary by more than noise could make them.
  constexpr Model solve(TermSums<Real>& all) const noexcept {
    // Noise in x makes a slope too small by noise / spread (errors in variables): at most a thirtieth.
    const Real noise = product(noise_gain<Real>, soft);
    const Real floor = 30 * product(n, noise);
    all.sweep(term_one);
    all.sweep(term_time);
    const Real spread = all.at(term_x, term_x);
    if (!(spread > floor && several(spread) && all.sweep(term_x))) {
      all = sums;
      all.shift(term_x, term_one, origin);
      all.sweep(term_x);
      all.sweep(term_time);
      return Model::drift;
    }
    const TermSums<Real> line = all;
    // If the noise of x has the variance s^2, the noise of x^2 has the variance 4 x^2 s^2 + 2 s^4.
    const Real of_square = product(4 * spread / n + 2 * noise, floor), of_slope = product(slope_noise, floor);
    const bool whole = all.at(term_square, term_square) > of_square && all.sweep(term_square) &&
                       all.at(term_slope, term_slope) > of_slope && all.sweep(term_slope) &&
                       product(at_zero(all), floor) < 1 && product(all.error(term_square), of_square) < 1 &&
                       product(all.error(term_slope), of_slope) < 1;
    if (!whole) {
      all = line;
    }
    return whole ? Model::whole : Model::line;
  }
  // The variance of the slope where the regressor is 0, not of that at the origin: the depth has to vary by some per cent.
  constexpr Real at_zero(const TermSums<Real>& all) const noexcept {
    const Real twice = 2 * origin, more = product(twice, all.error(term_square)) + 2 * all.at(term_x, term_square);
    return all.error(term_x) + product(twice, more);
  }

  // The variation of x is that of at least two pairs: spread^2 / sum (x - m)^4. One alone is a transient, which the
  // filters do not match.
  constexpr bool several(Real spread) const noexcept {
    const Real c2 = product(centre, centre);
    const Real fourth = sums.at(term_square, term_square) - 4 * product(centre, sums.at(term_x, term_square)) +
                        product(6 * c2, sums.at(term_x, term_x)) - product(3 * c2, product(c2, n));
    return product(spread, spread) > 2 * fourth;
  }

  /// Variance of the noise of the readings.
  constexpr Real sensors(Real ratio) const noexcept { return hard + product(product(ratio, ratio), soft); }

  /// Residual variance of a pair, or that of the noise of the readings, without the filters' gain.
  constexpr Real residual(Real rest, Real ratio) const noexcept {
    const Real noise = sensors(ratio), seen = rest / noise_gain<Real>;
    return seen > noise ? seen : noise;
  }

  /// The share of the mean output that a term has.
  constexpr Real share(Real value) const noexcept { return value / magnitude(product(ratio_, m)); }

  constexpr void set_flag(Misfit flag, Real value, Real error, Real size, Real smallest) noexcept {
    const Real limit = product(significant * significant, product(error, variance_));
    if (product(value, value) > limit && magnitude(size) > smallest) {
      found_.flags |= flag;
    }
  }

  /// What a term of this size leaves open: nothing up to 4 standard errors, all of it from 8 on, the ratio itself at most.
  constexpr Real left_open(Real value, Real error) const noexcept {
    const Real size = magnitude(share(value)), shift = product(size < 1 ? size : Real(1), ratio_);
    const Real part = (product(value, value) / product(error, variance_) - 16) / 48;
    const bool counts = part > 0 && !(found_.flags & misfit_lag);
    return counts ? product(part < 1 ? part : Real(1), product(shift, shift)) : Real(0);
  }

  /// Sets the size of an effect, and its flag; returns what it leaves open.
  constexpr Real tested(Misfit flag, Real value, Real error, Real& size, Real smallest) noexcept {
    size = share(value);
    set_flag(flag, value, error, size, smallest);
    return left_open(value, error);
  }

  constexpr void test_drift(const TermSums<Real>& solved) noexcept {
    const Real error = product(solved.error(term_time), product(length, length));
    found_.drift_error = share(square_root(product(error, variance_)));
    found_.open_drift =
        tested(misfit_drift, product(solved.at(term_time, term_y), length), error, found_.drift, least) / 4;
  }

  constexpr void test_lag(const TermSums<Real>& solved) noexcept {
    const Real value = solved.at(term_slope, term_y);
    found_.lag = value / ratio_;
    // Of a sine, the second differences have the size 4 sin^2(a / 2), and x' has sin a; the slow rest of x' is left out.
    found_.bend = product(bends, solved.error(term_slope)) / 4;
    set_flag(misfit_lag, value, solved.error(term_slope), found_.lag, least_lag);
  }

  constexpr void test_offset(const TermSums<Real>& solved, bool whole) noexcept {
    // c = (1, -origin, -(m^2 - origin^2)) (coefficients of 1, x, x^2)
    const Real shares[] = {Real(1), -origin, whole ? -product(m + origin, centre) : Real(0)};
    constexpr Term columns[] = {term_one, term_x, term_square};
    Real value = 0, error = 0;
    for (int i = 0; i < (whole ? 3 : 2); ++i) {
      value += product(shares[i], solved.at(columns[i], term_y));
      for (int j = 0; j < (whole ? 3 : 2); ++j) {
        error -= product(product(shares[i], shares[j]), solved.at(columns[i], columns[j]));
      }
    }
    found_.open += tested(misfit_offset, -value, error, found_.offset, least_bent);
  }

  constexpr void test_curve(const TermSums<Real>& solved) noexcept {
    const Real m2 = product(m, m), error = product(product(m2, m2), solved.error(term_square));
    found_.open += tested(misfit_curve, product(m2, solved.at(term_square, term_y)), error, found_.curve, least_bent);
  }

  // Where the offset alone explains the residuals: they are not much larger than those with all terms, nor than noise.
  constexpr void take_offset() noexcept {
    TermSums<Real> line = sums;
    line.sweep(term_one);
    line.sweep(term_x);
    const Real ratio = first + line.at(term_x, term_y), alone = residual(line.at(term_y, term_y) / (n - 2), ratio);
    if (alone < 2 * variance_ && alone < 16 * sensors(ratio)) {
      found_.offset_ratio = ratio;
      found_.offset_error = square_root(product(line.error(term_x), alone));
    }
  }
};

/// Least squares for
///
///     y = r x + c + d t + l x' + k (x / m - 1)^2,   m the mean of x, x' = (x(k+1) - x(k-1)) / 2
///
/// from sums; x is taken minus the first one, and y minus the first ratio times x, so that float is enough. A term has a flag if it is `significant`
/// and its size is at least `least`; the standard errors are from the residuals or from the noise of the readings,
/// whichever is larger. Terms that noise alone could have made vary are left out (errors in variables).
template <class Real>
class ModelTest {
 public:
  static constexpr int fewest = 16;                      ///< pairs, for a result
  static constexpr Real least = TermTests<Real>::least;  ///< smaller effects have no flag, share

  /// A new touch.
  constexpr void reset() noexcept {
    restart(Real(0));
    curved_ = 0;
  }

  /// After a hand-over to a ratio that is changed by this share: the samples before it are forgotten. If the depth
  /// changed, too, the cause may be a curve.
  constexpr void restart(Real change) noexcept {
    const Real n = sums_.at(term_one, term_one), mean = n > 0 ? origin_ + sums_.at(term_x, term_one) / n : Real(0);
    const bool deeper = n > 0 && !(magnitude(last_[0].x - mean) < magnitude(mean) / 4);
    curved_ = deeper && magnitude(change) > magnitude(curved_) ? change : curved_;
    sums_ = {};
    bends_ = 0;
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
  constexpr Misfits<Real> result(Real hard_noise, Real soft_noise, Real ratio) const noexcept {
    Misfits<Real> found;
    const Real n = sums_.at(term_one, term_one);
    if (n >= fewest && origin_ + sums_.at(term_x, term_one) / n > 0) {
      const Real hard = product(hard_noise, hard_noise), soft = product(soft_noise, soft_noise);
      found = TermTests<Real>{sums_, bends_, first_, origin_, latest_, hard, soft}.result();
    }
    if (magnitude(curved_) > Real(0.01)) {  // a choice, twice least_bent: a smaller one flags more touches
      found.curve = curved_;
      found.flags |= misfit_curve;
      const Real shift = product(curved_, ratio);
      found.open += product(shift, shift);
      found.offset_ratio = found.offset_error = not_a_number<Real>;
    }
    return found;
  }

  /// Readings from the first pair to the last one, in which the drift is seen.
  constexpr Real length() const noexcept { return 256 * latest_; }

  /// The ratio of all samples alike; its standard error, if they scattered independently.
  constexpr Estimate<Real> mean() const noexcept {
    TermSums<Real> all = sums_;
    all.shift(term_x, term_one, origin_);
    const Real n = all.at(term_one, term_one), xx = all.at(term_x, term_x);
    if (!(n >= fewest && xx > 0)) {
      return {};
    }
    const Real slope = all.at(term_x, term_y) / xx;
    const Real rest = positive_part(all.at(term_y, term_y) - product(product(slope, slope), xx));
    return {first_ + slope, square_root(rest / product(n, xx))};
  }

 private:
  struct Sample {
    Real y, x;
  };

  // Pairs are left out where the regressor bends by more than a tenth of itself, as x' is no slope there. A choice: a smaller
  // limit leaves out more of a strong tremor, a larger one takes more of the edges of a press.
  constexpr void take(const Sample& s, Real before, Real after) noexcept {
    if (!(magnitude(after - 2 * s.x + before) < product(Real(0.1), magnitude(s.x)))) {
      return;
    }
    if (pairs_ == 0) {
      first_ = s.y / s.x;
      origin_ = s.x;
      begin_ = number_;
    }
    pairs_ += 1;
    const Real time = static_cast<Real>(number_ - begin_) / 256;
    const Real x = s.x - origin_;
    const Real values[term_count] = {x, Real(1), time, (after - before) / 2, product(x, x), s.y - product(first_, s.x)};
    sums_.add(values);
    const Real bend = after - 2 * s.x + before;
    bends_ += product(bend, bend);
    latest_ = time;
  }

  TermSums<Real> sums_{};
  Sample last_[2] = {};
  Real first_ = 0, origin_ = 0, latest_ = 0, curved_ = 0, bends_ = 0;
  std::uint32_t number_ = 0, begin_ = 0, pairs_ = 0;
  std::uint8_t known_ = 0;
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
