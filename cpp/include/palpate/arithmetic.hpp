// SPDX-License-Identifier: MIT
#pragma once

// Basis of all headers: IEEE arithmetic, with one rounding for each written operation.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <palpate/contraction.hpp>
#include <type_traits>
#include <utility>

#if __cplusplus < 201703L && !(defined(_MSVC_LANG) && _MSVC_LANG >= 201703L)
#error "palpate needs C++17: add -std=c++17 (MSVC: /std:c++17)"
#endif
#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__) || \
    defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__) || defined(_M_FP_FAST)
// clang defines only the first two: with -fassociative-math, -freciprocal-math, -funsafe-math-optimizations or -fapprox-func
// the headers compile, and the bits change.
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

// PALPATE_INLINE: a part of a longer function, or an access to a member; else the compilers call it where code is to be
// small, and pass structs through memory. (What is rare is not marked as cold: with that g++ 12 and clang are slower.)
#if defined(__GNUC__) || defined(__clang__)
#define PALPATE_INLINE [[gnu::always_inline]]
#define PALPATE_LIKELY(condition) __builtin_expect(static_cast<bool>(condition), 1)
#define PALPATE_UNLIKELY(condition) __builtin_expect(static_cast<bool>(condition), 0)
#else
#define PALPATE_INLINE
#define PALPATE_LIKELY(condition) (condition)
#define PALPATE_UNLIKELY(condition) (condition)
#endif

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// Whether a type is one of those that the headers compute with.
template <class Real>
inline constexpr bool is_real = std::is_same_v<Real, float> || std::is_same_v<Real, double>;

/// NaN: there is no such number.
template <class Real>
inline constexpr Real not_a_number = std::numeric_limits<Real>::quiet_NaN();

#if defined(__GNUC__) || defined(__clang__)
/// The absolute value.
constexpr float magnitude(float value) noexcept { return __builtin_fabsf(value); }
/// The absolute value.
constexpr double magnitude(double value) noexcept { return __builtin_fabs(value); }
/// value, negated where `sign` is below 0 (or -0).
constexpr float with_sign(float value, float sign) noexcept { return value * __builtin_copysignf(1, sign); }
/// value, negated where `sign` is below 0 (or -0).
constexpr double with_sign(double value, double sign) noexcept { return value * __builtin_copysign(1, sign); }
namespace detail {
inline void stay() noexcept { __asm__ volatile(""); }
}  // namespace detail
#else
template <class Real>
constexpr Real magnitude(Real value) noexcept {
  return -value > value ? -value : value;
}
template <class Real>
constexpr Real with_sign(Real value, Real sign) noexcept {
  return sign < 0 || (sign == 0 && 1 / sign < 0) ? -value : value;
}
#endif

/// Between two stores: the compilers do not keep both numbers in one SIMD register, where each would wait for the other.
constexpr void keep_apart() noexcept {
#if defined(__GNUC__) || defined(__clang__)
  if (!__builtin_is_constant_evaluated()) {
    detail::stay();
  }
#endif
}

/// In a branch: it stays one. Of a branch without it a compiler may make a select, which waits for both of its sides. Not
/// with PALPATE_LOOPS_INSIDE, for a program in which one function has the loop over the samples: g++ finds the branch there.
constexpr void keep_branch() noexcept {
#if !defined(PALPATE_LOOPS_INSIDE)
  keep_apart();
#endif
}

/// value if it is above 0, otherwise 0.
template <class Real>
constexpr Real positive_part(Real value) noexcept {
  return value > 0 ? value : Real(0);
}

/// value - value is 0 for a finite value, and NaN for NaN and for +-infinity.
template <class Real>
constexpr bool is_finite(Real value) noexcept {
  return value - value == 0;
}

/// value, or 0 if it is near the smallest normal number: arithmetic with subnormal numbers takes ten times as long.
template <class Real>
constexpr Real normal_or_0(Real value) noexcept {
  return magnitude(value) < 64 * std::numeric_limits<Real>::min() ? Real(0) : value;
}

/// Share of the n-th value in a running mean. First 1 / n, which gives the mean of all values; as soon as that is below
/// `smoothing`, `smoothing`, which gives an exponential memory of about 1 / smoothing values.
template <class Real>
constexpr Real mean_share(Real n, Real smoothing) noexcept {
  if (PALPATE_UNLIKELY(product(n, smoothing) < 1)) {
    return 1 / n;
  }
  return smoothing;
}

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
