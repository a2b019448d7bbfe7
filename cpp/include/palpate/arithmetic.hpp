// SPDX-License-Identifier: MIT
#pragma once

// Basis of all headers: IEEE arithmetic, with one rounding for each written operation; numbers and packs compared.

#include <palpate/contraction.hpp>
#include <type_traits>

#if __cplusplus < 201703L && !(defined(_MSVC_LANG) && _MSVC_LANG >= 201703L)
#error "palpate needs C++17: add -std=c++17 (MSVC: /std:c++17)"
#endif
#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__) || \
    defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__) || defined(_M_FP_FAST)
#error "palpate needs IEEE arithmetic: compile without -ffast-math and its parts (/fp:fast)"
#endif
// (16: numbers of 2 bytes in theirs, too.)
#if defined(__FLT_EVAL_METHOD__) && __FLT_EVAL_METHOD__ != 0 && __FLT_EVAL_METHOD__ != 16
#error "palpate needs float and double evaluated in their own precision: on 32-bit x86 add -msse2 -mfpmath=sse"
#endif
#if defined(__arm__) && !defined(PALPATE_VECTORS_OFF) && \
    ((defined(__clang__) && defined(__ARM_NEON)) || (defined(__ARM_FEATURE_MVE) && __ARM_FEATURE_MVE & 2))
#error \
    "palpate needs numbers below the smallest normal one, which vectors of 32-bit ARM take for 0: add -fno-tree-vectorize \
(clang: -fno-vectorize -fno-slp-vectorize), and define PALPATE_VECTORS_OFF"
#endif

// Whether what is usual may have code of its own beside the code for everything: not where code is to be small. Without
// speculation it has no advantage, and neither has a call for what is rare, which needs a stack frame.
#if !defined(PALPATE_HOT_PATHS)
#if defined(__OPTIMIZE_SIZE__) || (defined(__ARM_ARCH_PROFILE) && __ARM_ARCH_PROFILE == 'M')
#define PALPATE_HOT_PATHS 0
#else
#define PALPATE_HOT_PATHS 1
#endif
#endif

// PALPATE_ONCE: a part of a longer function, called once in it. Where code is to be small, the compilers call it all the
// same, and pass its result through memory.
#if defined(__GNUC__) || defined(__clang__)
#define PALPATE_RESTRICT __restrict__
#if PALPATE_HOT_PATHS
#define PALPATE_COLD [[gnu::cold, gnu::noinline]]
#define PALPATE_ONCE
#else
#define PALPATE_COLD
#define PALPATE_ONCE [[gnu::always_inline]]
#endif
#define PALPATE_UNLIKELY(condition) __builtin_expect(static_cast<bool>(condition), 0)
#define PALPATE_INLINE [[gnu::always_inline]] inline
#elif defined(_MSC_VER)
#define PALPATE_RESTRICT __restrict
#define PALPATE_COLD __declspec(noinline)
#define PALPATE_ONCE
#define PALPATE_UNLIKELY(condition) (condition)
#define PALPATE_INLINE inline
#else
#define PALPATE_RESTRICT
#define PALPATE_COLD
#define PALPATE_ONCE
#define PALPATE_UNLIKELY(condition) (condition)
#define PALPATE_INLINE inline
#endif

namespace palpate {

/// Whether a type is one of those that the headers compute with.
template <class Real>
inline constexpr bool is_real = std::is_same_v<Real, float> || std::is_same_v<Real, double>;

/// The absolute value; also for a pack.
template <class Real>
constexpr Real magnitude(Real value) noexcept {
#if defined(__GNUC__) || defined(__clang__)
  if constexpr (std::is_same_v<Real, float>) {
    return __builtin_fabsf(value);
  } else if constexpr (std::is_same_v<Real, double>) {
    return __builtin_fabs(value);
  } else {  // a pack: without the bits of -0
    using Bits = decltype(value > value);
    return reinterpret_cast<Real>(reinterpret_cast<Bits>(value) & ~reinterpret_cast<Bits>(-Real{}));
  }
#else
  return -value > value ? -value : value;
#endif
}

// The instruction of the processor, which compilers do not find by themselves, for a pack of 16, 32 or 64 bytes.
#if defined(__AVX512DQ__) && defined(__clang__)
#define PALPATE_IN_64(name) __builtin_ia32_##name##512(left, right, 4)
#elif defined(__AVX512DQ__)
#define PALPATE_IN_64(name) __builtin_ia32_##name##512_mask(left, right, left, -1, 4)
#else
#define PALPATE_IN_64(name) left
#endif
#if defined(__AVX__)
#define PALPATE_IN_32(name) __builtin_ia32_##name##256(left, right)
#else
#define PALPATE_IN_32(name) left
#endif
#if defined(__SSE2__) && (defined(__GNUC__) || defined(__clang__))
#define PALPATE_INSTRUCTION(name)                            \
  if constexpr (!is_real<Value>) {                           \
    constexpr bool of_double = sizeof(left[0]) == 8;         \
    if constexpr (sizeof(Value) == 64 && of_double) {        \
      return PALPATE_IN_64(name##pd);                        \
    } else if constexpr (sizeof(Value) == 64) {              \
      return PALPATE_IN_64(name##ps);                        \
    } else if constexpr (sizeof(Value) == 32 && of_double) { \
      return PALPATE_IN_32(name##pd);                        \
    } else if constexpr (sizeof(Value) == 32) {              \
      return PALPATE_IN_32(name##ps);                        \
    } else if constexpr (sizeof(Value) == 16 && of_double) { \
      return __builtin_ia32_##name##pd(left, right);         \
    } else if constexpr (sizeof(Value) == 16) {              \
      return __builtin_ia32_##name##ps(left, right);         \
    }                                                        \
  }
#else
#define PALPATE_INSTRUCTION(name)
#endif

/// left if it is larger than right, otherwise right; also for packs.
template <class Value>
constexpr Value larger(Value left, Value right) noexcept {
  // NOLINTNEXTLINE(bugprone-branch-clone): one name, of another instruction for each size
  PALPATE_INSTRUCTION(max)
  return left > right ? left : right;
}

/// left if it is smaller than right, otherwise right; also for packs.
template <class Value>
constexpr Value smaller(Value left, Value right) noexcept {
  // NOLINTNEXTLINE(bugprone-branch-clone): as above
  PALPATE_INSTRUCTION(min)
  return left < right ? left : right;
}

/// value if it is above 0, otherwise 0; also for a pack.
template <class Value>
constexpr Value positive_part(Value value) noexcept {
  return larger(value, Value{});
}

/// `yes` where the comparison `mask` holds, otherwise `no`; also for a pack: a blend of two registers takes longer.
template <class Mask, class Value>
constexpr Value select(Mask mask, Value yes, Value no) noexcept {
  if constexpr (is_real<Value>) {
    return mask ? yes : no;
  } else {
    const Mask others = reinterpret_cast<Mask>(no);
    return reinterpret_cast<Value>(others ^ (mask & (others ^ reinterpret_cast<Mask>(yes))));
  }
}

/// Where the comparison `mask` holds and `other` does not.
template <class Mask>
constexpr Mask without(Mask mask, Mask other) noexcept {
  if constexpr (std::is_same_v<Mask, bool>) {
    return mask && !other;
  } else {
    return mask & ~other;
  }
}

/// value - value is 0 for a finite value, and NaN for NaN and for +-infinity.
template <class Real>
constexpr bool is_finite(Real value) noexcept {
  return value - value == 0;
}

}  // namespace palpate
