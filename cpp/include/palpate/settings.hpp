// SPDX-License-Identifier: MIT
#pragma once

// Settings as members of the object, or as compile-time constants. Constant takes a constexpr object:
// defaults<ContactSettings<float>>, or one of your own at namespace scope,
//   constexpr palpate::SwitchedForgetting<float> mine{0.99f, 0.8f};    palpate::Constant<mine>

#include <palpate/arithmetic.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

namespace detail {
// Whether a type has the members in the expression Needs.
template <template <class...> class Needs, class Type, class = void>
inline constexpr bool has = false;
template <template <class...> class Needs, class Type>
inline constexpr bool has<Needs, Type, std::void_t<Needs<Type>>> = true;

// An object for such an expression.
template <class Type>
Type& of() noexcept;

struct VisitNothing {
  template <class... Values>
  constexpr void operator()(Values&&...) const noexcept {}
};
template <class Values>
using VisitsFields = decltype(Values::visit_fields(of<Values>(), VisitNothing()));
}  // namespace detail

/// Settings with their default values.
template <class Values>
inline constexpr Values defaults = Values();

/// Settings as a member: each object has its own, and may change them. Their initial value is `first`.
template <class Values, const Values& first = defaults<Values>>
struct Kept {
  Values settings = first;  ///< may be changed at any time
};

/// Whether all settings are in their ranges, which visit_fields of each struct has.
template <class Values>
constexpr bool valid(const Values& values) noexcept {
  bool all = true;
  if constexpr (detail::has<detail::VisitsFields, const Values>) {
    Values::visit_fields(values, [&all](auto, const auto&, bool allowed, auto) { all = all && allowed; });
  }
  return all;
}

/// Settings as a compile-time constant: no byte of state, no load. Use it in place of Kept, or of a policy of Rls.
template <const auto& values>
struct Constant {
  static_assert(valid(values), "palpate::Constant: a setting is out of its range, see visit_fields of its struct");
  static constexpr const auto& settings = values;  ///< the constant
};

namespace detail {
template <class Type>
inline constexpr bool is_constant = false;
template <const auto& values>
inline constexpr bool is_constant<Constant<values>> = true;

// The policy itself, or the one that a Constant names, which is const.
template <class Policy>
constexpr auto& policy_in(Policy& policy) noexcept {
  if constexpr (is_constant<std::remove_const_t<Policy>>) {
    return policy.settings;
  } else {
    return policy;
  }
}
template <class Policy>
using policy_type = std::remove_reference_t<decltype(policy_in(std::declval<Policy&>()))>;
}  // namespace detail

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
