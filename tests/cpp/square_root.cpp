// SPDX-License-Identifier: MIT
// square_root against the C library's, which is correctly rounded: both of its forms, for float and double.

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <palpate/square_root.hpp>

namespace {

using namespace palpate;

template <class Real>
constexpr Real infinity = std::numeric_limits<Real>::infinity();

template <class Real>
constexpr bool ends() noexcept {
  constexpr Real nan = std::numeric_limits<Real>::quiet_NaN();
  return square_root(Real(0)) == 0 && square_root(Real(-1)) == 0 && square_root(-infinity<Real>) == 0 &&
         square_root(infinity<Real>) == infinity<Real> && !(square_root(nan) == nan) &&
         square_root(Real(2.25)) == Real(1.5);
}
static_assert(ends<float>() && ends<double>());

long wrong = 0;

/// Count a root that is not the C library's; of values above 0.
template <class Real>
void check(Real value) {
  if (value > 0 && value < infinity<Real>) {
    const Real expected = std::sqrt(value);
    wrong += detail::portable_root(value) != expected || square_root(value) != expected;
  }
}

void check_around(double value) {
  check(std::nextafter(value, 0.0));
  check(value);
  check(std::nextafter(value, infinity<double>));
}

template <class Real, class Bits>
void check_bits(Bits bits) {
  static_assert(sizeof(Real) == sizeof bits);
  Real real;
  std::memcpy(&real, &bits, sizeof real);
  check(real);
}

std::uint64_t draw(std::uint64_t& state) {
  state += 0x9e3779b97f4a7c15u;
  std::uint64_t mixed = (state ^ (state >> 30)) * 0xbf58476d1ce4e5b9u;
  mixed = (mixed ^ (mixed >> 27)) * 0x94d049bb133111ebu;
  return mixed ^ (mixed >> 31);
}

// Numbers from 1 to 4, as all numbers are these times a power of 4; and numbers of any size, one of `step`.
void floats(std::uint32_t mantissa_step, std::uint32_t step) {
  for (std::uint32_t bits = 0x3f800000; bits <= 0x40800000; bits += mantissa_step) {
    check_bits<float>(bits);
  }
  for (std::uint32_t bits = 1; bits < 0x7f800000; bits += step) {
    check_bits<float>(bits);
  }
}

// Powers of two, squares, the squares of the middles between two numbers, and numbers of any size.
void doubles(int count) {
  check(std::numeric_limits<double>::max());
  for (int e = -1074; e < 1024; ++e) {
    check_around(std::ldexp(1.0, e));
  }
  std::uint64_t state = 1;
  for (int i = 0; i < count; ++i) {
    const std::uint64_t drawn = draw(state);
    const double root = 1 + static_cast<double>(drawn >> 12) * 0x1p-52;
    check_around(root * root);
    check_around(root * root + root * 0x1p-52);
    check_bits<double>(drawn % 0x7ff0000000000000u + 1);
    check_bits<double>((drawn >> 12) + 1);  // subnormal
  }
}

}  // namespace

int main() {
  const char* nightly = std::getenv("PALPATE_NIGHTLY");
  const bool all = nightly && *nightly && *nightly != '0';
  floats(all ? 1 : 7, all ? 1 : 997);
  doubles(all ? 50000000 : 500000);
  return wrong == 0 ? 0 : 1;
}
