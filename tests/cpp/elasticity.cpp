// SPDX-License-Identifier: MIT
// Eq. (2) at compile time, where undefined behaviour is an error; and its values, in hexadecimal, for the Python twin.

#include <cstdio>
#include <limits>
#include <palpate/elasticity.hpp>

namespace {

using namespace palpate;

// What has no modulus has a reason, and the last number below the rigid ratio still has one.
template <class Real>
constexpr bool no_answer() noexcept {
  constexpr Elasticity<Real> probe;
  constexpr Real nan = std::numeric_limits<Real>::quiet_NaN(), all[] = {nan, Real(0.99), 10, 1, Real(9.99)};
  constexpr Reach reasons[] = {Reach::unknown, Reach::too_soft, Reach::too_stiff, Reach::within, Reach::within};
  bool right = probe.modulus(1) == 0 && probe.modulus(Real(5.5)) == 2 && probe.ratio(-1) != probe.ratio(-1);
  for (int i = 0; i < 5; ++i) {
    const Real modulus = probe.modulus(all[i]), slope = probe.slope(all[i]);
    right =
        right && probe.reach(all[i]) == reasons[i] && (modulus == modulus) == (i > 2) && (slope == slope) == (i > 2);
  }
  return right;
}
static_assert(no_answer<float>() && no_answer<double>());

// (2) as printed: k_h = 800, k_s = 100 and k_o = 400 N/m; r = k_h (k_o + k_s) / (k_s (k_o + k_h)).
constexpr auto springs = Elasticity<double>::of_stiffness(800, 100);
constexpr double shown = 800.0 * (400 + 100) / (100.0 * (400 + 800));
static_assert(magnitude(springs.modulus(shown) - 400) < 1e-12 * 400 && magnitude(springs.ratio(400) - shown) < 1e-15);

}  // namespace

int main() {
  constexpr Elasticity<double> probe{8.5, 1.25, 0.97};
  constexpr double moduli[] = {0.0, 0.143, 1.25, 8.68, 1e6, std::numeric_limits<double>::infinity()};
  for (const double modulus : moduli) {
    const double ratio = probe.ratio(modulus);
    std::printf("%a %a %a %a\n", modulus, ratio, probe.modulus(ratio), probe.slope(ratio));
  }
  return 0;
}
