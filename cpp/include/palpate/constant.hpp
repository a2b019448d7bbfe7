// SPDX-License-Identifier: MIT
#pragma once

// Where settings are kept: in the object, or in the program, as constants. Each of the templates here takes a constexpr
// object: defaults<ContactSettings<float>>, or one of your own at namespace scope,
//   constexpr SwitchedForgetting<float> mine{0.99f, 0.8f};    ConstantForgetting<mine>

#include <palpate/arithmetic.hpp>

namespace palpate {

template <class Values>
inline constexpr Values defaults = Values();

/// Settings of a stage that its object keeps: they may differ from object to object, and change.
template <class Values>
struct Kept {
  Values settings = Values();
};

/// Settings of a stage that the compiler knows: no byte of state, no load.
template <const auto& values>
struct Constant {
  static constexpr const auto& settings = values;
};

template <const auto& forgetting>
struct ConstantForgetting {
  using real_type = typename std::decay_t<decltype(forgetting)>::real_type;
  static constexpr real_type discount(real_type information, bool alarm) noexcept {
    return forgetting.discount(information, alarm);
  }
  static constexpr real_type factor(bool alarm) noexcept { return forgetting.factor(alarm); }
};

template <const auto& bound>
struct ConstantBound {
  using real_type = typename std::decay_t<decltype(bound)>::real_type;
  template <class Value>
  static constexpr Value limit(Value information) noexcept {
    return bound.limit(information);
  }
};

/// Only the statistic is kept.
template <const auto& detector>
struct ConstantDetector {
  using real_type = typename std::decay_t<decltype(detector)>::real_type;
  real_type statistic = 0;

  constexpr bool update(real_type innovation) noexcept {
    statistic = next(statistic, innovation);
    return alarm();
  }
  template <class Value>
  static constexpr Value next(Value statistic_before, Value innovation) noexcept {
    return detector.next(statistic_before, innovation);
  }
  constexpr void reset() noexcept { statistic = 0; }
  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    visit(statistic);
  }
  constexpr bool is_finite() const noexcept { return palpate::is_finite(statistic); }
  constexpr bool alarm() const noexcept { return statistic > limit(); }
  static constexpr real_type limit() noexcept { return detector.limit(); }
};

}  // namespace palpate
