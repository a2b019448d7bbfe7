// SPDX-License-Identifier: MIT
#pragma once

// Two numbers in one SIMD register, with the operators of one number: the vector extensions of the compilers, so that
// nothing depends on the optimisation of a loop. 32-bit ARM has none: its registers take numbers below the smallest normal
// one for 0.

#include <palpate/arithmetic.hpp>

// Whether two numbers in one register are faster than one after the other.
#if !defined(PALPATE_HAS_LANES)
#if (defined(__GNUC__) || defined(__clang__)) && (defined(__SSE2__) || defined(__aarch64__))
#define PALPATE_HAS_LANES 1
#else
#define PALPATE_HAS_LANES 0
#endif
#endif

#if PALPATE_HAS_LANES
namespace palpate {

namespace detail {
template <class Real>
struct TwoLanesOf {
  typedef Real Values __attribute__((vector_size(2 * sizeof(Real))));
};
}  // namespace detail

/// Two numbers, in half a register if need be.
template <class Real>
using TwoLanes = typename detail::TwoLanesOf<Real>::Values;

template <class Value, class Real>
Value load(const Real* from) noexcept {
  Value value;
  __builtin_memcpy(&value, from, sizeof(Value));
  return value;
}
template <class Value, class Real>
void store(Value value, Real* to) noexcept {
  __builtin_memcpy(to, &value, sizeof(Value));
}

/// `yes` in the lanes where the comparison `mask` holds, otherwise `no`.
template <class Mask, class Value>
Value select(Mask mask, Value yes, Value no) noexcept {
  const Mask others = reinterpret_cast<Mask>(no);
  return reinterpret_cast<Value>(others ^ (mask & (others ^ reinterpret_cast<Mask>(yes))));
}

}  // namespace palpate
#endif
