// SPDX-License-Identifier: MIT
#pragma once

// Settings as members of the object, or as compile-time constants. Constant takes a constexpr object:
// defaults<ContactSettings<float>>, or one of your own at namespace scope,
//   constexpr palpate::SwitchedForgetting<float> mine{0.99f, 0.8f};    palpate::Constant<mine>

#include <palpate/arithmetic.hpp>
#include <utility>

namespace palpate {

/// Settings with their default values.
template <class Values>
inline constexpr Values defaults = Values();

/// Settings as a member: each object has its own, and may change them. Their initial value is `first`.
template <class Values, const Values& first = defaults<Values>>
struct Kept {
  Values settings = first;  ///< may be changed at any time
};

/// Settings as a compile-time constant: no byte of state, no load. Use it in place of Kept, or of a policy of Rls.
template <const auto& values>
struct Constant {
  static constexpr const auto& settings = values;  ///< the constant
};
/// Whether a type is one.
template <class Type>
inline constexpr bool is_constant = false;
template <const auto& values>
inline constexpr bool is_constant<Constant<values>> = true;

namespace detail {
// Whether a type has the members in the expression Needs.
template <class Void, template <class...> class Needs, class Type>
inline constexpr bool allows = false;
template <template <class...> class Needs, class Type>
inline constexpr bool allows<std::void_t<Needs<Type>>, Needs, Type> = true;
template <template <class...> class Needs, class Type>
inline constexpr bool has = allows<void, Needs, Type>;

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

}  // namespace palpate
