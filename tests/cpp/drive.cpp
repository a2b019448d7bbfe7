// SPDX-License-Identifier: MIT
// Drives one stage for the tests in tests/core: drive STAGE TYPE, numbers in from stdin and out to stdout as float64.

#include <cstdio>
#include <cstring>
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

// Rows of six numbers; the first five are swept in order. Out: which could be swept, coefficients, errors, residual.
template <class Real>
void sweep() {
  Sweep<Real, 6> sums;
  while (more()) {
    Real row[6];
    for (Real& value : row) {
      value = static_cast<Real>(next());
    }
    sums.add(row);
  }
  bool swept[5];
  for (int i = 0; i < 5; ++i) {
    swept[i] = sums.sweep(i);
  }
  for (int i = 0; i < 5; ++i) {
    put(swept[i], sums.at(i, 5), sums.error(i));
  }
  put(sums.at(5, 5), sums.at(0, 1), 0);
}

// Noises of hard and soft, the ratio, then output, regressor, number of each pair; a negative number: restart by the
// output.
template <class Real>
void fit() {
  Fit<Real> stage;
  const auto hard = static_cast<Real>(next()), soft = static_cast<Real>(next());
  const auto ratio = static_cast<Real>(next());
  while (more()) {
    const auto y = static_cast<Real>(next()), x = static_cast<Real>(next());
    const double number = next();
    if (number < 0) {
      stage.restart(y);
    } else {
      stage.add(y, x, static_cast<std::uint32_t>(number));
    }
  }
  const auto f = stage.result(hard, soft, ratio);
  put(f.offset, f.drift, f.lag, f.curve, f.open, f.open_drift, f.offset_ratio, f.offset_error, f.flags);
}

// Times in ns, values.
template <class Real>
void pair() {
  MatchedPair<Real, std::int64_t> stage;
  while (more()) {
    const auto hard_time = static_cast<std::int64_t>(next()), soft_time = static_cast<std::int64_t>(next());
    const auto hard = static_cast<Real>(next()), soft = static_cast<Real>(next());
    const auto found = stage.feed(hard_time, soft_time, hard, soft);
    put(found.hard, found.soft, found.valid, found.matched);
  }
}

template <class Real>
void halves() {
  Halves<Real, 32> stage;
  for (int i = 0; i < 32; ++i) {
    stage.add(i, static_cast<Real>(next()));
  }
  const auto found = stage.summary(Real(3), Real(1e-6));
  put(found.mean, found.count, found.slope, found.noise, found.floor);
}

template <class Real>
void baseline() {
  Baseline<Real> stage;
  while (more()) {
    const auto value = static_cast<Real>(next());
    stage.ready() ? stage.follow(value) : stage.collect(value);
    put(stage.ready(), stage.level(), stage.expected(), stage.slope(), stage.noise(), stage.variance(), stage.age());
  }
}

// Change, noise, seconds since a touch took samples, whether a baseline is being measured.
template <class Real>
void contact() {
  Contact<Real> stage;
  while (more()) {
    const auto change = static_cast<Real>(next()), noise = static_cast<Real>(next());
    const auto waited = static_cast<Real>(next());
    const bool between = next() > 0;
    between ? stage.update_between(change, noise) : stage.update(change, noise, waited);
    put(stage.contact(), stage.idle(), stage.age(), stage.fell(), stage.suspects());
  }
}

template <class Real>
struct Known {
  Real numbers[5];  // level, variance, age, noise, slope
  Real level() const { return numbers[0]; }
  Real variance() const { return numbers[1]; }
  Real age() const { return numbers[2]; }
  Real noise() const { return numbers[3]; }
  Real slope() const { return numbers[4]; }
};

// Start, number of samples, forgetting, sample of a hand-over or -1, its count, readings until the end, ratio, mean
// regressor; then the numbers of four baselines: hard and soft before, hard and soft after.
template <class Real>
void revise() {
  Reviser<Real> stage;
  const auto start = static_cast<std::size_t>(next());
  const int samples = static_cast<int>(next());
  const auto forgetting = static_cast<Real>(next());
  const int change = static_cast<int>(next());
  const auto kept = static_cast<Real>(next());
  const auto reading = static_cast<std::size_t>(next());
  const auto ratio = static_cast<Real>(next()), mean = static_cast<Real>(next());
  Known<Real> known[4];
  for (auto& one : known) {
    for (Real& number : one.numbers) {
      number = static_cast<Real>(next());
    }
  }
  stage.begin(start);
  Real count = 0;
  for (int i = 0; i < samples; ++i) {
    count = i == change ? kept : forgetting * count + 1;
    stage.follow(start + static_cast<std::size_t>(i), count, i == change, true);
  }
  stage.keep(known[0], known[1], start);
  const auto found = stage.result(known[2], known[3], reading, ratio, mean);
  put(static_cast<int>(found.kind), found.shift, found.variance, found.open, found.significant);
}

template <class Real>
void stamps() {
  SteadyStamps<Real, std::int64_t> stage;
  while (more()) {
    put(stage.smooth(static_cast<std::int64_t>(next())));
  }
}

// Times in us, values; out: the last touch, as it is known at the end.
template <class Real>
void handheld() {
  HandheldTracker<Real, std::uint32_t> tracker;
  while (more()) {
    const auto hard_time = static_cast<std::uint32_t>(next()), soft_time = static_cast<std::uint32_t>(next());
    const auto hard = static_cast<Real>(next()), soft = static_cast<Real>(next());
    tracker.feed(hard_time, soft_time, hard, soft);
  }
  tracker.finish();
  const auto touch = tracker.touch();
  put(touch.ratio, touch.standard_error, touch.samples, touch.fitted.flags, touch.fitted.offset, touch.fitted.drift,
      touch.fitted.lag, touch.fitted.curve);
}

template <class Real>
bool drive(const char* stage) {
  const struct {
    const char* name;
    void (*run)();
  } all[] = {{"sweep", sweep<Real>},   {"fit", fit<Real>},           {"pair", pair<Real>},
             {"halves", halves<Real>}, {"baseline", baseline<Real>}, {"contact", contact<Real>},
             {"revise", revise<Real>}, {"stamps", stamps<Real>},     {"handheld", handheld<Real>}};
  for (const auto& one : all) {
    if (std::strcmp(one.name, stage) == 0) {
      one.run();
      return true;
    }
  }
  return false;
}

}  // namespace

int main(int count, char** arguments) {
  double value = 0;
  while (std::fread(&value, sizeof value, 1, stdin) == 1) {
    in.push_back(value);
  }
  const bool narrow = count > 2 && std::strcmp(arguments[2], "float") == 0;
  return count > 1 && (narrow ? drive<float>(arguments[1]) : drive<double>(arguments[1])) ? 0 : 1;
}
