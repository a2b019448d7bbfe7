// SPDX-License-Identifier: MIT
// Prints a hash of every state and step of Handover and of AdaptiveWindow over hostile data: the same in lanes and in turn, with the short way
// of an ordinary sample and without it, under every compiler and flag. And one of the test of the model.

#include <cinttypes>
#include <cstdio>
#include <limits>
#include <palpate/estimator/adaptive_window.hpp>
#include <palpate/estimator/handover.hpp>
#include <palpate/judge/model_test.hpp>

#include "alike.hpp"

namespace {

using palpate::product;

Hash hash;

template <class Real>
void add(Real value) {
  hash.add(value != value ? std::numeric_limits<Real>::quiet_NaN() : value);  // which NaN is not promised
}

std::uint64_t state;
std::uint64_t next() {
  state = state * 6364136223846793005u + 1442695040888963407u;
  return state >> 33;
}

/// A number from -1 to 1, of 24 bits.
template <class Real>
Real noise() {
  return static_cast<Real>(static_cast<std::int32_t>(next() >> 6) - (1 << 24)) / Real(1 << 24);
}

/// What no converter measures.
template <class Real>
Real strange() {
  using Limits = std::numeric_limits<Real>;
  constexpr Real nan = Limits::quiet_NaN(), infinite = Limits::infinity(), most = Limits::max(), zero = 0, one = 1;
  constexpr Real least = Limits::denorm_min(), large = sizeof(Real) == 4 ? Real(1e15) : Real(1e139);
  const Real all[] = {nan,  infinite, -infinite, most,   -most,       least, -least, Limits::min(),
                      zero, -zero,    large,     -large, one / large, one,   -one,   Limits::epsilon()};
  return all[next() % (sizeof(all) / sizeof(all[0]))];
}

/// Presses with noise, steps and drifts of the ratio, outliers, regressors about 0, and strange numbers, all in `kind`.
template <class Estimator>
void run(std::uint64_t kind, int samples, Estimator estimator) {
  using Real = typename Estimator::real_type;
  Real ratio = Real(2.5), press = Real(0.25);
  const Real scatter = kind & 1 ? Real(0) : kind & 2 ? Real(0.0625) : Real(1) / 16384;
  for (int i = 0; i < samples; ++i) {
    if (kind & 4 && next() % 64 == 0) {
      ratio = 4 * noise<Real>();
    }
    if (kind & 8) {
      ratio += Real(1) / 1024;
    }
    if (kind & 16 && next() % 8 == 0) {
      press = noise<Real>();
    }
    Real x = press + product(scatter, noise<Real>());
    Real y = product(ratio, press) + product(scatter, noise<Real>());
    if (next() % 32 == 0) {
      y += product(Real(64), scatter);
    }
    if (kind & 32 && next() % 16 == 0) {
      (next() % 2 ? x : y) = strange<Real>();
    }
    if (kind & 64 && i % 512 > 500) {
      x = y = strange<Real>();
    }
    if (kind & 128 && next() % 300 == 0) {
      estimator.reset(strange<Real>());
    }
    const auto step = estimator.update(y, x);
    add(step.ratio);
    add(step.innovation);
    add(step.gain);
    add(static_cast<Real>(step.alarm + 2 * step.accepted + 4 * step.outlier));
    estimator.visit_state([](Real& value) { add(value); });
  }
}

/// The settings of three runs: the defaults; an alarm every few samples; all limits as low as they go.
template <class Settings>
Settings eager(Settings settings) {
  settings.guard = 0;
  settings.threshold = 2;
  return settings;
}
template <class Settings>
Settings lowest(Settings settings) {
  settings.smoothing = 1;
  settings.clip = 1;
  settings.drift = 0;
  return settings;
}

template <template <class> class Settings, class Estimator>
void print(const char* name) {
  using Real = typename Estimator::real_type;
  for (std::uint64_t kind = 0; kind < 256; ++kind) {
    hash = Hash();
    state = kind;
    const int samples = kind % 16 == 0 ? 4000 : 200;
    Settings<Real> settings;
    run(kind, samples, Estimator({settings}));
    settings = eager(settings);
    if constexpr (std::is_same_v<Settings<Real>, palpate::HandoverSettings<Real>>) {
      settings.min_information = 0;
    } else {
      settings.cut = 2;
    }
    run(kind, samples, Estimator({settings}));
    settings = lowest(settings);
    if constexpr (std::is_same_v<Settings<Real>, palpate::HandoverSettings<Real>>) {
      settings.steady = Real(0.9);
    }
    run(kind, samples, Estimator({settings}));
    std::printf("%s %" PRIu64 " %016" PRIx64 "\n", name, kind, hash.value);
  }
}

// The test of the model where the depth varies by its last bits: whether a term is tested hangs on the rounding of its sums.
template <class Real>
void print_fits(const char* name) {
  hash = {};
  std::uint32_t drawn = 1;
  for (int touch = 0; touch < 400; ++touch) {
    palpate::ModelTest<Real> fit;
    for (std::uint32_t i = 0; i < 250; ++i) {
      drawn = drawn * 1664525u + 1013904223u;
      const Real x = 1 + static_cast<Real>(static_cast<std::int32_t>(drawn >> 19) - 4096) / Real(4194304);
      fit.add(3 * x + Real(0.25), x, i);  // exact
    }
    const auto found = fit.result(Real(1e-6), Real(1e-6), Real(3.25));
    add(found.open);
    add(found.offset_ratio);
    add(fit.mean().ratio);
  }
  std::printf("%s %016" PRIx64 "\n", name, hash.value);
}

}  // namespace

int main() {
  print<palpate::HandoverSettings, palpate::Handover<double>>("double");
  print<palpate::HandoverSettings, palpate::Handover<float>>("float");
  print<palpate::AdaptiveWindowSettings, palpate::AdaptiveWindow<double>>("double, windows");
  print<palpate::AdaptiveWindowSettings, palpate::AdaptiveWindow<float>>("float, windows");
  print_fits<double>("double, fit");
  print_fits<float>("float, fit");
}
