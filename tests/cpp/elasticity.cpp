// SPDX-License-Identifier: MIT
// Eq. (2) at compile time, where undefined behaviour is an error; and its values, in hexadecimal, for the Python twin.

#include <cstdio>
#include <limits>
#include <palpate/elasticity.hpp>

namespace {

using namespace palpate;

template <class Real>
constexpr Real infinity = std::numeric_limits<Real>::infinity();

template <class Real>
constexpr bool ends() noexcept {
  constexpr Elasticity<Real> probe;
  return probe.ratio(0) == 1 && probe.ratio(2) == Real(5.5) && probe.ratio(infinity<Real>) == 10 &&
         probe.ratio(std::numeric_limits<Real>::max()) == 10 && probe.modulus(1) == 0 &&
         probe.modulus(Real(5.5)) == 2 && probe.slope(1) == Real(2) / Real(9);
}
static_assert(ends<float>() && ends<double>());

template <class Real>
constexpr bool is_nan(Real value) noexcept {
  return value != value;
}

template <class Real>
constexpr bool no_answer() noexcept {
  constexpr Elasticity<Real> probe;
  constexpr Real nan = std::numeric_limits<Real>::quiet_NaN();
  return probe.reach(nan) == Reach::unknown && probe.reach(Real(0.99)) == Reach::too_soft &&
         probe.reach(1) == Reach::within && probe.reach(Real(9.99)) == Reach::within &&
         probe.reach(10) == Reach::too_stiff && probe.reach(infinity<Real>) == Reach::too_stiff &&
         probe.reach(-infinity<Real>) == Reach::too_soft && is_nan(probe.modulus(nan)) &&
         is_nan(probe.modulus(Real(0.99))) && is_nan(probe.modulus(10)) && is_nan(probe.slope(10)) &&
         is_nan(probe.ratio(-1)) && is_nan(probe.ratio(nan));
}
static_assert(no_answer<float>() && no_answer<double>());

// The last number below the rigid ratio still has an answer, and a finite one.
static_assert(is_finite(Elasticity<float>{}.modulus(9.999999F)) && Elasticity<float>{}.modulus(9.999999F) > 1e6F);

// (2) as printed: k_h = 800, k_s = 100 and k_o = 400 N/m; r = k_h (k_o + k_s) / (k_s (k_o + k_h)).
constexpr auto springs = Elasticity<double>::of_stiffness(800, 100);
constexpr double shown = 800.0 * (400 + 100) / (100.0 * (400 + 800));
static_assert(magnitude(springs.modulus(shown) - 400) < 1e-12 * 400 && magnitude(springs.ratio(400) - shown) < 1e-15);

template <class Real>
constexpr bool rises_and_returns() noexcept {
  constexpr Elasticity<Real> probe{Real(8.5), Real(1.25), Real(0.97)};
  constexpr Real eps = std::numeric_limits<Real>::epsilon();
  Real before = 0;
  for (Real modulus = Real(1e-3); modulus < 1000; modulus = modulus * Real(1.5)) {
    const Real ratio = probe.ratio(modulus);
    // r is within 2 eps of the exact one (relative), and moves E by its slope; E's own three roundings come on top.
    const Real allowed = 2 * eps * ratio * probe.slope(ratio) + 4 * eps * modulus;
    if (!(ratio > before) || magnitude(probe.modulus(ratio) - modulus) > 2 * allowed) {
      return false;
    }
    before = ratio;
  }
  return true;
}
static_assert(rises_and_returns<float>() && rises_and_returns<double>());

}  // namespace

int main() {
  constexpr Elasticity<double> probe{8.5, 1.25, 0.97};
  constexpr double moduli[] = {0.0, 0.143, 1.25, 8.68, 1e6, infinity<double>};
  for (const double modulus : moduli) {
    const double ratio = probe.ratio(modulus);
    std::printf("%a %a %a %a\n", modulus, ratio, probe.modulus(ratio), probe.slope(ratio));
  }
  return 0;
}
