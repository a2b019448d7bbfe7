// SPDX-License-Identifier: MIT
#pragma once

// Recursive least squares for several coefficients, with a change detector and standard errors.

#include <palpate/estimator/influence.hpp>
#include <palpate/estimator/least_squares.hpp>
#include <palpate/estimator/unsuspected_noise.hpp>
#include <palpate/settings.hpp>
#include <palpate/square_root.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// Settings of VectorRls. drift, threshold and clip are in standard deviations of the innovations.
template <class Real>
struct VectorSettings {
  Real steady = Real(0.995);  ///< forgetting factor
  Real drift = Real(0.75);    ///< slack of the CUSUM
  Real threshold = Real(12);  ///< its limit
  Real clip = Real(3);        ///< limits an innovation in the CUSUM; one above it does not change the coefficients
  Real alarmed = Real(0);  ///< forgetting factor from an alarm until a quarter of threshold; 0: an alarm is a hand-over
  /// 1 / max_covariance: so little that no coefficient shows it, and above subnormal numbers.
  Real min_information = std::is_same_v<Real, float> ? Real(1e-30) : Real(1e-280);

  /// As FixedForgetting::visit_fields.
  static constexpr auto visit_fields = [](auto& s, auto&& visit) noexcept {
    visit("steady", s.steady, 0 < s.steady && s.steady <= 1, "0 < steady <= 1");
    visit("drift", s.drift, 0 <= s.drift && (s.drift < s.clip || !(s.clip > 0)), "0 <= drift < clip");
    visit("threshold", s.threshold, s.threshold > 0, "0 < threshold");
    visit("clip", s.clip, 0 < s.clip && s.clip <= 100, "0 < clip <= 100");
    visit("alarmed", s.alarmed, 0 <= s.alarmed && s.alarmed <= s.steady, "0, or alarmed <= steady");
    visit("min_information", s.min_information, s.min_information > 0, "0 < min_information");
  };
};

/// Result of one sample of VectorRls. accepted is false if the sample was refused: then the state did not change.
template <class Real>
struct VectorStep {
  Real innovation;  ///< output - the sum of coefficient * regressor, with the coefficients before
  bool alarm;       ///< of the detector
  bool accepted;    ///< the sample is in the state
  bool outlier;     ///< too large to be noise
};

/// A prediction of VectorRls.
template <class Real>
struct Prediction {
  Real value;           ///< of the output, without its noise
  Real standard_error;  ///< of this value; NaN where it is unknown
};

/// output = sum of coefficients[i] regressors[i] + e, with exponential forgetting. With `Intercept` the last coefficient
/// is a constant, whose regressor, 1, is not given.
///
/// With P the covariance before the sample, z = e / sqrt(1 + x' P x / lambda) has the same variance for each sample
/// (recursive residuals: Brown, Durbin and Evans, Journal of the Royal Statistical Society B 37, 1975). Whitened, and in
/// units of its scale, z goes to a two-sided CUSUM for each coefficient, negated where the regressor without those before
/// it is negative, and |z| to one more: a change of any combination of coefficients gives an alarm. If no other
/// coefficients explain the samples since a side was low, the alarm was noise. Otherwise there is a hand-over: the
/// coefficients are computed again from the last samples, as many as make the change most likely.
///
/// A hand-over adds each of the last Window samples to a new fit: with 32 it takes as long as 8 other samples, with 8 as long
/// as 3. A smaller Window needs less memory, too; `alarmed` has no hand-over. Figures: docs/embedded.md.
template <class Real, int Regressors, bool Intercept = false, class Parameters = Kept<VectorSettings<Real>>,
          int Window = 32>
class VectorRls : public Parameters {
  static_assert(is_real<Real>, "palpate::VectorRls: Real must be float or double");
  static constexpr int Size = Regressors + Intercept;
  static_assert(Regressors >= 1 && Size <= 8, "palpate::VectorRls: 1 to 8 regressors, 7 with an intercept");
  static_assert(Window > Size && Window <= 32,
                "palpate::VectorRls: Window must be above the number of coefficients, 32 at most");
  using Fit = LeastSquares<Real, Size>;
  using Sample = Observation<Real, Size>;

