// SPDX-License-Identifier: MIT
// square_root against the C library's, which is correctly rounded: both of its forms, for float and double.

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <palpate/square_root.hpp>

namespace {

using namespace palpate;

template <class Real>
constexpr Real infinity = std::numeric_limits<Real>::infinity();

template <class Real>
constexpr bool ends() noexcept {
  using Limits = std::numeric_limits<Real>;
  constexpr Real nan = Limits::quiet_NaN(), eps = Limits::epsilon();
  return square_root(Real(0)) == 0 && square_root(Real(-1)) == 0 && square_root(-infinity<Real>) == 0 &&
         square_root(infinity<Real>) == infinity<Real> && !(square_root(nan) == nan) && square_root(Real(9)) == 3 &&
         square_root(1 + 4 * eps) == 1 + 2 * eps && square_root(1 + 3 * eps) == 1 + eps &&
         square_root(Real(2.25)) == Real(1.5) && square_root(4 * Limits::min()) == 2 * square_root(Limits::min());
}
static_assert(ends<float>() && ends<double>());
static_assert(square_root(2.0) == 0x1.6a09e667f3bcdp0 && square_root(2.0f) == 0x1.6a09e6p0f);
static_assert(square_root(std::numeric_limits<double>::denorm_min()) == 0x1p-537);
static_assert(square_root(std::numeric_limits<double>::max()) == 0x1.fffffffffffffp511);

template <class Real, class Bits>
class Check {
 public:
  void value(Real value) {
    const Real expected = std::sqrt(value);
    count_ += 1;
    if (!(detail::portable_root(value) == expected && square_root(value) == expected) && wrong_++ < 10) {
      std::printf("root of %a: %a, got %a and %a\n", static_cast<double>(value), static_cast<double>(expected),
                  static_cast<double>(detail::portable_root(value)), static_cast<double>(square_root(value)));
    }
  }
  /// Those around a value that would be hard to round.
  void around(Real value) {
    const Real below = std::nextafter(value, Real(0)), above = std::nextafter(value, infinity<Real>);
    for (const Real one : {below, value, above}) {
      if (one > 0 && one < infinity<Real>) {
        this->value(one);
      }
    }
  }
  void bits(Bits bits) {
    Real real;
    std::memcpy(&real, &bits, sizeof real);
    value(real);
  }
  bool passed(const char* name) const {
    std::printf("%s: %llu values, %llu wrong\n", name, count_, wrong_);
    return wrong_ == 0 && count_ > 0;
  }

 private:
  unsigned long long count_ = 0, wrong_ = 0;
};

std::uint64_t draw(std::uint64_t& state) {
  state += 0x9e3779b97f4a7c15u;
  std::uint64_t mixed = (state ^ (state >> 30)) * 0xbf58476d1ce4e5b9u;
  mixed = (mixed ^ (mixed >> 27)) * 0x94d049bb133111ebu;
  return mixed ^ (mixed >> 31);
}

// Numbers from 1 to 4, as the others are these times a power of 4, and numbers of any size; one in so many of each.
bool floats(std::uint32_t mantissa_step, std::uint32_t step) {
  constexpr std::uint32_t one = 0x3f800000, four = 0x40800000, infinite = 0x7f800000;
  Check<float, std::uint32_t> check;
  for (std::uint32_t bits = one; bits <= four; bits += mantissa_step) {
    check.bits(bits);
  }
  for (std::uint32_t bits = 1; bits < infinite; bits += step) {
    check.bits(bits);
  }
  return check.passed("float");
}

// Powers of two, squares, the squares of the middles between two numbers, and numbers of any size.
bool doubles(int count) {
  Check<double, std::uint64_t> check;
  for (int e = -1074; e < 1024; ++e) {
    check.around(std::ldexp(1.0, e));
  }
  std::uint64_t state = 1;
  for (int i = 0; i < count; ++i) {
    const std::uint64_t drawn = draw(state);
    const double root = 1 + static_cast<double>(drawn >> 12) * 0x1p-52;
    check.around(root * root);
    check.around(root * root + root * 0x1p-52);
    check.bits(drawn % 0x7ff0000000000000u + 1);
    check.bits((drawn >> 12) + 1);  // subnormal
  }
  return check.passed("double");
}

}  // namespace

int main() {
  const char* nightly = std::getenv("PALPATE_NIGHTLY");
  const bool all = nightly && *nightly && *nightly != '0';
  return floats(all ? 1 : 7, all ? 1 : 997) && doubles(all ? 50000000 : 500000) ? 0 : 1;
}
