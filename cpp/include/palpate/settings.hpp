// SPDX-License-Identifier: MIT
#pragma once

// Where settings are: in the object, or in the program, as constants. Constant takes a constexpr object:
// defaults<ContactSettings<float>>, or one of your own at namespace scope,
//   constexpr palpate::SwitchedForgetting<float> mine{0.99f, 0.8f};    palpate::Constant<mine>

#include <palpate/arithmetic.hpp>
#include <utility>

namespace palpate {

template <class Values>
inline constexpr Values defaults = Values();

/// Settings that an object keeps: they may differ from object to object, and change. They begin as `first`.
template <class Values, const Values& first = defaults<Values>>
struct Kept {
  Values settings = first;
};

/// Settings that the compiler knows: no byte of state, no load. It stands in the place of Kept, and of a policy of Rls.
template <const auto& values>
struct Constant {
  static constexpr const auto& settings = values;
};

/// The policy that `policy` is, or names.
template <class Policy>
constexpr const Policy& policy_in(const Policy& policy) noexcept {
  return policy;
}
template <const auto& values>
constexpr const auto& policy_in(const Constant<values>&) noexcept {
  return values;
}
template <class Policy>
using policy_type = std::decay_t<decltype(policy_in(std::declval<const Policy&>()))>;

}  // namespace palpate
