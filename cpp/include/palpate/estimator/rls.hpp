// SPDX-License-Identifier: MIT
#pragma once

// Recursive least squares for one parameter, output(k) = ratio * regressor(k) + e(k), with exponential forgetting.
// No function throws, allocates memory, or stores anything outside the object.

#include <palpate/policy/policies.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// Result of one sample. accepted is false if the sample was refused: then the state did not change.
template <class Real>
struct Step {
  Real ratio;            ///< after the sample
  Real innovation;       ///< output - regressor * (the ratio before)
  Real gain;             ///< K, 1/pF; 0 if the sample was refused, and at a hand-over
  bool alarm;            ///< of the detector
  bool accepted;         ///< the sample is in the state
  bool outlier = false;  ///< too large to be noise: only Handover says so
  bool drifts = false;   ///< the ratio drifts (Handover): old samples were forgotten faster
};

namespace detail {
// A separate base class, so that ratio and information are not neighbours in memory: g++ would keep neighbours in one
// SIMD register, and every sample would wait for both.
template <class Real>
struct RatioOf {
  constexpr explicit RatioOf(Real ratio) noexcept : ratio_(ratio) {}
  Real ratio_;
};

template <class Real>
constexpr Step<Real> refusal(Real ratio, Real innovation, bool alarm) noexcept {
  return {ratio, innovation, Real(0), alarm, false};
}
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
/// A policy may have a state, which changes only if the sample is accepted: docs/write_your_own.md.
template <class Real, class Forgetting = NoForgetting<Real>, class Detector = NoDetector<Real>,
          class Bound = Unbounded<Real>, class Check = Checked>
class Rls : detail::RatioOf<Real>, detail::Policies<Real, Forgetting, Detector, Bound> {
  static_assert(is_real<Real>, "palpate::Rls: Real must be float or double");
  static_assert(detail::has<detail::Passes, Check>,
                "palpate::Rls: a Check needs passes(ratio, information, statistic), which is static");
  using Policies = detail::Policies<Real, Forgetting, Detector, Bound>;

 public:
  using real_type = Real;                                 ///< float or double
  static constexpr Real default_covariance = Real(1e12);  ///< of the initial ratio: as good as unknown, 1/pF^2

  /// With the policies' default settings.
  constexpr Rls() noexcept : Rls(Forgetting()) {}
  /// With these policies, an initial ratio and its covariance, 1/pF^2.
  constexpr explicit Rls(const Forgetting& first_forgetting, const Detector& first_detector = Detector(),
                         const Bound& first_bound = Bound(), Real ratio = Real(1),
                         Real covariance = default_covariance) noexcept
      : detail::RatioOf<Real>(ratio),
        Policies{first_forgetting, first_detector, first_bound},
        information_(Real(1) / covariance) {}

  /// One sample: the changes of both channels from their baselines, pF.
  constexpr Step<Real> update(Real output, Real regressor) noexcept {
    Policies next = *this;
    const Real innovation = output - product(regressor, ratio_);
    const bool alarm = next.detector().next(innovation);
    const Real discounted = next.forgetting().discount(information_, innovation, regressor, alarm);
    const Real information = next.bound().limit(discounted) + product(regressor, regressor);
    const Real gain = regressor / information;
    const Real ratio = ratio_ + product(gain, innovation);
    if (PALPATE_UNLIKELY(!Check::passes(ratio, information, Real(next.detector().statistic())))) {
      keep_branch();
      return detail::refusal(ratio_, innovation, this->alarm());
    }
    ratio_ = ratio;
    information_ = information;
    static_cast<Policies&>(*this) = next;
    return {ratio, innovation, gain, alarm, true};
  }

  /// Forget all samples; the parameters of the policies stay.
  constexpr void reset(Real ratio = Real(1), Real covariance = default_covariance) noexcept {
    ratio_ = ratio;
    information_ = Real(1) / covariance;
    Policies::for_each_state([](auto& policy) { policy.reset(); });
  }

  /// Call `visit` with a reference to each number of the state: to save it, or to restore it.
  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    visit(ratio_), visit(information_);
    Policies::for_each_state([&visit](auto& policy) { policy.visit_state(visit); });
  }

  using Policies::bound;       ///< the bound, with its parameters
  using Policies::detector;    ///< the detector, with its parameters
  using Policies::forgetting;  ///< the forgetting policy, with its parameters

  /// The estimate r.
  constexpr Real ratio() const noexcept { return ratio_; }
  /// R = 1 / P, pF^2.
  constexpr Real information() const noexcept { return information_; }
  /// P, unscaled: the variance of the ratio for noise of variance 1, 1/pF^2.
  constexpr Real covariance() const noexcept { return Real(1) / information_; }
  /// g of the detector, in the unit of the output; 0 without a detector.
  constexpr Real statistic() const noexcept { return detector().statistic(); }
  /// Whether the detector has an alarm.
  constexpr bool alarm() const noexcept { return detector().alarm(); }

 private:
  using detail::RatioOf<Real>::ratio_;
  Real information_;
};

/// The estimator of the paper, with its parameters as defaults.
template <class Real>
using AdaptiveRls = Rls<Real, SwitchedForgetting<Real>, Cusum<Real>, BoundedCovariance<Real>>;
/// Ordinary recursive least squares, one forgetting factor, with the same checks.
template <class Real>
using FixedRls = Rls<Real, FixedForgetting<Real>, NoDetector<Real>, BoundedCovariance<Real>>;

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
