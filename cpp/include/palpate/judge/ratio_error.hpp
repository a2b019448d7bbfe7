// SPDX-License-Identifier: MIT
#pragma once

// The standard error of a ratio: from the noise of the samples, of the baselines, and of coarse codes.

#include <palpate/estimate.hpp>
#include <palpate/judge/code_steps.hpp>
#include <palpate/settings.hpp>
#include <palpate/square_root.hpp>
#include <palpate/stage/matched_pair.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

namespace detail {
template <class Estimator, class Real = typename Estimator::real_type>
using Scatters = decltype(Real(of<Estimator>().long_run_variance(true)), Real(of<Estimator>().leverage()),
                          Real(of<Estimator>().innovation_variance()), Real(of<Estimator>().count()),
                          Real(of<Estimator>().information()), bool(of<Estimator>().settled()));
template <class Estimator, class Real = typename Estimator::real_type>
using ScattersInBlocks = decltype(Real(of<Estimator>().standard_error()), Real(of<Estimator>().covariance()),
                                  Real(of<Estimator>().innovation_variance()), Real(of<Estimator>().mean_square()),
                                  Real(of<Estimator>().motion()));
}  // namespace detail

/// Whether an estimator has a standard error: the members of Handover of which one is made, or those of AdaptiveWindow.
template <class Estimator>
inline constexpr bool knows_its_error =
    detail::has<detail::Scatters, const Estimator> || detail::has<detail::ScattersInBlocks, const Estimator>;

/// The error of the ratio of an estimator, from the noise of the readings and of the estimator, and from the errors of
/// the baselines, which are common to all samples of a touch.
template <class Estimator, class Baseline, class Judge>
struct RatioError {
  using Real = typename Estimator::real_type;
  const Baseline& hard;   ///< of the hard channel
  const Baseline& soft;   ///< of the soft channel
  const Judge& judge;     ///< with the codes and the slow noise of both
  std::size_t decimated;  ///< readings in a pair
  std::uint32_t samples;  ///< of the touch
  Pace pace;              ///< of the pairs

  /// Variance of hard - ratio * soft.
  static constexpr Real of_ratio(const Estimator& estimator, Real hard_variance, Real soft_variance) noexcept {
    const Real ratio = estimator.ratio();
    return hard_variance + product(product(ratio, ratio), soft_variance);
  }

  /// By codes that are coarser than the noise: step^2 / 12 of the readings, and the same of the baseline.
  constexpr Real rounding(const Estimator& estimator) const noexcept {
    if constexpr (!Judge::judges) {
      return Real(0);
    } else {
      const Real size = decimated > 1 ? square_root(static_cast<Real>(decimated)) : Real(1);
      const Real of_hard = judge.codes.hard.coarse(product(size, hard.noise()));
      const Real of_soft = judge.codes.soft.coarse(product(size, soft.noise()));
      return of_ratio(estimator, product(of_hard, of_hard), product(of_soft, of_soft)) / 6;
    }
  }

  /// The variance that all samples of a touch share: of the baselines, and of noise that is slower than the readings.
  constexpr Real shared(const Estimator& estimator) const noexcept {
    Real of_hard = hard.variance(), of_soft = soft.variance();
    if constexpr (Judge::judges) {
      of_hard += judge.slow.hard.variance;
      of_soft += judge.slow.soft.variance;
    }
    return of_ratio(estimator, of_hard, of_soft) + rounding(estimator);
  }

  /// The standard error of the ratio, from the variance that all samples share and the variance of
  /// the ratio that misfits leave open. NaN without a sample, and of an alias without an innovation that counts.
  ///
  /// The long-run variance of a sample is at least the variance of the readings' noise, because the
  /// alignment does not change a mean. Too few innovations do not show their correlation. Then the
  /// long-run variance is the variance v of the readings' noise, plus 4 times the excess of the
  /// innovations' variance over v / 2. Where a tremor aliases, both channels may be off by a constant that no innovation
  /// shows. There the long-run variance is at least v plus 6 times the excess, and at least that of an AR(1) process: then
  /// the intervals of 88 to 100 % of simulated touches hold, from 2 to 12 pairs a second. For slow pairs it is at least v
  /// plus half of the excess, because jitter of the times leaves a part of the tremor. An error of a baseline changes the ratio by this error divided by the mean
  /// regressor, sqrt(R / W). W is the count.
  constexpr Real with(const Estimator& estimator, Real shared_variance, Real open) const noexcept {
    if (samples == 0 || (pace == Pace::aliases && estimator.innovation_variance() == 0)) {
      return not_a_number<Real>;
    }
    const Real readings =
        of_ratio(estimator, product(hard.noise(), hard.noise()), product(soft.noise(), soft.noise())) +
        rounding(estimator);
    const Real square = own(estimator, readings) + by_all(estimator, shared_variance) + open;
    return square > 0 && is_finite(square) ? square_root(square) : not_a_number<Real>;
  }

  static constexpr Real delay = Real(1.5);  ///< pairs from the middle of an aligned one to its last reading

  /// Of the ratio, by the noise: of the readings and of the innovations; and by its motion since the middle of the pair.
  constexpr Real own(const Estimator& estimator, Real readings) const noexcept {
    if constexpr (detail::has<detail::Scatters, const Estimator>) {
      const Real few = of_few(estimator, readings);
      const Real seen = estimator.settled() ? estimator.long_run_variance(pace == Pace::aliases) : few;
      const Real least = pace == Pace::slow   ? scattered(estimator, readings, Real(0.5))
                         : pace == Pace::fast ? readings
                                              : few;
      return product(seen > least ? seen : least, estimator.leverage());
    } else {
      const Real error = estimator.standard_error(), square = product(error, error);
      const Real least = product(error >= 0 ? readings : of_few(estimator, readings), estimator.covariance());
      const Real behind = product(delay, estimator.motion());
      return (square > least ? square : least) + product(behind, behind);
    }
  }
  constexpr Real of_few(const Estimator& estimator, Real readings) const noexcept {
    return scattered(estimator, readings, Real(pace == Pace::aliases ? 6 : 4));
  }
  static constexpr Real scattered(const Estimator& estimator, Real readings, Real times) noexcept {
    return readings + product(times, positive_part(estimator.innovation_variance() - readings / 2));
  }
  /// Of the ratio, by a variance that all samples share.
  static constexpr Real by_all(const Estimator& estimator, Real variance) noexcept {
    if constexpr (detail::has<detail::Scatters, const Estimator>) {
      return product(variance, estimator.count()) / estimator.information();
    } else {
      return variance / estimator.mean_square();
    }
  }

  /// Of a running touch; NaN: too few samples, or the estimator has no standard error.
  constexpr Real of(const Estimator& estimator) const noexcept {
    if constexpr (knows_its_error<Estimator>) {
      return with(estimator, shared(estimator), Real(0));
    } else {
      return not_a_number<Real>;
    }
  }
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
