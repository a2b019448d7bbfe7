// SPDX-License-Identifier: MIT
#pragma once

// Where the settings of a stage are kept: in the object, or in the program.

namespace palpate {

/// Settings that an object keeps: they may differ from object to object and change. The default.
template <class Values>
struct Kept {
  Values settings = Values();
};

/// Settings that the compiler knows: no byte of state, no load. `values` names a constexpr object, such as
/// defaults<ContactSettings<float>>, or one of your own at namespace scope.
template <const auto& values>
struct Constant {
  static constexpr const auto& settings = values;
};

template <class Values>
inline constexpr Values defaults = Values();

}  // namespace palpate
