// SPDX-License-Identifier: MIT
// Prints the bits of two touches as a hash of every state on the way: the same under every compiler and flag.

#include <cinttypes>
#include <cstdio>
#include <initializer_list>
#include <palpate/bank.hpp>
#include <palpate/estimator/handover.hpp>
#include <palpate/palpate.hpp>

#include "alike.hpp"

namespace {

template <class Estimator>
void print(const char* name) {
  using Real = typename Estimator::real_type;
  Hash hash;
  for (const int ratio : {20, 63}) {
    const Samples<Real> samples(ratio);
    Estimator estimator;
    for (int i = 0; i < samples.size; ++i) {
      const auto step = estimator.update(samples.output[i], samples.regressor[i]);
      hash.add(step.ratio);
      hash.add(step.innovation);
      hash.add(estimator.covariance());
      hash.add(estimator.statistic());
    }
  }
  std::printf("%s %016" PRIx64 "\n", name, hash.value);
}

// Every ratio on the way of 21 streams, then the rest of the state.
template <class Estimator>
void print_bank(const char* name) {
  using Real = typename Estimator::real_type;
  constexpr int streams = 21;
  Hash hash;
  palpate::Bank<Estimator, streams> bank;
  for (int k = 0; k < Samples<Real>::size; ++k) {
    Real output[streams], regressor[streams], ratios[streams];
    for (int s = 0; s < streams; ++s) {
      const Samples<Real> samples(20 + s);
      output[s] = samples.output[k];
      regressor[s] = samples.regressor[k];
    }
    bank.update(output, regressor, ratios);
    for (const Real ratio : ratios) {
      hash.add(ratio);
    }
  }
  for (std::size_t s = 0; s < streams; ++s) {
    hash.add(Real(1) / bank[s].information());
    hash.add(bank[s].statistic());
  }
  std::printf("%s %016" PRIx64 "\n", name, hash.value);
}

}  // namespace

int main() {
  print<palpate::AdaptiveRls<double>>("AdaptiveRls");
  print<palpate::AdaptiveRls<float>>("AdaptiveRls32");
  print<palpate::Handover<double>>("HandoverRls");
  print<palpate::Handover<float>>("HandoverRls32");
  print<palpate::FixedRls<double>>("Rls");
  print<palpate::FixedRls<float>>("Rls32");
  print_bank<palpate::AdaptiveRls<double>>("AdaptiveRlsBank");
  print_bank<palpate::AdaptiveRls<float>>("AdaptiveRlsBank32");
  print_bank<palpate::Handover<double>>("HandoverRlsBank");
  print_bank<palpate::Handover<float>>("HandoverRlsBank32");
  print_bank<palpate::FixedRls<double>>("RlsBank");
  print_bank<palpate::FixedRls<float>>("RlsBank32");
}
