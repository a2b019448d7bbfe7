// SPDX-License-Identifier: MIT
// lambda = 1 for a very long time, with a step of the ratio half-way: the error of each type and of compensated sums.
// Prints JSON; the number of samples is the argument.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <palpate/estimator/rls.hpp>

namespace {

/// The same estimator with a compensated sum (Kahan) for the information and for the ratio.
template <class Real>
struct Compensated {
  Real ratio_ = 1, information_ = Real(1e-4), lost_information = 0, lost_ratio = 0;

  static void add(Real& sum, Real& lost, Real value) {
    const Real corrected = value - lost;
    const Real next = sum + corrected;
    lost = (next - sum) - corrected;
    sum = next;
  }
  void update(Real output, Real regressor) {
    const Real innovation = output - regressor * ratio_;
    add(information_, lost_information, regressor * regressor);
    add(ratio_, lost_ratio, regressor / information_ * innovation);
  }
  Real ratio() const { return ratio_; }
  Real information() const { return information_; }
};

// Regressors 1/4 and 3/8, outputs exact: ratio 2, then 3; the least-squares result at the end is 2.5.
template <class Estimator, class Real>
void run(const char* name, long long samples, const char* end) {
  Estimator estimator;
  Real half = 0;
  for (long long i = 0; i < samples; ++i) {
    const Real x = i % 2 ? Real(0.375) : Real(0.25);
    estimator.update((i < samples / 2 ? Real(2) : Real(3)) * x, x);
    if (i == samples / 2 - 1) {
      half = estimator.ratio();
    }
  }
  const double exact = static_cast<double>(samples) * (0.25 * 0.25 + 0.375 * 0.375) / 2 + 1e-4;
  std::printf("  \"%s\": {\"half\": %.9g, \"ratio\": %.9g, \"information\": %.9g, \"exact information\": %.9g}%s\n",
              name, static_cast<double>(half), static_cast<double>(estimator.ratio()),
              static_cast<double>(estimator.information()), exact, end);
}

}  // namespace

int main(int argc, char** argv) {
  const long long samples = argc > 1 ? std::atoll(argv[1]) : 1000000000;
  std::printf("{\n  \"samples\": %lld,\n", samples);
  run<palpate::Rls<double>, double>("Rls<double>", samples, ",");
  run<palpate::Rls<float>, float>("Rls<float>", samples, ",");
  run<palpate::FixedRls<float>, float>("Rls<float>, lambda 0.995", samples, ",");
  run<Compensated<float>, float>("float with compensated sums", samples, "");
  std::printf("}\n");
}
