// SPDX-License-Identifier: MIT
#pragma once

// A pack: the numbers of one SIMD register, with the operators of one number. It uses the vector extensions of the
// compilers, so that nothing depends on the optimisation of a loop. Without these extensions a pack is one number.

#include <cstddef>
#include <palpate/arithmetic.hpp>

#if defined(__GNUC__) || defined(__clang__)
#define PALPATE_HAS_PACKS 1
#if defined(__AVX__)
#define PALPATE_PACK_BYTES 32
#else
#define PALPATE_PACK_BYTES 16
#endif
#else
#define PALPATE_HAS_PACKS 0
#endif

// Whether two numbers in one register are faster than one after the other. (The vectors of 32-bit ARM have no doubles.)
#if !defined(PALPATE_HAS_LANES)
#if PALPATE_HAS_PACKS && (defined(__SSE2__) || defined(__aarch64__))
#define PALPATE_HAS_LANES 1
#else
#define PALPATE_HAS_LANES 0
#endif
#endif

namespace palpate {

#if PALPATE_HAS_PACKS

namespace detail {
template <class Real>
struct PackOf {
  typedef Real Values __attribute__((vector_size(PALPATE_PACK_BYTES)));
};
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

/// Whether a comparison of packs of Real holds in every lane.
template <class Real, class Mask>
bool holds_everywhere(Mask mask) noexcept {
#if defined(__AVX__)
  if constexpr (std::is_same_v<Real, double>) {
    return __builtin_ia32_movmskpd256(reinterpret_cast<Pack<double>>(mask)) == 15;
  } else {
    return __builtin_ia32_movmskps256(reinterpret_cast<Pack<float>>(mask)) == 255;
  }
#elif defined(__SSE2__)
  if constexpr (std::is_same_v<Real, double>) {
    return __builtin_ia32_movmskpd(reinterpret_cast<Pack<double>>(mask)) == 3;
  } else {
    return __builtin_ia32_movmskps(reinterpret_cast<Pack<float>>(mask)) == 15;
  }
#else
  auto all = mask[0];
  for (std::size_t i = 1; i < sizeof(Mask) / sizeof(mask[0]); ++i) {
    all &= mask[i];
  }
  return all != 0;
#endif
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
bool holds_everywhere(bool mask) noexcept {
  return mask;
}

#endif

}  // namespace palpate
