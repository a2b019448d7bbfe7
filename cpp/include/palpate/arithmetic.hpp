// SPDX-License-Identifier: MIT
#pragma once

// What every header of the core rests on: IEEE arithmetic, one rounding for each operation that is written.

#include <type_traits>

#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error "palpate needs IEEE arithmetic: compile without -ffast-math and -ffinite-math-only"
#endif
#if defined(__FLT_EVAL_METHOD__) && __FLT_EVAL_METHOD__ != 0
#error "palpate needs float and double evaluated in their own precision: on 32-bit x86 add -msse2 -mfpmath=sse"
#endif

#if defined(__GNUC__) || defined(__clang__)
#define PALPATE_COLD [[gnu::cold, gnu::noinline]]
#define PALPATE_UNLIKELY(condition) __builtin_expect(static_cast<bool>(condition), 0)
#elif defined(_MSC_VER)
#define PALPATE_COLD __declspec(noinline)
#define PALPATE_UNLIKELY(condition) (condition)
#else
#define PALPATE_COLD
#define PALPATE_UNLIKELY(condition) (condition)
#endif

namespace palpate {

template <class Real>
inline constexpr bool is_real = std::is_same_v<Real, float> || std::is_same_v<Real, double>;

/// left * right, rounded by itself: not fused with a following addition, even where the compiler's default allows it.
template <class Real>
constexpr Real product(Real left, Real right) noexcept {
#if defined(__clang__)
#pragma clang fp contract(off)  // heeded unless the command line says -ffp-contract=fast
  return left * right;
#elif defined(__GNUC__) && __GNUC__ >= 12
  if (__builtin_is_constant_evaluated()) {
    return left * right;  // where nothing is fused, and g++ 12 cannot evaluate the barrier
  }
  return __builtin_assoc_barrier(left * right);
#else
  return left * right;  // an older g++ needs -ffp-contract=off, which the CMake target passes on
#endif
}

template <class Real>
constexpr Real magnitude(Real value) noexcept {
#if defined(__GNUC__) || defined(__clang__)
  if constexpr (std::is_same_v<Real, float>) {
    return __builtin_fabsf(value);
  } else {
    return __builtin_fabs(value);
  }
#else
  return -value > value ? -value : value;
#endif
}

/// value - value is 0 for a finite value, and NaN for NaN and for +-infinity.
template <class Real>
constexpr bool is_finite(Real value) noexcept {
  return value - value == 0;
}

}  // namespace palpate
