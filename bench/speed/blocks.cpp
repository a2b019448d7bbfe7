// SPDX-License-Identifier: MIT
// One stream in blocks, a whole scene, and many streams: ns for each sample, with the error of the result. Prints JSON.

#include <cstdlib>
#include <memory>
#include <palpate/palpate.hpp>

#include "banks.hpp"
#include "feeds.hpp"
#include "literal.hpp"
#include "timing.hpp"

namespace {

using namespace palpate;

constexpr std::size_t chunk = 2000, chunks = 640;

template <class Estimator, class Real>
__attribute__((noinline)) void block(Estimator& estimator, const Real* output, const Real* regressor, Real* ratio,
                                     std::size_t size) {
  Estimator local = estimator;
  for (std::size_t i = 0; i < size; ++i) {
    local.update(output[i], regressor[i]);
    ratio[i] = local.ratio();
  }
  estimator = local;
}

/// rms of ratio / truth - 1 over the second half.
template <class Real>
double error_of(const std::vector<Real>& ratio) {
  double sum = 0;
  for (std::size_t i = ratio.size() / 2; i < ratio.size(); ++i) {
    const double error = static_cast<double>(ratio[i]) / truth - 1;
    sum += error * error;
  }
  return std::sqrt(sum / (static_cast<double>(ratio.size()) / 2));
}

/// The two numbers of each sample, as Real. easy: all estimators can be equally accurate.
template <class Real>
struct Pairs {
  std::vector<Real> output, regressor;
  bool easy;
  explicit Pairs(const Series& from, bool easy_ = true)
      : output(from.output.begin(), from.output.end()),
        regressor(from.regressor.begin(), from.regressor.end()),
        easy(easy_) {}
};

template <class Estimator>
struct Block {
  using Real = typename Estimator::real_type;
  const Pairs<Real>& data;
  std::vector<Real> ratio;
  Cursor cursor;

  Block(const Pairs<Real>& data_, std::size_t size) : data(data_), ratio(size), cursor(size, data.output.size()) {}
  void work() {
    Estimator estimator;
    const auto at = cursor.at();
    block(estimator, data.output.data() + at, data.regressor.data() + at, ratio.data(), ratio.size());
  }
};

/// The errors of the rows, to be printed after their times.
std::vector<std::pair<std::string, double>> errors;

template <class Estimator, class Real>
void add_block(Bench& bench, const char* name, const Pairs<Real>& data, std::size_t size = chunk) {
  const auto row = std::make_shared<Block<Estimator>>(data, size);
  row->work();
  if (data.easy) {
    errors.emplace_back(name, error_of(row->ratio));
  }
  bench.add(
      name, static_cast<double>(size), [row] { row->work(); },
      [row] { row->cursor.renew(row->data.output, row->data.regressor); });
}

template <class Tracker>
void add_feed(Bench& bench, const char* name, const HeldReadings& readings, bool with_error = false) {
  const auto row = std::make_shared<Feed<Tracker>>(readings, chunk, with_error);
  bench.add(name, static_cast<double>(chunk), [row] { row->work(); }, [row] { row->renew(); });
}

template <class Fit>
using Handheld =
    Tracker<double, MatchedPair<double, std::int64_t>, Baseline<double>, Contact<double>, Handover<double>, Fit>;

}  // namespace

int main(int argc, char** argv) {
  const std::string prefix = argc > 1 ? argv[1] : "";
  const int rounds = argc > 2 ? std::atoi(argv[2]) : 100;
  const double multiply = multiply_ns();
  const Pairs<double> calm(Series(chunk * chunks)), flicker(Series(chunk * chunks, true), false),
      idle(Series(chunk * chunks, false, true), false);
  const Pairs<float> single(Series(chunk * chunks));
  const HeldReadings readings(chunk * 320);

  Bench bench;
  add_block<Literal>(bench, "the paper's form literally", calm);
  add_block<FixedRls<double>>(bench, "Rls", calm);
  add_block<AdaptiveRls<double>>(bench, "AdaptiveRls", calm);
  add_block<AdaptiveRls<double>>(bench, "AdaptiveRls, alarm flickering", flicker);
  add_block<AdaptiveRls<double>>(bench, "AdaptiveRls, idle", idle);
  add_block<Handover<double>>(bench, "HandoverRls", calm);
  add_block<Handover<float>>(bench, "HandoverRls, float", single);
  add_block<Rls<double>>(bench, "Rls, null policies", calm);
  add_block<AdaptiveRls<double>>(bench, "AdaptiveRls, 250 samples", calm, 250);
  add_feed<Handheld<NoFit<double>>>(bench, "handheld without fit", readings);
  add_feed<HandheldTracker<double>>(bench, "handheld", readings);
  add_feed<HandheldTracker<double>>(bench, "handheld, standard error a row", readings, true);
  add_streams<AdaptiveRls<double>>(bench, "bank of 64", 64, 250);
  add_streams<AdaptiveRls<float>>(bench, "bank of 64, float", 64, 250);
  add_streams<Handover<double>>(bench, "HandoverRlsBank(64)", 64, 1000);
  add_streams<Handover<float>>(bench, "HandoverRlsBank(64), float", 64, 1000);
  add_streams<Handover<double>>(bench, "HandoverRlsBank(64), touches of 250", 64, 250);
  bench.run(rounds);

  Bench large;
  add_large<AdaptiveRls<double>>(large, "bank of 65536, 16 rows", 16);
  add_large<AdaptiveRls<double>>(large, "bank of 65536, 64 rows", 64);
  large.run(std::max(3, rounds / 10));

  std::printf("{\n");
  bench.print(prefix);
  large.print(prefix);
  for (const auto& [name, error] : errors) {
    std::printf("  \"%serror, %s\": %.3e,\n", prefix.c_str(), name.c_str(), error);
  }
  std::printf("  \"%scycle\": %.4f\n}\n", prefix.c_str(), multiply / 3);
}
