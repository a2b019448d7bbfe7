// SPDX-License-Identifier: MIT
#pragma once

// A product that is rounded by itself: no compiler fuses it with the sum that follows it, whatever its flags allow. A
// product of two numbers is hidden from the optimiser where the processor can fuse, unless PALPATE_CONTRACTION_OFF is
// defined, which the CMake target does together with -ffp-contract=off. (g++ 12 loses __builtin_assoc_barrier when it
// vectorises; clang ignores its pragma under -ffp-contract=fast.)
//
// Where a product is hidden: PALPATE_HIDING_PLACE of a number of up to PALPATE_FUSED_BYTES, which larger ones, in
// software, do not need. A compiler that is unknown for a processor hides it in memory: slower, and right on all of them.

#include <palpate/version.hpp>

#if !defined(__GNUC__) && !defined(__clang__)
#if defined(_MSC_VER)
#pragma fp_contract(off)  // for the rest of the file that includes this one
#elif !defined(PALPATE_CONTRACTION_OFF)
#error "palpate does not know this compiler: forbid it to fuse products and sums, then define PALPATE_CONTRACTION_OFF"
#endif
#elif defined(PALPATE_CONTRACTION_OFF)
#elif defined(__x86_64__) || defined(__i386__)
#if defined(__FMA__) || defined(__FMA4__) || defined(__AVX512F__)
#define PALPATE_HIDING_PLACE "+x"
#endif
#elif defined(__aarch64__)
#define PALPATE_HIDING_PLACE "+w"
#elif defined(__arm__)
#if defined(__ARM_FEATURE_FMA)
#define PALPATE_HIDING_PLACE "+w"
#define PALPATE_FUSED_BYTES (__ARM_FP & 8 ? 8 : 4)
#endif
#elif defined(__riscv_flen)
#define PALPATE_HIDING_PLACE "+f"
#define PALPATE_FUSED_BYTES (__riscv_flen / 8)
#elif defined(__XTENSA__) && !defined(__XTENSA_SOFT_FLOAT__)
#define PALPATE_HIDING_PLACE "+f"
#define PALPATE_FUSED_BYTES 4
#elif defined(__wasm__) && !defined(__wasm_relaxed_simd__)                     // nothing to fuse with
#elif defined(__clang__) || defined(__FP_FAST_FMA) || defined(__FP_FAST_FMAF)  // g++ defines these if it can fuse
#define PALPATE_HIDING_PLACE "+m"
#endif

#if !defined(PALPATE_FUSED_BYTES)
#define PALPATE_FUSED_BYTES 8
#endif

namespace palpate {
inline namespace PALPATE_NAMESPACE {

#if defined(PALPATE_HIDING_PLACE)
namespace detail {
template <class Real>
inline Real hidden(Real value) noexcept {
  if constexpr (sizeof(Real) <= PALPATE_FUSED_BYTES) {
    __asm__("" : PALPATE_HIDING_PLACE(value));
  }
  return value;
}
}  // namespace detail
#endif

/// left * right, rounded by itself: not fused with a following addition, whatever the compiler's flags allow.
template <class Real>
constexpr Real product(Real left, Real right) noexcept {
#if defined(PALPATE_HIDING_PLACE)
  if (!__builtin_is_constant_evaluated()) {
    return detail::hidden(left * right);
  }
#endif
  return left * right;
}

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
