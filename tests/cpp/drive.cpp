// SPDX-License-Identifier: MIT
// Drives one stage for the tests in tests/core: drive STAGE, numbers in from stdin and out to stdout as float64.

#include <cstdio>
#include <cstring>
#include <palpate/elasticity.hpp>
#include <palpate/palpate.hpp>
#include <vector>

namespace {

using namespace palpate;

std::vector<double> in;
std::size_t at = 0;

double next() { return in[at++]; }
bool more() { return at < in.size(); }

template <class... Values>
void put(Values... values) {
  const double row[] = {static_cast<double>(values)...};
  std::fwrite(row, sizeof(double), sizeof...(Values), stdout);
}

// Noises of hard and soft, the ratio, then output, regressor, number of each pair; a negative number: restart by the
// output.
void fit() {
  ModelTest<double> stage;
  const auto hard = next(), soft = next();
  const auto ratio = next();
  while (more()) {
    const auto y = next(), x = next();
    const double number = next();
    if (number < 0) {
      stage.restart(y);
    } else {
      stage.add(y, x, static_cast<std::uint32_t>(number));
    }
  }
  const auto f = stage.result(hard, soft, ratio);
  put(f.offset, f.drift, f.drift_error, f.lag, f.curve, f.open, f.open_drift, f.offset_ratio, f.offset_error, f.flags);
}

// Times in ns, values.
void pair() {
  MatchedPair<double, Nanoseconds> stage;
  while (more()) {
    const Nanoseconds hard_time(static_cast<std::int64_t>(next())), soft_time(static_cast<std::int64_t>(next()));
    const auto hard = next(), soft = next();
    const auto found = stage.feed(hard_time, soft_time, hard, soft);
    put(found.hard, found.soft, found.valid, found.matched);
  }
}

template <class Stage>
void follow(Stage stage, std::int64_t period_ns) {
  for (std::int64_t passed_ns = 0; more(); passed_ns += period_ns) {
    const auto value = next();
    if (stage.ready()) {
      stage.follow(value);
    } else {
      stage.collect(value);
      stage.collected(passed_ns, std::int64_t(1000000000));
    }
    put(stage.ready(), stage.level(), stage.expected(), stage.recovery(), stage.noise(), stage.variance(), stage.age(),
        stage.disturbed());
  }
}

// Period in ns, 0: the number of the first values is fixed; values.
void baseline() {
  const auto period_ns = static_cast<std::int64_t>(next());
  period_ns > 0 ? follow(Baseline<double, true, true>(), period_ns) : follow(Baseline<double>(), 0);
}

// Change, noise, seconds since a touch took samples, whether a baseline is being measured.
void contact() {
  Contact<double> stage;
  while (more()) {
    const auto change = next(), noise = next();
    const auto waited = next();
    const bool between = next() > 0;
    between ? stage.update_between(change, noise) : stage.update(change, noise, waited);
    put(stage.contact(), stage.age(), stage.idle(), stage.fell(), stage.suspects());
  }
}

struct Known {
  double numbers[6];  // level, variance, age, noise, recovery, slow
  double level() const { return numbers[0]; }
  double variance() const { return numbers[1]; }
  double age() const { return numbers[2]; }
  double noise() const { return numbers[3]; }
  double recovery() const { return numbers[4]; }
};

// Start, number of samples, forgetting, sample of a hand-over or -1, its count, readings until the end, ratio, mean
// regressor; the evidence of the touch: drift, its error, its length, level ratio and its error; then the
// numbers of four baselines: hard and soft before, hard and soft after.
void revise() {
  Reviser<double> stage;
  const auto start = static_cast<std::size_t>(next());
  const int samples = static_cast<int>(next());
  const auto forgetting = next();
  const int change = static_cast<int>(next());
  const auto kept = next();
  const auto reading = static_cast<std::size_t>(next());
  const auto ratio = next(), mean = next();
  TouchEvidence<double> evidence;
  for (double* number : {&evidence.drift, &evidence.drift_error, &evidence.length, &evidence.level.ratio,
                         &evidence.level.standard_error}) {
    *number = next();
  }
  Known known[4];
  for (auto& one : known) {
    for (double& number : one.numbers) {
      number = next();
    }
  }
  stage.begin(start);
  double count = 0;
  for (int i = 0; i < samples; ++i) {
    count = i == change ? kept : forgetting * count + 1;
    stage.follow(start + static_cast<std::size_t>(i), count, i == change, true);
  }
  stage.keep(known[0], known[1], known[0].numbers[5], known[1].numbers[5], start);
  const auto found = stage.result(known[2], known[3], reading, ratio, mean, evidence);
  put(static_cast<int>(found.kind), found.shift, found.variance, found.open, found.significant);
}

// Length of the mean, variance of the noise of a value; then values, each with 0, 1: a touch is suspected, or 2: it begins.
void slow_noise() {
  SlowNoise<double> stage;
  const auto length = next(), white = next();
  while (more()) {
    const auto value = next();
    const int what = static_cast<int>(next());
    what == 2 ? stage.interrupt() : stage.add(value, what == 1);
  }
  put(stage.of_mean(length, white));
}

void stamps() {
  SteadyStamps<double, Nanoseconds> stage;
  while (more()) {
    put(stage.smooth(Nanoseconds(static_cast<std::int64_t>(next()))).count);
  }
}

// Moduli.
void elasticity() {
  constexpr Elasticity<double> probe{8.5, 1.25, 0.97};
  while (more()) {
    const double ratio = probe.ratio(next());
    put(ratio, probe.modulus(ratio));
  }
}

}  // namespace

int main(int count, char** arguments) {
  const struct {
    const char* name;
    void (*run)();
  } all[] = {{"fit", fit},       {"pair", pair},     {"baseline", baseline},     {"contact", contact},
             {"revise", revise}, {"stamps", stamps}, {"elasticity", elasticity}, {"slow_noise", slow_noise}};
  for (double value; std::fread(&value, sizeof value, 1, stdin) == 1;) {
    in.push_back(value);
  }
  for (const auto& stage : all) {
    if (count == 2 && std::strcmp(stage.name, arguments[1]) == 0) {
      stage.run();
      return 0;
    }
  }
  return 1;
}
