// SPDX-License-Identifier: MIT
// Eq. (2) near the ratio of a rigid object, in float and double: for each ratio a line with the type, the ratio, the
// modulus, its derivative and the ratio of that modulus, in hexadecimal.

#include <cstdio>
#include <palpate/elasticity.hpp>

namespace {

template <class Real>
void run(const char* type) {
  const palpate::Elasticity<Real> probe{Real(8.5), Real(1.25), Real(0.97)};
  for (Real left = Real(4); left > std::numeric_limits<Real>::epsilon(); left /= Real(10)) {
    const Real ratio = probe.rigid_ratio - left;
    if (!(ratio < probe.rigid_ratio)) {
      return;
    }
    const Real modulus = probe.modulus(ratio);
    std::printf("%s %a %a %a %a\n", type, static_cast<double>(ratio), static_cast<double>(modulus),
                static_cast<double>(probe.slope(ratio)), static_cast<double>(probe.ratio(modulus)));
  }
}

}  // namespace

int main() {
  run<float>("float32");
  run<double>("float64");
}
