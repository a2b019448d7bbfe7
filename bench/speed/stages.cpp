// SPDX-License-Identifier: MIT
// Cost of each stage: ns for each reading and bytes of state, measured alternately in one run. Prints JSON.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <palpate/palpate.hpp>
#include <vector>

#include "literal.hpp"

namespace {

using Real = double;
using Clock = std::chrono::steady_clock;
using namespace palpate;

constexpr int size = 10000;

struct Recorded {
  std::vector<std::int64_t> t_hard, t_soft;
  std::vector<Real> hard, soft;

  // A long hold with tremor and noise, after 60 readings of idle.
  Recorded() {
    std::uint32_t state = 1;
    const auto noise = [&] {
      state = state * 1664525u + 1013904223u;
      return (static_cast<Real>(state >> 8) / 16777216 - 0.5) * 1.4e-4;
    };
    for (int i = 0; i < size; ++i) {
      const std::int64_t t = 26000000LL * i + static_cast<std::int64_t>(i % 7) * 50000;
      const auto press = [&](std::int64_t at) {
        const Real s = static_cast<Real>(at) * 1e-9;
        return i < 60 ? 0.0 : 0.25 * (1 + 0.03 * std::sin(50 * s) + 0.01 * std::sin(27 * s));
      };
      t_hard.push_back(t);
      t_soft.push_back(t + 13000000);
      hard.push_back(0.6 + 2.5 * press(t) + noise());
      soft.push_back(press(t + 13000000) - 0.4 + noise());
    }
  }
};

template <class Work>
void time(const char* name, std::size_t bytes, Work work, bool last = false) {
  std::vector<double> ns;
  for (int i = 0; i < 200; ++i) {
    const auto start = Clock::now();
    work();
    ns.push_back(std::chrono::duration<double, std::nano>(Clock::now() - start).count() / size);
  }
  std::sort(ns.begin(), ns.end());
  std::printf("  \"%s\": {\"min_ns\": %.3f, \"median_ns\": %.3f, \"state_bytes\": %zu}%s\n", name, ns.front(), ns[100],
              bytes, last ? "" : ",");
}

volatile Real sink;

template <class Estimator>
auto estimator(const Recorded& in) {
  return [&in] {
    Estimator e;
    for (std::size_t i = 0; i < size; ++i) {
      e.update(in.hard[i] - 0.6, in.soft[i] + 0.4);
    }
    sink = e.ratio();
  };
}

template <class Scene>
auto scene(const Recorded& in, bool with_error = false) {
  return [&in, with_error] {
    Scene tracker;
    tracker.settings.samples = 0;  // one touch, whatever the scene's length
    tracker.settings.seconds = 0;
    Real sum = 0;
    for (std::size_t i = 0; i < size; ++i) {
      sum += tracker.feed(in.t_hard[i], in.t_soft[i], in.hard[i], in.soft[i]).ratio;
      if (with_error) {
        sum += tracker.standard_error();
      }
    }
    sink = sum;
  };
}

template <int Order>
using Aligned = Align<Real, std::int64_t, Order>;
using Unaligned = NoAlign<Real, std::int64_t>;
using Matched = MatchedPair<Real, std::int64_t>;
using Base = Baseline<Real>;
using Gate = Contact<Real>;
using Hand = Handover<Real>;

}  // namespace

int main() {
  const Recorded in;
  std::printf("{\n");
  time("the paper's form literally", sizeof(Literal), estimator<Literal>(in));
  time("Rls", sizeof(FixedRls<Real>), estimator<FixedRls<Real>>(in));
  time("AdaptiveRls", sizeof(AdaptiveRls<Real>), estimator<AdaptiveRls<Real>>(in));
  time("HandoverRls", sizeof(Hand), estimator<Hand>(in));
  time("scene fixed", sizeof(FixedTracker<Real>), scene<FixedTracker<Real>>(in));
  time("scene paper", sizeof(PaperTracker<Real>), scene<PaperTracker<Real>>(in));
  time("scene handheld", sizeof(HandheldTracker<Real>), scene<HandheldTracker<Real>>(in));
  time("handheld, standard error after every reading", sizeof(HandheldTracker<Real>),
       scene<HandheldTracker<Real>>(in, true));
  using F0 = Tracker<Real, Matched, Base, Gate, Hand>;
  time("handheld without fit", sizeof(F0), scene<F0>(in));
  using A0 = Tracker<Real, Unaligned, Base, Gate, Hand, Fit<Real>>;
  time("handheld without align", sizeof(A0), scene<A0>(in));
  using A4 = Tracker<Real, Aligned<4>, Base, Gate, Hand, Fit<Real>>;
  time("handheld, align by 4 points", sizeof(A4), scene<A4>(in));
  using A6 = Tracker<Real, Aligned<6>, Base, Gate, Hand, Fit<Real>>;
  time("handheld, align by 6 points", sizeof(A6), scene<A6>(in));
  using B0 = Tracker<Real, Matched, NoBaseline<Real>, AlwaysContact<Real>, Hand>;
  time("handheld without baseline, contact and fit", sizeof(B0), scene<B0>(in));
  using E0 = Tracker<Real, Matched, Base, Gate, AdaptiveRls<Real>>;
  time("handheld with AdaptiveRls, without fit", sizeof(E0), scene<E0>(in), true);
  std::printf("}\n");
}
