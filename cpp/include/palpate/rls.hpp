// SPDX-License-Identifier: MIT
#pragma once

// Recursive least squares for one parameter, output(k) = ratio * regressor(k) + e(k), with exponential forgetting.
// No function throws, allocates, or keeps anything outside the object.

#include <palpate/bound.hpp>
#include <palpate/check.hpp>
#include <palpate/detector.hpp>
#include <palpate/forgetting.hpp>

namespace palpate {

/// What one sample did. accepted is false where it was refused: then nothing but this value records it.
template <class Real>
struct Step {
  Real ratio;
  Real innovation;  // output - regressor * (the ratio before)
  Real gain;
  bool alarm;
  bool accepted;
};

namespace detail {
// A base of its own, so that ratio and information are not neighbours in memory: g++ would keep two neighbours in one
// SIMD register, and every sample would wait for both.
template <class Real>
struct RatioOf {
  constexpr explicit RatioOf(Real ratio) noexcept : ratio_(ratio) {}
  Real ratio_;
};
}  // namespace detail

/// The residual information form. With R = 1/P, lambda from the forgetting policy and x the regressor:
///   e  = output - x r                the paper's step 2
///   R' = lambda R + x^2              its P(k) = P / (lambda + x^2 P), inverted: a sum of positive terms, no
///   cancellation K  = x / R'                      its K(k) = P x / (lambda + x P x), as lambda/P + x^2 = R' r' = r + K
///   e                     step 4
/// A sample after which any of ratio, information or statistic would not be finite (NaN, infinity, overflow of x^2) is
/// refused, and the state stays bit for bit as it was.
template <class Real, class Forgetting = NoForgetting<Real>, class Detector = NoDetector<Real>,
          class Bound = Unbounded<Real>, class Check = Checked>
class Rls : detail::RatioOf<Real>, Forgetting, Detector, Bound {
  static_assert(is_real<Real>, "palpate::Rls: Real must be float or double");
  static_assert(std::is_same_v<Real, typename Forgetting::real_type> &&
                    std::is_same_v<Real, typename Detector::real_type> &&
                    std::is_same_v<Real, typename Bound::real_type>,
                "palpate::Rls: Forgetting, Detector and Bound must be of the same Real as the estimator");

 public:
  using real_type = Real;
  static constexpr Real default_covariance = Real(1e4);

  constexpr explicit Rls(Forgetting forgetting = Forgetting(), Detector detector = Detector(), Bound bound = Bound(),
                         Real ratio = Real(1), Real covariance = default_covariance) noexcept
      : detail::RatioOf<Real>(ratio),
        Forgetting(forgetting),
        Detector(detector),
        Bound(bound),
        information_(Real(1) / covariance) {}

  constexpr Step<Real> update(Real output, Real regressor) noexcept {
    const Real innovation = output - product(regressor, ratio_);
    Detector detector = *this;
    const bool alarm = detector.update(innovation);
    const Real information = Bound::limit(Forgetting::discount(information_, alarm)) + product(regressor, regressor);
    const Real gain = regressor / information;
    const Real ratio = ratio_ + product(gain, innovation);
    if (PALPATE_UNLIKELY(!Check::passes(ratio, information, detector))) {
      return refusal(ratio_, innovation, Detector::alarm());
    }
    ratio_ = ratio;
    information_ = information;
    static_cast<Detector&>(*this) = detector;
    return {ratio, innovation, gain, alarm, true};
  }

  /// Forget every sample; the policies' parameters stay.
  constexpr void reset(Real ratio = Real(1), Real covariance = default_covariance) noexcept {
    ratio_ = ratio;
    information_ = Real(1) / covariance;
    Detector::reset();
  }

  /// Give every number of the state to `visit`, by reference: to save it, and to continue from it.
  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    visit(ratio_);
    visit(information_);
    Detector::visit_state(visit);
  }

  constexpr Real ratio() const noexcept { return ratio_; }
  constexpr Real information() const noexcept { return information_; }
  constexpr Real covariance() const noexcept { return Real(1) / information_; }
  constexpr Real statistic() const noexcept { return Detector::statistic; }
  constexpr bool alarm() const noexcept { return Detector::alarm(); }
  constexpr const Forgetting& forgetting() const noexcept { return *this; }
  constexpr const Detector& detector() const noexcept { return *this; }
  constexpr const Bound& bound() const noexcept { return *this; }

 private:
  // Out of line, so that no compiler turns the check into a select of old and new state: see SwitchedForgetting.
  PALPATE_COLD static constexpr Step<Real> refusal(Real ratio, Real innovation, bool alarm) noexcept {
    return {ratio, innovation, Real(0), alarm, false};
  }

  using detail::RatioOf<Real>::ratio_;
  Real information_;
};

/// The paper's estimator with its parameters as defaults; ordinary RLS with the same safety.
template <class Real>
using AdaptiveRls = Rls<Real, SwitchedForgetting<Real>, Cusum<Real>, BoundedCovariance<Real>>;
template <class Real>
using FixedRls = Rls<Real, FixedForgetting<Real>, NoDetector<Real>, BoundedCovariance<Real>>;

}  // namespace palpate