 public:
  using real_type = Real;  ///< float or double
  using Parameters::settings;
  static constexpr int size = Size;      ///< number of coefficients
  static constexpr int window = Window;  ///< most samples of a hand-over
  static constexpr int warm_up = 8;      ///< innovations before the detector starts
  static constexpr int first = 16;       ///< innovations in which nothing is suspected
  static constexpr Real suspicion = 2;   ///< a side of the CUSUM above it: noise is not learned
  static constexpr Real default_covariance =
      1 / VectorSettings<Real>().min_information;  ///< of the coefficients: nothing is known

  /// With the default settings.
  constexpr VectorRls() noexcept : VectorRls(Parameters()) {}
  /// With these settings, and coefficients 0 of this covariance, 1 / regressor^2.
  constexpr explicit VectorRls(const Parameters& parameters, Real covariance = default_covariance) noexcept
      : Parameters(parameters),
        guarded_(larger(1 / covariance, settings.min_information)),
        fits_{Fit(guarded_), Fit(guarded_)},
        recent_guarded_(guarded_),
        recent_(guarded_) {}

  /// One sample. What is not finite is refused, and so are magnitudes from 1e16 (float) or 1e140 (double) on.
  constexpr VectorStep<Real> update(Real output, const Real (&values)[Regressors]) noexcept {
    const Sample sample = sample_of(output, values);
    Sample row = sample_of(output, values);
    // Of an index multiplied by the size of a fit, g++ would compute each address anew.
    const Fit& before = second_ ? fits_[1] : fits_[0];
    Fit& next = second_ ? fits_[0] : fits_[1];
    before.rotate(settings.steady, resolution, row, next);
    const Real innovation = innovation_of(sample, before), z = product(innovation, square_root(row.weight));
    before.sum_up(settings.steady, sample, row, next);
    if (PALPATE_UNLIKELY(!(in_range(sample, z) && next.finite()))) {
      return {innovation, alarm_, false, false};
    }
    remember(sample);
    const Judged judged = judge(z, output, row.weight);
    if (PALPATE_LIKELY(judged.watched)) {
      watch(product(judged.limited, judged.inverse), row);
    }
    conclude(judged, before, next);
    learn(judged, row);
    return {innovation, alarm_, true, judged.outlier};
  }

  /// Forget all samples; the settings stay.
  constexpr void reset(Real covariance = default_covariance) noexcept {
    *this = VectorRls(static_cast<const Parameters&>(*this), covariance);
  }

