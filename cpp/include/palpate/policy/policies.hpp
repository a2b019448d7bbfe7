// SPDX-License-Identifier: MIT
#pragma once

// The policies of an estimator together, and what each one must have: docs/write_your_own.md.

#include <palpate/settings.hpp>

namespace palpate {
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
      "regressor, alarm); if that is not const: reset() and visit_state(visit), and it cannot be a Constant");
  static_assert(
      is_policy<Detects, Real, policy_type<Detector>>(),
      "palpate::Rls: a Detector needs real_type, which is the estimator's Real; next(innovation), alarm() and "
      "statistic(); if next is not const: reset() and visit_state(visit), and it cannot be a Constant");
  static_assert(
      is_policy<Limits, Real, policy_type<Bound>>(),
      "palpate::Rls: a Bound needs real_type, which is the estimator's Real; limit(information); if that is not "
      "const: reset() and visit_state(visit), and it cannot be a Constant");

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
    each(forgetting());
    each(detector());
    each(bound());
  }
};

}  // namespace detail
}  // namespace palpate
