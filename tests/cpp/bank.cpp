// SPDX-License-Identifier: MIT
// A bank of streams is as many estimators, bit for bit, refused samples included; whatever the width of the packs.

#include <array>
#include <cstring>
#include <limits>
#include <palpate/handover_bank.hpp>

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

// A whole state, number by number.
template <class Core>
bool same_state(Core one, Core other) {
  using Real = typename Core::real_type;
  Real numbers[64] = {};
  std::size_t size = 0, place = 0;
  bool ok = true;
  one.visit_state([&](const Real& number) { numbers[size++] = number; });
  other.visit_state([&](const Real& number) { ok = ok && same(number, numbers[place++]); });
  return ok && size == place && size == palpate::Lanes<Core>::numbers;
}

// A held press with noise. By stream: outliers, a change and its alarm, a drift, a late beginning, numbers out of range.
template <class Real>
struct Presses {
  std::uint32_t state = 1;

  Real noise() {
    state = state * 1664525u + 1013904223u;
    return static_cast<Real>(static_cast<std::int32_t>(state >> 16) - 32768) / Real(1 << 28);
  }
  void sample(int k, std::size_t s, Real& output, Real& regressor) {
    const Real ratio = (s % 3 == 1 && k > 120 ? Real(3) : Real(2)) + (s % 4 == 2 ? Real(k) / 4096 : Real(0));
    regressor = (k % 64 == 60 && s % 5 == 0 ? Real(0) : Real(0.25)) + noise();
    output = ratio * regressor + noise() + (k % 40 == 20 + static_cast<int>(s % 7) ? Real(0.01) : Real(0));
    if (s % 6 == 3 && k < 70) {
      output = std::numeric_limits<Real>::quiet_NaN();
    }
    if (s % 8 == 4 && k % 32 == 9) {
      regressor = std::numeric_limits<Real>::max();
    }
  }
};

struct Seen {
  bool same = true;
  int alarms = 0, outliers = 0, drifts = 0, refused = 0;
};

template <class Core, std::size_t Streams>
Seen handover_bank_is_many_estimators(const Core& core = Core()) {
  using Real = typename Core::real_type;
  static palpate::Bank<Core, Streams> bank;
  bank = palpate::Bank<Core, Streams>(core);
  std::array<Core, Streams> cores;
  cores.fill(core);
  std::uint64_t rejected[Streams] = {};
  Presses<Real> presses;
  Seen seen;
  for (int k = 0; k < 400; ++k) {
    Real output[Streams], regressor[Streams], ratios[Streams];
    for (std::size_t s = 0; s < Streams; ++s) {
      presses.sample(k, s, output[s], regressor[s]);
    }
    bank.update(output, regressor, k % 2 ? ratios : nullptr);
    for (std::size_t s = 0; s < Streams; ++s) {
      const Real count = cores[s].count();
      const auto step = cores[s].update(output[s], regressor[s]);
      rejected[s] += !step.accepted;
      seen.refused += !step.accepted;
      seen.alarms += step.alarm;
      seen.outliers += step.outlier;
      seen.drifts += !step.alarm && step.accepted && cores[s].count() < count;
      seen.same = seen.same && same_state(bank.core(s), cores[s]) && bank.rejected(s) == rejected[s] &&
                  (k % 2 == 0 || same(ratios[s], cores[s].ratio()));
    }
  }
  return seen;
}

template <class Real>
bool all_handover() {
  using Core = palpate::Handover<Real>;
  using Short = palpate::Handover<Real, palpate::Constant<palpate::defaults<palpate::HandoverSettings<Real>>>>;
  palpate::HandoverSettings<Real> other;
  other.steady = Real(0.98);
  other.threshold = 4;
  other.clip = 4;
  other.smoothing = Real(0.005);  // the first samples last longer
  other.guard = 0;
  const Seen seen = handover_bank_is_many_estimators<Core, 45>();
  return seen.same && seen.alarms > 9 && seen.outliers > 99 && seen.drifts > 9 && seen.refused > 99 &&
         handover_bank_is_many_estimators<Core, 1>().same && handover_bank_is_many_estimators<Short, 16>().same &&
         handover_bank_is_many_estimators<Core, 19>(Core({other}, Real(2), Real(1e6))).same;
}

}  // namespace

int main() {
#if defined(__AVX512DQ__)
  if (!__builtin_cpu_supports("avx512dq") || !__builtin_cpu_supports("avx512vl")) {
    return 0;  // not here
  }
#endif
  if (!(all_handover<double>() && all_handover<float>())) {
    return 2;
  }
  return all<double>() && all<float>() ? 0 : 1;
}