  /// As Rls::visit_state.
  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    const auto whole = [&visit](auto& value) {
      Real number = static_cast<Real>(value);
      visit(number);
      value = static_cast<std::decay_t<decltype(value)>>(number);
    };
    fit().visit_state(visit);
    for (int i = 0; i < Size; ++i) {
      visit(rise_[i]), visit(fall_[i]);
    }
    visit(either_), visit(guarded_), visit(seen_);
    noise_.visit_state(visit);
    influence_.visit_state(visit);
    recent_.visit_state(visit), visit(recent_guarded_);
    whole(held_), whole(next_), whole(alarm_);
    for (Sample& sample : samples_) {
      for (Real& value : sample.regressors) {
        visit(value);
      }
      visit(sample.output);
    }
  }

  /// The estimates: `size` numbers, the intercept last.
  constexpr const Real* coefficients() const noexcept { return fit().coefficients; }
  /// A column of P, for noise of variance 1 and without forgetting, 1 / regressor^2.
  constexpr void covariance(int column, Real (&result)[Size]) const noexcept { fit().covariance(column, result); }
  /// The standard errors, for Student's t with the degrees of freedom that are returned. NaN where the samples do not
  /// determine a coefficient. All NaN, and 0 degrees of freedom, before Size + 4 samples, in total and since a change.
  ///
  /// They contain the correlation of the influences on a coefficient, what the newest quarter of the samples shows beyond noise, and the
  /// rounding of a coefficient by each sample: a variance of (eps coefficient)^2 / 12.
  constexpr Real standard_errors(Real (&result)[Size]) const noexcept {
    const Real left = samples_left(result);
    for (int i = 0; i < Size; ++i) {
      const Real rounded = product(std::numeric_limits<Real>::epsilon(), fit().coefficients[i]);
      const Real of_noise = product(product(result[i], fit().residuals / left), influence_.factor(i));
      const Real apart = recent_.coefficients[i] - fit().coefficients[i];
      const Real variance =
          of_noise + moved(apart, of_noise) + product(product(rounded, rounded), fit().count_squares / 12);
      result[i] = left > 0 ? square_root(variance) : not_a_number<Real>;
    }
    return left > 0 ? product(left, fit().count / fit().count_squares) : Real(0);
  }
  /// The output that these regressors predict, and the standard error of the prediction by all variances and covariances
  /// of the coefficients, by the correlation of the influences on the one where it is largest, and by what the newest samples predict
  /// instead; the noise of a single output is not in it. The error is NaN where the samples do not determine the prediction,
  /// which may be known although no coefficient is: that of regressors like those of the samples.
  constexpr Prediction<Real> predict(const Real (&values)[Regressors]) const noexcept {
    const Sample sample = sample_of(Real(0), values);
    Real value = 0, apart = 0, factor = 1, variances[Size] = {};
    for (int i = 0; i < Size; ++i) {
      value += product(sample.regressors[i], fit().coefficients[i]);
      apart += product(sample.regressors[i], recent_.coefficients[i] - fit().coefficients[i]);
      factor = sample.regressors[i] != 0 ? larger(factor, influence_.factor(i)) : factor;
    }
    const Real left = samples_left(variances);
    if (!(left > 0 && in_range(sample, Real(0)))) {
      return {value, not_a_number<Real>};
    }
    const Real scale = size_of(sample);
    const Real of_noise = product(product(leverage(sample, scale), fit().residuals / left), factor);
    const Real shown = scale > 0 ? apart / scale : Real(0);
    return {value, product(scale, square_root(of_noise + moved(shown, of_noise)))};
  }
  /// The largest side of the CUSUM, in standard deviations.
  constexpr Real statistic() const noexcept {
    Real most = either_;
    for (int i = 0; i < Size; ++i) {
      most = larger(most, larger(rise_[i], fall_[i]));
    }
    return most;
  }
  /// Whether the last sample led to a hand-over; with `alarmed`, whether there is an alarm.
  constexpr bool alarm() const noexcept { return alarm_; }
  /// Sum of the weights of the samples from which the coefficients were computed.
  constexpr Real count() const noexcept { return fit().count; }

 private:
  static constexpr Real rounding = 16 * std::numeric_limits<Real>::epsilon();
  static constexpr Real resolution = 1 / (16 * rounding * rounding);

  static constexpr Real larger(Real left, Real right) noexcept { return left > right ? left : right; }

  // A sum of magnitudes below the limit: none is above it, infinite or NaN.
  static constexpr bool in_range(const Sample& sample, Real z) noexcept {
    constexpr Real limit = std::is_same_v<Real, float> ? Real(1e16) : Real(1e140);
    Real sum = magnitude(sample.output) + magnitude(z);
    for (const Real value : sample.regressors) {
      sum += magnitude(value);
    }
    return sum < limit;
  }

  /// By how much the square of what separates the recent fit from the other one is larger than noise makes it. The recent one has a
  /// share of the samples: its variance is the inverse share of the other one's variance.
  constexpr Real moved(Real apart, Real variance) const noexcept {
    const Real share = product(number_of(recent_) / fit().count, fit().count_squares / fit().count);
    const Real shown = product(apart, apart) - product(variance, 1 / share - 1);
    return shown > 0 ? shown : Real(0);
  }
  /// The number of samples with equal weights that have the same variance.
  static constexpr Real number_of(const Fit& fit) noexcept { return product(fit.count, fit.count / fit.count_squares); }

  /// The sum of the weights without the coefficients that the samples determine; 0 where no error is known. In `result`:
  /// the variances of the coefficients for noise of variance 1.
  constexpr Real samples_left(Real (&result)[Size]) const noexcept {
    const Real left = fit().count - fit().leverages(result, guarded_);
    return fit().count > Size + Real(3.5) && left > 0 ? left : Real(0);
  }

  /// The largest regressor, each in root mean squares of itself.
  constexpr Real size_of(const Sample& sample) const noexcept {
    Real largest = 0;
    for (int i = 0; i < Size; ++i) {
      const Real value = magnitude(sample.regressors[i]);
      const Real square = fit().squares[i * (i + 3) / 2] / fit().count_squares;
      largest = value > 0 ? larger(value / square_root(square), largest) : largest;
    }
    return largest;
  }

  /// x' P Q P x, the variance of theta' x for noise of variance 1; x: the regressors in units of their size. It is at most
  /// x' P x = sum of r^2 / D, with U' r = x. The rotation of a further sample leaves r, without what rounding makes of
  /// regressors that depend on each other; from a fit with theta = 0, and for the output 1, it makes theta = weight P x.
  /// NaN where more than a hundredth of x' P x is of the prior, prior |P x|^2.
  constexpr Real leverage(Sample row, Real scale) const noexcept {
    if (!(scale > 0)) {
      return 0;
    }
    Fit blank = fit(), next = blank;
    for (int i = 0; i < Size; ++i) {
      row.regressors[i] /= scale;
      blank.coefficients[i] = blank.projected[i] = 0;
    }
    row.output = 1;
    blank.rotate(Real(1), resolution, row, next);
    Real most = 0, prior = 0;
    for (int i = 0; i < Size; ++i) {
      next.coefficients[i] /= row.weight;
      prior += product(guarded_, product(next.coefficients[i], next.coefficients[i]));
      most += product(row.regressors[i], row.regressors[i] / fit().diagonal[i]);
    }
    const Real square = quadratic(next.coefficients);
    const Real least = square < most ? square : most;  // most, too, where rounding hides the square
    return prior < product(Real(0.01), most) ? least : not_a_number<Real>;
  }

  /// As LeastSquares::quadratic.
  constexpr Real quadratic(const Real (&values)[Size]) const noexcept {
    Real sum = 0, magnitudes = 0;
    for (int i = 0, j = 0; i < Size; ++i) {
      for (int k = 0; k <= i; ++k, ++j) {
        const Real term = product(product(fit().squares[j], values[i]), k < i ? 2 * values[k] : values[k]);
        sum += term;
        magnitudes += magnitude(term);
      }
    }
    return sum > product(magnitudes, 100 * std::numeric_limits<Real>::epsilon()) ? sum : not_a_number<Real>;
  }

  static constexpr Sample sample_of(Real output, const Real (&values)[Regressors]) noexcept {
    Sample sample;
    for (int i = 0; i < Regressors; ++i) {
      sample.regressors[i] = values[i];
      keep_apart();  // what a caller has just stored, number by number, is loaded in the same pieces
    }
    if constexpr (Intercept) {
      sample.regressors[Regressors] = 1;
    }
    sample.output = output;
    return sample;
  }
  static constexpr Real innovation_of(const Sample& sample, const Fit& fit) noexcept {
    Real innovation = sample.output;
    for (int i = 0; i < Size; ++i) {
      innovation -= product(sample.regressors[i], fit.coefficients[i]);
    }
    return innovation;
  }

  /// A whitened innovation, limited; the innovation that belongs to it; whether the coefficients may not depend on it, and
  /// whether it says something about the noise: in a direction that was unknown it does not.
  struct Judged {
    Real limited, counted, scale, inverse;
    bool watched, outlier, tells;
  };

  // As in AdaptiveWindow: a mean of few magnitudes may be much too small, and data without noise have rounding errors.
  constexpr Real scale_of(Real output) const noexcept {
    Real scale = noise_.scale();
    if (PALPATE_UNLIKELY(seen_ < 64 && seen_ >= warm_up)) {
      scale = product(scale, 1 + 3 / seen_);
    }
    return larger(scale, product(magnitude(output), rounding) + VectorSettings<Real>().min_information);
  }
  PALPATE_INLINE constexpr Judged judge(Real z, Real output, Real weight) const noexcept {
    const Real whitened = noise_.whitened(z), scale = scale_of(output), limit = product(settings.clip, scale);
    const bool watched = seen_ >= warm_up, tells = weight > Real(0.1);
    if (PALPATE_LIKELY(!watched || !(magnitude(whitened) > limit))) {
      return {whitened, z, scale, 1 / scale, watched, false, tells};
    }
    const Real limited = whitened > 0 ? limit : -limit;
    return {limited, noise_.of_whitened(limited), scale, 1 / scale, true, true, tells};
  }

  // Number by number: as sample_of has stored it.
  PALPATE_INLINE constexpr void remember(const Sample& sample) noexcept {
    for (int i = 0; i < Size; ++i) {
      samples_[next_].regressors[i] = sample.regressors[i];
    }
    samples_[next_].output = sample.output;
    next_ = (next_ + 1) % window;
    held_ += held_ < window;
  }

  /// The m-th last one.
  constexpr const Sample& remembered(std::uint32_t m) const noexcept { return samples_[(next_ + window - m) % window]; }

  // Not in watch: for it g++ would load all sides before the branch.
  constexpr void start_sides() noexcept {
    either_ = 0;
    for (int i = 0; i < Size; ++i) {
      rise_[i] = fall_[i] = 0;
    }
  }

  /// Branches on z or on the sign of a regressor would be predicted wrong half the time. Of a select with the constant 0
  /// g++ makes one, of a select of two computed numbers it does not.
  PALPATE_INLINE constexpr void watch(Real z, const Sample& row) noexcept {
    const bool switches = settings.alarmed > 0;
    if (PALPATE_UNLIKELY(alarm_) && !switches) {
      start_sides();
    }
    const Real zero = z - z;
    const auto kept = [zero](Real sum) { return larger(sum, zero); };
    for (int i = 0; i < Size; ++i) {
      const Real signed_z = with_sign(z, row.regressors[i]);
      rise_[i] = kept(rise_[i] + (signed_z - settings.drift));
      fall_[i] = kept(fall_[i] - (signed_z + settings.drift));
    }
    either_ = kept(either_ + (magnitude(z) - (settings.drift + Real(0.8))));  // the mean of |z| is 0.8
    alarm_ = statistic() > (PALPATE_UNLIKELY(alarm_) && switches ? settings.threshold / 4 : settings.threshold);
  }

  /// After the detector: the next fit is the present one, but for an outlier; a change comes first.
  PALPATE_INLINE constexpr void conclude(const Judged& judged, const Fit& before, const Fit& next) noexcept {
    if (PALPATE_UNLIKELY(alarm_) && adapts(judged.scale)) {
      return;
    }
    if (PALPATE_LIKELY(!judged.outlier) || settings.alarmed > 0) {
      if (PALPATE_LIKELY(judged.watched && judged.tells)) {
        influence_.add(before.coefficients, next.coefficients, product(next.count, judged.inverse));
      }
      second_ = !second_;
      guard(settings.steady, fit(), guarded_);
      follow_recent();
    }
  }
  /// Add the last sample to the recent fit, whose memory is a quarter of the other one's, but some samples more at first.
  constexpr void follow_recent() noexcept {
    const Real forgetting = 1 - 4 / (fit().count + 8 * Size);
    recent_.add(forgetting, resolution, remembered(1));
    guard(forgetting, recent_, recent_guarded_);
    if (PALPATE_UNLIKELY(!recent_.finite())) {
      forget_recent();
    }
  }
  constexpr void forget_recent() noexcept {
    recent_ = fit();
    recent_guarded_ = guarded_;
  }

  /// Update the noise model: not while a change is suspected. With `alarmed` always: a scale that is too small would
  /// prolong an alarm.
  PALPATE_INLINE constexpr void learn(const Judged& judged, const Sample& row) noexcept {
    if (PALPATE_UNLIKELY(alarm_) && !(settings.alarmed > 0)) {
      noise_.forget_waiting();
      noise_.remember(Real(0));
    } else if (PALPATE_LIKELY(judged.tells)) {
      seen_ += 1;
      const bool suspected = !(settings.alarmed > 0) && seen_ >= first && statistic() > suspicion;
      const bool rise = PALPATE_UNLIKELY(suspected) && is_rise(judged.limited, row);
      noise_.add(judged.limited, judged.counted, rise, judged.outlier, suspected, seen_);
      noise_.remember(judged.counted);
    }
  }
  /// Whether an innovation is one of a rise of the coefficient that is suspected most.
  constexpr bool is_rise(Real limited, const Sample& row) const noexcept {
    Real most = 0, regressor = 1;
    for (int i = 0; i < Size; ++i) {
      const Real side = larger(rise_[i], fall_[i]);
      regressor = side > most ? row.regressors[i] : regressor;
      most = larger(side, most);
    }
    return with_sign(limited, regressor) > 0;
  }

  constexpr void guard(Real forgetting, Fit& fit, Real& guarded) noexcept {
    guarded = product(forgetting, guarded);
    if (PALPATE_UNLIKELY(guarded < settings.min_information)) {
      fit.strengthen(2 * settings.min_information - guarded);
      guarded = 2 * settings.min_information;
    }
  }

  /// An alarm: a hand-over, or forgetting as `alarmed` says. Returns false if it was noise: then there is no alarm, and the
  /// detector starts anew.
  constexpr bool adapts(Real scale) noexcept {
    if (settings.alarmed > 0) {
      fit().add(settings.alarmed, resolution, remembered(1));
      guard(settings.alarmed, fit(), guarded_);
      follow_recent();
    } else if (!hands_over(product(scale, scale))) {
      alarm_ = false;
      start_sides();
      noise_.accept(seen_);
      return false;
    }
    return true;
  }

  /// A hand-over, from the last m samples. With s^2 the variance, m has the largest
  ///   sum of e^2 - residuals of the new fit - s^2 sum of log(1 / w):
  /// by how much more likely it is that a change was before these samples, their coefficients being unknown; w is the
  /// weight of a sample in the new fit, and 2 (1 - w) / (1 + w) stands for the logarithm. Returns false, without a
  /// hand-over, if neither the suspected samples nor the most likely number of them show a change; fewer than Size + 2
  /// cannot decide.
  constexpr bool hands_over(Real variance) noexcept {
    const std::uint32_t held = held_, suspected = suspected_samples();
    Fit latest(2 * settings.min_information, fit().coefficients), best = latest;
    Real squares = 0, price = 0, most = -std::numeric_limits<Real>::infinity();
    bool shown = false;
    for (std::uint32_t m = 1; m <= held; ++m) {
      const Real innovation = innovation_of(remembered(m), fit());
      const Real weight = latest.add(Real(1), resolution, remembered(m));
      squares += product(innovation, innovation);
      price += 2 * product(variance, (1 - weight) / (1 + weight));
      const Real explained = squares - latest.residuals;
      if (explained - price > most && latest.finite()) {
        most = explained - price;
        best = latest;
        held_ = m;
        shown = shows_change(explained / 4, latest);  // of many numbers one explains more by chance
      }
      if (m == suspected && m >= Size + 2 && !shown && !shows_change(explained, latest)) {
        held_ = held;
        return false;
      }
    }
    fit() = best;
    guarded_ = 2 * settings.min_information;
    forget_recent();
    return true;
  }
  /// The last one, and those before it that wait.
  constexpr std::uint32_t suspected_samples() const noexcept {
    const Real suspected = noise_.waiting() + 1;
    return suspected < static_cast<Real>(held_) ? static_cast<std::uint32_t>(suspected) : held_;
  }
  /// Whether the samples of a fit explain too much for noise with the variance of its residuals (an F test). A side of the
  /// CUSUM above the threshold after n samples has a sum of z above threshold + n drift: a change that explains
  /// (threshold + n drift)^2 / n variances, at least 4 drift threshold. Half of that is required.
  constexpr bool shows_change(Real explained, const Fit& latest) const noexcept {
    const Real left = latest.count - Size, limit = 2 * product(settings.drift, settings.threshold);
    return left > Real(1.5) && product(explained, left) >= product(limit, latest.residuals);
  }

  constexpr Fit& fit() noexcept { return fits_[second_]; }
  constexpr const Fit& fit() const noexcept { return fits_[second_]; }

  Real guarded_;                                         // information that each direction has at least
  Fit fits_[2];                                          // the present one, and the next: no number is copied
  Real recent_guarded_;                                  // as guarded_, of the recent fit
  Fit recent_;                                           // of the newest quarter of the samples
  Real rise_[Size] = {}, fall_[Size] = {}, either_ = 0;  // sides of the CUSUM
  Real seen_ = 0;                                        // samples that say something about the noise
  UnsuspectedNoise<Real> noise_;
  Influence<Real, Size> influence_;
  std::uint32_t held_ = 0, next_ = 0;    // of samples_
  bool alarm_ = false, second_ = false;  // of fits_
  Sample samples_[window] = {};
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
