// SPDX-License-Identifier: MIT
#pragma once

// A pack: the numbers of one SIMD register, with the operators of one number. It uses the vector extensions of the
// compilers, so that nothing depends on the optimisation of a loop. Without these extensions a pack is one number, and so
// it is without registers for IEEE arithmetic: those of 32-bit ARM take numbers below the smallest normal one for 0.

#include <cstddef>
#include <palpate/arithmetic.hpp>

#if !defined(PALPATE_HAS_PACKS)
#if !defined(__GNUC__) && !defined(__clang__)
#define PALPATE_HAS_PACKS 0
#elif defined(__SSE2__) || defined(__aarch64__) || defined(__VSX__) || defined(__wasm_simd128__) || \
    (defined(__VX__) && __ARCH__ >= 12)
#define PALPATE_HAS_PACKS 1
#else
#define PALPATE_HAS_PACKS 0
#endif
#endif

// g++ for Windows keeps packs on a stack of 16 bytes as if it were one of 32 (its bug 54412), and the program crashes.
#if PALPATE_HAS_PACKS
#if defined(_WIN32) && !defined(__clang__)
#define PALPATE_PACK_BYTES 16
#elif defined(__AVX512F__) && defined(__AVX512DQ__)
#define PALPATE_PACK_BYTES 64
#elif defined(__AVX__)
#define PALPATE_PACK_BYTES 32
#else
#define PALPATE_PACK_BYTES 16
#endif
#endif

// Whether two numbers in one register are faster than one after the other.
#if !defined(PALPATE_HAS_LANES)
#if PALPATE_HAS_PACKS && (defined(__SSE2__) || defined(__aarch64__))
#define PALPATE_HAS_LANES 1
#else
#define PALPATE_HAS_LANES 0
#endif
#endif

namespace palpate {

/// Streams whose numbers are side by side: a multiple of any pack of this processor.
#if defined(__x86_64__) || defined(__i386__)
template <class Real>
inline constexpr std::size_t group_size = 64 / sizeof(Real);
#elif PALPATE_HAS_PACKS
template <class Real>
inline constexpr std::size_t group_size = PALPATE_PACK_BYTES / sizeof(Real);
#else
template <class Real>
inline constexpr std::size_t group_size = 1;
#endif

#if PALPATE_HAS_PACKS

namespace detail {
template <class Real>
struct PackOf {
  typedef Real Values __attribute__((vector_size(PALPATE_PACK_BYTES)));
};
typedef long long Bits64 __attribute__((vector_size(64)));  // as the instructions for masks take them
typedef int Bits32 __attribute__((vector_size(64)));
template <class Real>
struct TwoLanesOf {
  typedef Real Values __attribute__((vector_size(2 * sizeof(Real))));
};
}  // namespace detail

template <class Real>
using Pack = typename detail::PackOf<Real>::Values;

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

/// One bit for each lane of a comparison of packs of Real: whether it holds. The first lane is the lowest bit.
template <class Real, class Mask>
unsigned lanes_in(Mask mask) noexcept {
#if PALPATE_PACK_BYTES == 64
  if constexpr (std::is_same_v<Real, double>) {
    return static_cast<unsigned char>(__builtin_ia32_cvtq2mask512(reinterpret_cast<detail::Bits64>(mask)));
  } else {
    return static_cast<unsigned short>(__builtin_ia32_cvtd2mask512(reinterpret_cast<detail::Bits32>(mask)));
  }
#elif PALPATE_PACK_BYTES == 32
  if constexpr (std::is_same_v<Real, double>) {
    return static_cast<unsigned>(__builtin_ia32_movmskpd256(reinterpret_cast<Pack<double> >(mask)));
  } else {
    return static_cast<unsigned>(__builtin_ia32_movmskps256(reinterpret_cast<Pack<float> >(mask)));
  }
#elif defined(__SSE2__)
  if constexpr (std::is_same_v<Real, double>) {
    return static_cast<unsigned>(__builtin_ia32_movmskpd(reinterpret_cast<Pack<double> >(mask)));
  } else {
    return static_cast<unsigned>(__builtin_ia32_movmskps(reinterpret_cast<Pack<float> >(mask)));
  }
#else
  unsigned lanes = 0;
  for (std::size_t i = 0; i < sizeof(Mask) / sizeof(mask[0]); ++i) {
    lanes |= (mask[i] ? 1u : 0u) << i;
  }
  return lanes;
#endif
}
template <class Real>
unsigned lanes_in(bool mask) noexcept {
  return mask ? 1u : 0u;
}
template <class Real>
inline constexpr unsigned all_lanes = (1u << (sizeof(Pack<Real>) / sizeof(Real))) - 1;
template <class Real, class Mask>
bool holds_everywhere(Mask mask) noexcept {
  return lanes_in<Real>(mask) == all_lanes<Real>;
}
template <class Real>
bool holds_everywhere(bool mask) noexcept {
  return mask;
}

#else

template <class Real>
using Pack = Real;

template <class Value, class Real>
Value load(const Real* from) noexcept {
  return *from;
}
template <class Value, class Real>
void store(Value value, Real* to) noexcept {
  *to = value;
}
template <class Real>
unsigned lanes_in(bool mask) noexcept {
  return mask ? 1 : 0;
}
template <class Real>
inline constexpr unsigned all_lanes = 1;
template <class Real>
bool holds_everywhere(bool mask) noexcept {
  return mask;
}

#endif

}  // namespace palpate
