// SPDX-License-Identifier: MIT
#pragma once

// The correctly rounded square root, and a cube root by basic arithmetic only: the same bits from every processor, and at
// compile time.

#include <palpate/arithmetic.hpp>

// The processor's instruction, as IEEE 754 rounds it. Not a builtin, which may call the C library to set errno.
#if defined(__GNUC__) || defined(__clang__)
#if defined(__AVX__)
#define PALPATE_ROOT_FLOAT "vsqrtss {%1, %1, %0|%0, %1, %1}"
#define PALPATE_ROOT_DOUBLE "vsqrtsd {%1, %1, %0|%0, %1, %1}"
#define PALPATE_ROOT_REGISTER "x"
#elif defined(__SSE2__)
#define PALPATE_ROOT_FLOAT "sqrtss {%1, %0|%0, %1}"
#define PALPATE_ROOT_DOUBLE "sqrtsd {%1, %0|%0, %1}"
#define PALPATE_ROOT_REGISTER "x"
#elif defined(__aarch64__)
#define PALPATE_ROOT_FLOAT "fsqrt %s0, %s1"
#define PALPATE_ROOT_DOUBLE "fsqrt %d0, %d1"
#define PALPATE_ROOT_REGISTER "w"
#elif defined(__arm__) && defined(__ARM_FP)
#define PALPATE_ROOT_FLOAT "vsqrt.f32 %0, %1"
#if __ARM_FP & 8
#define PALPATE_ROOT_DOUBLE "vsqrt.f64 %P0, %P1"
#endif
#define PALPATE_ROOT_REGISTER "t"
#elif defined(__riscv_fsqrt) && defined(__riscv_flen)
#define PALPATE_ROOT_FLOAT "fsqrt.s %0, %1"
#if __riscv_flen >= 64
#define PALPATE_ROOT_DOUBLE "fsqrt.d %0, %1"
#endif
#define PALPATE_ROOT_REGISTER "f"
#endif
#endif

namespace palpate {
inline namespace PALPATE_NAMESPACE {
namespace detail {

/// Multiplies or divides a value above 0 by `power`, until it is from `least` to `power`; returns the product of as many
/// `root` by which its root has changed. Both are powers of 2: nothing is rounded.
template <int power, int root, class Real>
constexpr Real taken_out(Real& value, Real least) noexcept {
  Real scale = 1;
  for (; value < least; value *= power) {
    scale /= root;
  }
  for (; value > power; value /= power) {
    scale *= root;
  }
  return scale;
}

/// The root of a value from 1 to 4.
///
/// Newton's iteration ends less than one unit in the last place from it. In halves of its digits, root = high + low
/// (Veltkamp), every product and difference below is exact (Dekker, Numerische Mathematik 18, 1971), and so is the rest,
/// value - root^2. The next number is nearer if (root + unit / 2)^2 < value: as all of these are multiples of unit^2, if
/// the rest is above unit * root.
template <class Real>
constexpr Real rounded_root(Real value) noexcept {
  constexpr Real unit = std::numeric_limits<Real>::epsilon();
  constexpr Real split = (1 << (std::numeric_limits<Real>::digits + 1) / 2) + 1;
  Real root = Real(0.7) + value / 3;  // at most 3.4 % off; then 6e-4, 2e-7, 2e-14, below a unit
  for (int i = 0; i < 4; ++i) {
    root = (root + value / root) / 2;
  }
  const Real scaled = product(split, root), high = scaled - (scaled - root), low = root - high;
  const Real rest = value - product(high, high) - 2 * product(high, low) - product(low, low);
  const Real limit = product(unit, root);
  return rest > limit ? root + unit : rest <= -limit ? root - unit : root;
}

/// By basic arithmetic only, for a finite value above 0. Powers of 4 are taken out of it, which is exact.
template <class Real>
constexpr Real portable_root(Real value) noexcept {
  const Real large = taken_out<65536, 256>(value, Real(1) / 65536), small = taken_out<4, 2>(value, Real(1));
  return product(large * small, rounded_root(value));
}

#if defined(PALPATE_ROOT_REGISTER)
/// With the processor's instruction, where it has one for the type.
inline float processor_root(float value) noexcept {
  float root;
  __asm__(PALPATE_ROOT_FLOAT : "=" PALPATE_ROOT_REGISTER(root) : PALPATE_ROOT_REGISTER(value));
  return root;
}
inline double processor_root(double value) noexcept {
#if defined(PALPATE_ROOT_DOUBLE)
  double root;
  __asm__(PALPATE_ROOT_DOUBLE : "=" PALPATE_ROOT_REGISTER(root) : PALPATE_ROOT_REGISTER(value));
  return root;
#else
  return portable_root(value);
#endif
}
#endif

}  // namespace detail

/// Square root, rounded to the nearest number. 0 for a negative value; 0, infinity and NaN stay unchanged.
template <class Real>
constexpr Real square_root(Real value) noexcept {
  if (!(value > 0 && value <= std::numeric_limits<Real>::max())) {
    return value < 0 ? Real(0) : value;
  }
#if defined(PALPATE_ROOT_REGISTER)
  if (!__builtin_is_constant_evaluated()) {
    return detail::processor_root(value);
  }
#endif
  return detail::portable_root(value);
}

/// Cube root of a finite value above 0, to a few units in the last place.
///
/// Powers of 8 are taken out of it, which is exact. Halley's iteration r (r^3 + 2 v) / (2 r^3 + v) has the error
/// 2/3 e^3: from 10 % at most on, 7e-4, 2e-10, below a unit.
template <class Real>
constexpr Real cube_root(Real value) noexcept {
  const Real large = detail::taken_out<4096, 16>(value, Real(1) / 4096);
  const Real small = detail::taken_out<8, 2>(value, Real(1));
  Real root = Real(0.9) + value / 7;
  for (int i = 0; i < 3; ++i) {
    const Real cube = product(product(root, root), root);
    root = product(root, (cube + 2 * value) / (2 * cube + value));
  }
  return product(large * small, root);
}

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
