// SPDX-License-Identifier: MIT
// A bank of streams is as many estimators, bit for bit, refused samples included; whatever the width of the packs.

#include <array>
#include <cstring>
#include <limits>
#include <palpate/bank.hpp>

#include "samples.hpp"

namespace {

template <class Real>
bool same(Real a, Real b) {
  return std::memcmp(&a, &b, sizeof(Real)) == 0;
}

// Streams of different ratios; stream s refuses every (s + 5)-th sample.
template <class Core, std::size_t Streams>
bool bank_is_many_estimators(const Core& core = Core()) {
  using Real = typename Core::real_type;
  palpate::Bank<Core, Streams> bank(core);
  std::array<Core, Streams> cores;
  cores.fill(core);
  std::uint64_t rejected[Streams] = {};
  bool ok = true;
  for (int k = 0; k < 250; ++k) {
    Real output[Streams], regressor[Streams], ratios[Streams];
    for (std::size_t s = 0; s < Streams; ++s) {
      const Samples<Real> samples(10 + static_cast<int>(s));
      const bool bad = static_cast<std::size_t>(k) % (s + 5) == 3;
      output[s] = bad ? std::numeric_limits<Real>::infinity() : samples.output[k];
      regressor[s] = k % 50 == 7 ? Real(0) : samples.regressor[k];
    }
    bank.update(output, regressor, ratios);
    for (std::size_t s = 0; s < Streams; ++s) {
      rejected[s] += !cores[s].update(output[s], regressor[s]).accepted;
      ok = ok && same(ratios[s], cores[s].ratio()) && same(bank.ratio(s), cores[s].ratio()) &&
           same(bank.information(s), cores[s].information()) && same(bank.statistic(s), cores[s].statistic()) &&
           bank.alarm(s) == cores[s].alarm() && bank.rejected(s) == rejected[s];
    }
  }
  return ok;
}

template <class Real>
bool all() {
  using Paper = palpate::Rls<Real, palpate::SwitchedForgetting<Real>, palpate::Cusum<Real>>;  // without a bound
  const palpate::AdaptiveRls<Real> cleared_early({}, {Real(0.01), Real(0.05), Real(0.05)});
  return bank_is_many_estimators<palpate::AdaptiveRls<Real>, 1>() &&
         bank_is_many_estimators<palpate::AdaptiveRls<Real>, 21>(cleared_early) &&
         bank_is_many_estimators<palpate::AdaptiveRls<Real>, 37>() &&
         bank_is_many_estimators<palpate::FixedRls<Real>, 16>() && bank_is_many_estimators<palpate::Rls<Real>, 9>() &&
         bank_is_many_estimators<Paper, 13>();
}

}  // namespace

int main() { return all<double>() && all<float>() ? 0 : 1; }
