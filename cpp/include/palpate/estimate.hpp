// SPDX-License-Identifier: MIT
#pragma once

// A ratio with its standard error.

#include <palpate/arithmetic.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// A ratio and its standard error; NaN: there is none.
template <class Real>
struct Estimate {
  Real ratio = not_a_number<Real>;           ///< of the changes, hard to soft
  Real standard_error = not_a_number<Real>;  ///< of it
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
