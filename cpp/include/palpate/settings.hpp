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

/// The policy itself, or the one that a Constant names.
template <class Policy>
constexpr const Policy& policy_in(const Policy& policy) noexcept {
  return policy;
}
/// The same for a Constant.
template <const auto& values>
constexpr const auto& policy_in(const Constant<values>&) noexcept {
  return values;
}
/// Its type.
template <class Policy>
using policy_type = std::decay_t<decltype(policy_in(std::declval<const Policy&>()))>;

}  // namespace palpate
