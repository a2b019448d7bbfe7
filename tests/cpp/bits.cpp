// SPDX-License-Identifier: MIT
// Prints the bits of two touches as a hash of every state on the way: the same under every compiler and flag.

#include <cinttypes>
#include <cstdio>
#include <initializer_list>
#include <palpate/estimator/adaptive_window.hpp>
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

// An estimator for each of 21 streams: every ratio on the way, then the rest of the state.
template <class Estimator>
void print_bank(const char* name) {
  using Real = typename Estimator::real_type;
  constexpr int streams = 21;
  Hash hash;
  static Estimator bank[streams];  // on the stack of WebAssembly there is too little room
  for (int k = 0; k < Samples<Real>::size; ++k) {
    for (int s = 0; s < streams; ++s) {
      const Samples<Real> samples(20 + s);
      hash.add(bank[s].update(samples.output[k], samples.regressor[k]).ratio);
    }
  }
  for (const Estimator& each : bank) {
    hash.add(Real(1) / each.information());
    hash.add(each.statistic());
  }
  std::printf("%s %016" PRIx64 "\n", name, hash.value);
}

}  // namespace

int main() {
  print<palpate::AdaptiveRls<double>>("AdaptiveRls");
  print<palpate::AdaptiveRls<float>>("AdaptiveRls32");
  print<palpate::AdaptiveWindow<double>>("HandoverRls");
  print<palpate::AdaptiveWindow<float>>("HandoverRls32");
  print<palpate::FixedRls<double>>("Rls");
  print<palpate::FixedRls<float>>("Rls32");
  print_bank<palpate::AdaptiveRls<double>>("AdaptiveRlsBank");
  print_bank<palpate::AdaptiveRls<float>>("AdaptiveRlsBank32");
  print_bank<palpate::AdaptiveWindow<double>>("HandoverRlsBank");
  print_bank<palpate::AdaptiveWindow<float>>("HandoverRlsBank32");
  print_bank<palpate::FixedRls<double>>("RlsBank");
  print_bank<palpate::FixedRls<float>>("RlsBank32");
}
