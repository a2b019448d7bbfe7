// SPDX-License-Identifier: MIT
#pragma once

// The policies of Rls: forgetting, change detectors, bounds of the covariance, checks of a sample. What each one must have:
// docs/write_your_own.md.

#include <palpate/settings.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

// Forgetting: the fraction lambda of the information R = 1/P that remains at the next sample.
// A memory of about 2 / (1 - lambda) samples: 400 at 0.995, 20 at 0.9 (the paper's rule).
//
// Each has discount(information, innovation, regressor, alarm): the information R of the samples before, the innovation e
// and the regressor x of this one, and whether the detector has an alarm with it. It returns lambda R.

/// The null policy, lambda = 1: all samples have the same weight for ever. In float, R stops growing at 2^24 x^2, and
/// later samples have too much weight: for so many samples use double.
template <class Real>
struct NoForgetting {
  using real_type = Real;  ///< float or double
  /// The information unchanged.
  static constexpr Real discount(Real information, Real, Real, bool) noexcept { return information; }
};

/// Ordinary RLS: one lambda.
template <class Real>
struct FixedForgetting {
  using real_type = Real;         ///< float or double
  Real forgetting = Real(0.995);  ///< lambda, above 0 and up to 1

  /// lambda R.
  constexpr Real discount(Real information, Real, Real, bool) const noexcept {
    return product(forgetting, information);
  }
  /// Call `visit` with the name of each setting, a reference to it, whether it is allowed, and what is allowed.
  static constexpr auto visit_fields = [](auto& s, auto&& visit) noexcept {
    visit("forgetting", s.forgetting, 0 < s.forgetting && s.forgetting <= 1, "0 < forgetting <= 1");
  };
};

/// The policy of the paper: lambda = alarmed during an alarm of the detector, otherwise steady.
template <class Real>
struct SwitchedForgetting {
  using real_type = Real;     ///< float or double
  Real steady = Real(0.995);  ///< lambda without an alarm, above 0 and up to 1
  Real alarmed = Real(0.9);   ///< lambda during an alarm

  /// lambda R.
  // A predicted branch, not a select: with a select every ratio would wait for the detector and the division, and take
  // three times as long.
  constexpr Real discount(Real information, Real, Real, bool alarm) const noexcept {
    if (PALPATE_UNLIKELY(alarm)) {
      return product(alarmed, information);
    }
    return product(steady, information);
  }
  /// As FixedForgetting::visit_fields.
  static constexpr auto visit_fields = [](auto& s, auto&& visit) noexcept {
    visit("steady", s.steady, 0 < s.steady && s.steady <= 1, "0 < steady <= 1");
    visit("alarmed", s.alarmed, 0 < s.alarmed && s.alarmed <= s.steady, "0 < alarmed <= steady");
  };
};

// Change detectors: raise an alarm when the innovations e(k) show that the ratio has changed.
//
// Each has next(innovation), which returns whether there is an alarm; alarm(), the same again; and statistic(). One with
// a state has reset() and visit_state(visit), too.

/// The null policy: never an alarm.
template <class Real>
struct NoDetector {
  using real_type = Real;  ///< float or double
  /// No alarm.
  static constexpr bool next(Real) noexcept { return false; }
  /// No alarm.
  static constexpr bool alarm() noexcept { return false; }
  /// 0.
  static constexpr Real statistic() noexcept { return Real(0); }
};

/// Settings of Cusum, in the unit of the output (pF); 0 <= clear_level <= threshold.
template <class Real>
struct CusumSettings {
  Real drift = Real(0.01);      ///< d: what noise may add to |e|, pF
  Real threshold = Real(0.05);  ///< h: an alarm is above it, pF
  Real clear_level = Real(0);   ///< an alarm ends there, pF

  /// As FixedForgetting::visit_fields.
  static constexpr auto visit_fields = [](auto& s, auto&& visit) noexcept {
    visit("drift", s.drift, s.drift >= 0 && is_finite(static_cast<float>(s.drift)), "0 <= drift, finite");
    visit("threshold", s.threshold, s.threshold >= 0, "0 <= threshold");
    visit("clear_level", s.clear_level, 0 <= s.clear_level && s.clear_level <= s.threshold,
          "0 <= clear_level <= threshold");
  };
};

/// The cumulative sum of |e| of the paper, two-sided because of the absolute value:
///
///     g(k) = max(0, g(k-1) + |e(k)| - d)
///
/// The alarm is set when g(k) > h, and cleared when g(k) has come back to the clear level: 0 in the paper, so an alarm
/// that is on stays on until g(k) = 0. With clear_level = threshold, alarm(k) = g(k) > h. Page, Biometrika 41 (1954).
template <class Real, class Parameters = Kept<CusumSettings<Real>>>
struct Cusum : Parameters {
  using real_type = Real;  ///< float or double
  using Parameters::settings;
  Real signed_statistic = 0;  ///< g, negative during an alarm: that needs a g above 0, so the sign is never in doubt

  /// Takes e(k). Returns alarm(k).
  constexpr bool next(Real innovation) noexcept {
    // |e| - d first: if |e| <= d, this difference is not positive, so rounding cannot increase g.
    const Real sum = positive_part(statistic() + (magnitude(innovation) - settings.drift));
    const bool on = alarm() ? sum > settings.clear_level : sum > settings.threshold;  // as in SwitchedForgetting
    signed_statistic = on ? -sum : sum;
    return on;
  }
  /// alarm(k).
  constexpr bool alarm() const noexcept { return signed_statistic < 0; }
  /// g(k).
  constexpr Real statistic() const noexcept { return magnitude(signed_statistic); }
  /// Back to 0.
  constexpr void reset() noexcept { signed_statistic = 0; }
  /// As Rls::visit_state.
  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    visit(signed_statistic);
  }
};

