// SPDX-License-Identifier: MIT
#pragma once

// Recursive least squares for one parameter, output(k) = ratio * regressor(k) + e(k), with exponential forgetting.
// No function throws, allocates memory, or stores anything outside the object.

#include <palpate/policy/acceptance.hpp>
#include <palpate/policy/bound.hpp>
#include <palpate/policy/detector.hpp>
#include <palpate/policy/forgetting.hpp>
#include <palpate/settings.hpp>

namespace palpate {

/// Result of one sample. accepted is false if the sample was refused: then the state did not change.
template <class Real>
struct Step {
  Real ratio;            ///< after the sample
  Real innovation;       ///< output - regressor * (the ratio before)
  Real gain;             ///< K, 1/pF; 0 if the sample was refused, and at a hand-over
  bool alarm;            ///< of the detector
  bool accepted;         ///< the sample is in the state
  bool outlier = false;  ///< too large to be noise: only Handover says so
};

namespace detail {
// A separate base class, so that ratio and information are not neighbours in memory: g++ would keep neighbours in one
// SIMD register, and every sample would wait for both.
template <class Real>
struct RatioOf {
  constexpr explicit RatioOf(Real ratio) noexcept : ratio_(ratio) {}
  Real ratio_;
};

/// Signed statistic of a detector; zero bytes without a detector.
template <class Real, bool kept>
struct StatisticOf {
  Real signed_statistic_ = 0;
};
template <class Real>
struct StatisticOf<Real, false> {
  static constexpr Real signed_statistic_ = 0;
};
}  // namespace detail

/// Recursive least squares in the residual information form. With R = 1/P, lambda from the forgetting policy and x the
/// regressor:
///
///     e  = output - x r        the paper's step 2
///     R' = lambda R + x^2      its P(k) = P / (lambda + x^2 P), inverted: a sum of positive terms, no cancellation
///     K  = x / R'              its K(k) = P x / (lambda + x P x), as lambda/P + x^2 = R'
///     r' = r + K e             step 4
///
/// If the ratio, information or statistic would not be finite after a sample (NaN, infinity, overflow of x^2), the
/// sample is refused and the state keeps the same bits.
/// Forgetting, Detector and Bound are policies with their parameters in the object, or Constant policies: settings.hpp.
template <class Real, class Forgetting = NoForgetting<Real>, class Detector = NoDetector<Real>,
          class Bound = Unbounded<Real>, class Check = Checked>
class Rls : detail::RatioOf<Real>,
            Forgetting,
            Detector,
            detail::StatisticOf<Real, policy_type<Detector>::has_statistic>,
            Bound {
  static_assert(is_real<Real>, "palpate::Rls: Real must be float or double");
  static_assert(std::is_same_v<Real, typename policy_type<Forgetting>::real_type> &&
                    std::is_same_v<Real, typename policy_type<Detector>::real_type> &&
                    std::is_same_v<Real, typename policy_type<Bound>::real_type>,
                "palpate::Rls: Forgetting, Detector and Bound must be of the same Real as the estimator");
  static constexpr bool keeps_statistic = policy_type<Detector>::has_statistic;

 public:
  using real_type = Real;                                 ///< float or double
  using check_type = Check;                               ///< Checked or Unchecked
  static constexpr Real default_covariance = Real(1e12);  ///< of the initial ratio: as good as unknown, 1/pF^2

  /// With these policies, an initial ratio and its covariance, 1/pF^2.
  constexpr explicit Rls(Forgetting forgetting = Forgetting(), Detector detector = Detector(), Bound bound = Bound(),
                         Real ratio = Real(1), Real covariance = default_covariance) noexcept
      : detail::RatioOf<Real>(ratio),
        Forgetting(forgetting),
        Detector(detector),
        Bound(bound),
        information_(Real(1) / covariance) {}

  /// One sample: the changes of both channels from their baselines, pF.
  constexpr Step<Real> update(Real output, Real regressor) noexcept {
    const Real innovation = output - product(regressor, ratio_);
    const Real statistic = detector().next(magnitude(signed_statistic_), innovation);
    const bool alarm = detector().alarm(statistic, is_alarm(signed_statistic_));
    const Real discounted = forgetting().discount(information_, alarm);
    const Real information = bound().limit(discounted) + product(regressor, regressor);
    const Real gain = regressor / information;
    const Real ratio = ratio_ + product(gain, innovation);
    if (PALPATE_UNLIKELY(!Check::passes(ratio, information, statistic))) {
      return refusal(ratio_, innovation, is_alarm(signed_statistic_));
    }
    ratio_ = ratio;
    information_ = information;
    set_signed_statistic(alarm ? -statistic : statistic);
    return {ratio, innovation, gain, alarm, true};
  }

  /// Forget all samples; the parameters of the policies stay.
  constexpr void reset(Real ratio = Real(1), Real covariance = default_covariance) noexcept {
    ratio_ = ratio;
    information_ = Real(1) / covariance;
    set_signed_statistic(Real(0));
  }

  /// Call `visit` with a reference to each number of the state: to save it, or to restore it.
  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    visit(ratio_);
    visit(information_);
    if constexpr (keeps_statistic) {
      visit(signed_statistic_);
    }
  }

  /// The estimate r.
  constexpr Real ratio() const noexcept { return ratio_; }
  /// R = 1 / P, pF^2.
  constexpr Real information() const noexcept { return information_; }
  /// P, unscaled: the variance of the ratio for noise of variance 1, 1/pF^2.
  constexpr Real covariance() const noexcept { return Real(1) / information_; }
  /// g of the detector, in the unit of the output; 0 without a detector.
  constexpr Real statistic() const noexcept { return magnitude(signed_statistic_); }
  /// As the detector keeps it: negative during an alarm.
  constexpr Real signed_statistic() const noexcept { return signed_statistic_; }
  /// Whether the detector has an alarm.
  constexpr bool alarm() const noexcept { return is_alarm(signed_statistic_); }
  /// The forgetting policy, with its parameters.
  constexpr const auto& forgetting() const noexcept { return policy_in(static_cast<const Forgetting&>(*this)); }
  /// The detector, with its parameters.
  constexpr const auto& detector() const noexcept { return policy_in(static_cast<const Detector&>(*this)); }
  /// The bound, with its parameters.
  constexpr const auto& bound() const noexcept { return policy_in(static_cast<const Bound&>(*this)); }

 private:
  // Not inlined, so that no compiler makes a select of old and new state from the check: see SwitchedForgetting.
  PALPATE_COLD static constexpr Step<Real> refusal(Real ratio, Real innovation, bool alarm) noexcept {
    return {ratio, innovation, Real(0), alarm, false};
  }

  static constexpr bool is_alarm(Real signed_statistic) noexcept { return keeps_statistic && signed_statistic < 0; }
  constexpr void set_signed_statistic([[maybe_unused]] Real signed_statistic) noexcept {
    if constexpr (keeps_statistic) {
      signed_statistic_ = signed_statistic;
    }
  }

  using detail::RatioOf<Real>::ratio_;
  using detail::StatisticOf<Real, keeps_statistic>::signed_statistic_;
  Real information_;
};

/// The estimator of the paper, with its parameters as defaults.
template <class Real>
using AdaptiveRls = Rls<Real, SwitchedForgetting<Real>, Cusum<Real>, BoundedCovariance<Real>>;
/// Ordinary recursive least squares, one forgetting factor, with the same checks.
template <class Real>
using FixedRls = Rls<Real, FixedForgetting<Real>, NoDetector<Real>, BoundedCovariance<Real>>;

}  // namespace palpate
