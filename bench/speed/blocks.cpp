// SPDX-License-Identifier: MIT
// One stream in blocks, and many streams: ns for each sample, with the error of the result. Prints JSON.

#include <cstdlib>
#include <memory>
#include <palpate/bank.hpp>
#include <palpate/estimator/handover.hpp>

#include "cache_lines.hpp"
#include "literal.hpp"
#include "timing.hpp"

namespace {

using namespace palpate;

constexpr double truth = 2.5;

struct Data {
  std::vector<double> output, regressor;

  // A held press with tremor and converter noise. flicker: bursts that turn the alarm of the paper on and off.
  Data(std::size_t size, bool flicker = false, bool idle = false) {
    std::uint32_t state = 1;
    for (std::size_t i = 0; i < size; ++i) {
      state = state * 1664525u + 1013904223u;
      const double noise = (static_cast<double>(state >> 8) / 16777216 - 0.5) * 1.4e-4;
      const double burst = flicker && i / 4 % 2 ? (state >> 20 & 1 ? 0.03 : -0.03) : 0.0;
      const double x = idle ? 0.0 : 0.25 * (1 + 0.03 * std::sin(1.3 * static_cast<double>(i)));
      regressor.push_back(x);
      output.push_back(truth * x + noise + burst);
    }
  }
};

template <class Estimator>
__attribute__((noinline)) void block(Estimator& estimator, const double* output, const double* regressor, double* ratio,
                                     std::size_t size) {
  Estimator local = estimator;
  for (std::size_t i = 0; i < size; ++i) {
    local.update(output[i], regressor[i]);
    ratio[i] = local.ratio();
  }
  estimator = local;
}

/// rms of ratio / truth - 1 over the second half.
double error_of(const std::vector<double>& ratio) {
  double sum = 0;
  for (std::size_t i = ratio.size() / 2; i < ratio.size(); ++i) {
    sum += (ratio[i] / truth - 1) * (ratio[i] / truth - 1);
  }
  return std::sqrt(sum / (static_cast<double>(ratio.size()) / 2));
}

template <class Estimator>
void add_block(Bench& bench, const char* name, const Data& data, std::vector<double>& ratio) {
  bench.add(name, static_cast<double>(ratio.size()), [&data, &ratio] {
    Estimator estimator;
    block(estimator, data.output.data(), data.regressor.data(), ratio.data(), ratio.size());
  });
}

template <class Core>
struct Streams {
  using Real = typename Core::real_type;
  using Numbers = LineVector<Real>;
  std::size_t streams, frames;
  Numbers output, regressor, ratios, ratio, information, statistic;
  std::vector<std::uint64_t> rejected;
  Lanes<Core> lanes;

  Streams(std::size_t streams_, std::size_t frames_)
      : streams(streams_),
        frames(frames_),
        ratios(streams * frames),
        ratio(streams),
        information(streams),
        statistic(streams),
        rejected(streams) {
    const Data data(streams * frames);
    output.assign(data.output.begin(), data.output.end());
    regressor.assign(data.regressor.begin(), data.regressor.end());
  }

  void run() {
    const Core core;
    std::fill(ratio.begin(), ratio.end(), core.ratio());
    std::fill(information.begin(), information.end(), core.information());
    std::fill(statistic.begin(), statistic.end(), Real(0));
    lanes.process({ratio.data(), information.data(), statistic.data(), rejected.data()}, output.data(),
                  regressor.data(), ratios.data(), streams, frames);
  }
};

template <class Core>
void add_streams(Bench& bench, const char* name, Streams<Core>& s) {
  bench.add(name, static_cast<double>(s.streams * s.frames), [&s] { s.run(); });
}

template <class Numbers>
void triad(const Numbers& a, const Numbers& b, Numbers& c) {
  for (std::size_t i = 0; i < c.size(); ++i) {
    c[i] = a[i] + 0.5 * b[i];
  }
}

}  // namespace

int main(int argc, char** argv) {
  const char* const prefix = argc > 1 ? argv[1] : "";
  const int rounds = argc > 2 ? std::atoi(argv[2]) : 100;
  const double multiply = multiply_ns();
  const Data calm(10000), flicker(10000, true), idle(10000, false, true), touch(250);
  std::vector<double> ratio(10000), short_ratio(250);

  Bench bench;
  add_block<Literal>(bench, "the paper's form literally", calm, ratio);
  add_block<FixedRls<double>>(bench, "Rls", calm, ratio);
  add_block<AdaptiveRls<double>>(bench, "AdaptiveRls", calm, ratio);
  add_block<AdaptiveRls<double>>(bench, "AdaptiveRls, alarm flickering", flicker, ratio);
  add_block<AdaptiveRls<double>>(bench, "AdaptiveRls, idle", idle, ratio);
  add_block<Handover<double>>(bench, "HandoverRls", calm, ratio);
  add_block<Rls<double>>(bench, "Rls, null policies", calm, ratio);
  add_block<AdaptiveRls<double>>(bench, "AdaptiveRls, 250 samples", touch, short_ratio);
  Streams<AdaptiveRls<double>> some(64, 250), many(65536, 16);
  Streams<AdaptiveRls<float>> some32(64, 250);
  add_streams(bench, "bank of 64", some);
  add_streams(bench, "bank of 64, float", some32);
  bench.run(rounds);

  Bench large;
  add_streams(large, "bank of 65536", many);
  large.add("triad over the same arrays", static_cast<double>(many.ratios.size()),
            [&] { triad(many.output, many.regressor, many.ratios); });
  large.run(std::max(3, rounds / 10));

  std::printf("{\n");
  bench.print(prefix);
  large.print(prefix);
  block(*std::make_unique<Literal>(), calm.output.data(), calm.regressor.data(), ratio.data(), ratio.size());
  std::printf("  \"%serror, the paper's form literally\": %.3e,\n", prefix, error_of(ratio));
  FixedRls<double> fixed;
  block(fixed, calm.output.data(), calm.regressor.data(), ratio.data(), ratio.size());
  std::printf("  \"%serror, Rls\": %.3e,\n", prefix, error_of(ratio));
  AdaptiveRls<double> adaptive;
  block(adaptive, calm.output.data(), calm.regressor.data(), ratio.data(), ratio.size());
  std::printf("  \"%serror, AdaptiveRls\": %.3e,\n", prefix, error_of(ratio));
  Handover<double> handover;
  block(handover, calm.output.data(), calm.regressor.data(), ratio.data(), ratio.size());
  std::printf("  \"%serror, HandoverRls\": %.3e,\n", prefix, error_of(ratio));
  std::printf("  \"%scycle\": %.4f\n}\n", prefix, multiply / 3);
}