// Bounds on the covariance: without excitation (regressor 0) the information R decays as lambda^k and P = 1/R would
// grow without limit (covariance wind-up), and R would reach subnormal numbers, where arithmetic is slow.

/// The null policy, for regressors that are never 0 for long.
template <class Real>
struct Unbounded {
  using real_type = Real;  ///< float or double
  /// The information unchanged.
  static constexpr Real limit(Real information) noexcept { return information; }
};

/// P / lambda <= 1 / min_information before each sample, so P never exceeds this limit either.
/// Equivalent to a forgetting factor raised to lambda' = max(lambda, P min_information): see palpate.reference.
template <class Real>
struct BoundedCovariance {
  using real_type = Real;              ///< float or double
  Real min_information = Real(1e-12);  ///< 1 / the largest covariance, pF^2

  /// The information, at least `min_information`.
  constexpr Real limit(Real information) const noexcept {
    return information > min_information ? information : min_information;
  }
  /// As FixedForgetting::visit_fields.
  static constexpr auto visit_fields = [](auto& s, auto&& visit) noexcept {
    visit("min_information", s.min_information, s.min_information > 0, "0 < min_information");
  };
};

// Checks: whether a sample may change the state.

/// The null policy: every sample is accepted. For samples that were checked before: they and their squares must be
/// finite. After one NaN or infinity the ratio is NaN until the next reset.
struct Unchecked {
  /// Always true.
  template <class Real>
  static constexpr bool passes(Real, Real, Real) noexcept {
    return true;
  }
};

/// Accepts a sample only if ratio, information and statistic are finite after it.
struct Checked {
  /// Whether all three are finite.
  template <class Real>
  static constexpr bool passes(Real ratio, Real information, Real statistic) noexcept {
    return is_finite(ratio) && is_finite(information) && is_finite(statistic);
  }
};

namespace detail {

template <class Policy, class Real = typename Policy::real_type>
using Discounts = decltype(Real(of<Policy>().discount(Real(), Real(), Real(), bool())));
template <class Policy, class Real = typename Policy::real_type>
using Detects =
    decltype(bool(of<Policy>().next(Real())), bool(of<const Policy>().alarm()), Real(of<const Policy>().statistic()));
template <class Check>
using Passes = decltype(bool(Check::passes(double(), double(), double())));
template <class Policy, class Real = typename Policy::real_type>
using Limits = decltype(Real(of<Policy>().limit(Real())));
template <class State>
using VisitsState = decltype(of<State>().visit_state(VisitNothing()));
template <class Policy>
using Resets = decltype(of<Policy>().reset(), VisitsState<Policy>());

// Whether a policy has the members that it needs: one that its use changes has a reset, too, and is no Constant.
template <template <class...> class Needs, class Real, class Policy>
constexpr bool is_policy() noexcept {
  if constexpr (has<Needs, Policy>) {
    return std::is_same_v<typename Policy::real_type, Real> && (has<Needs, const Policy> || has<Resets, Policy>);
  } else {
    return false;
  }
}

/// The policies as bases: one without members costs no byte.
template <class Real, class Forgetting, class Detector, class Bound>
struct Policies : Forgetting, Detector, Bound {
  static_assert(
      is_policy<Discounts, Real, policy_type<Forgetting>>(),
      "palpate::Rls: a Forgetting needs real_type, which is the estimator's Real; discount(information, innovation, "
      "regressor, alarm); with a state also reset() and visit_state(visit)");
  static_assert(
      is_policy<Detects, Real, policy_type<Detector>>(),
      "palpate::Rls: a Detector needs real_type, which is the estimator's Real; next(innovation), alarm() and "
      "statistic(); with a state also reset() and visit_state(visit)");
  static_assert(
      is_policy<Limits, Real, policy_type<Bound>>(),
      "palpate::Rls: a Bound needs real_type, which is the estimator's Real; limit(information); with a state "
      "also reset() and visit_state(visit)");

  constexpr Policies(const Forgetting& forgets, const Detector& detects, const Bound& bounds) noexcept
      : Forgetting(forgets), Detector(detects), Bound(bounds) {}

  constexpr auto& forgetting() noexcept { return policy_in<Forgetting>(*this); }
  constexpr auto& forgetting() const noexcept { return policy_in<const Forgetting>(*this); }
  constexpr auto& detector() noexcept { return policy_in<Detector>(*this); }
  constexpr auto& detector() const noexcept { return policy_in<const Detector>(*this); }
  constexpr auto& bound() noexcept { return policy_in<Bound>(*this); }
  constexpr auto& bound() const noexcept { return policy_in<const Bound>(*this); }

  /// Calls work(policy) for each one that has a state.
  template <class Work>
  constexpr void for_each_state(Work work) noexcept {
    const auto each = [&work](auto& policy) {
      if constexpr (has<Resets, std::remove_reference_t<decltype(policy)>>) {
        work(policy);
      }
    };
    each(forgetting()), each(detector()), each(bound());
  }
};

}  // namespace detail

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
