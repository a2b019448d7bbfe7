// SPDX-License-Identifier: MIT
// Estimators and scenes on readings that are seen once: ns for each reading, bytes of state, error of the ratio. Prints
// JSON. Usage: native [ROUNDS]

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <palpate/palpate.hpp>
#include <string>
#include <vector>

namespace {

using namespace palpate;
using Clock = std::chrono::steady_clock;

constexpr double truth = 2.5;
constexpr std::size_t chunk = 2000, chunks = 320;
constexpr std::size_t idle = 60, first = 2 * idle;  // readings without contact; the first one that is timed

/// The same numbers on every machine, evenly from -0.7e-4 to 0.7e-4.
class Noise {
 public:
  double next() {
    state_ = state_ * 1664525u + 1013904223u;
    return (static_cast<double>(state_ >> 8) / 16777216 - 0.5) * 1.4e-4;
  }
  bool coin() const { return state_ >> 20 & 1; }

 private:
  std::uint32_t state_ = 1;
};

enum class Kind {
  readings,   // the soft channel half a pair later
  changes,    // of both channels at the same times: what an estimator alone can take
  flicker,    // changes with bursts that turn the alarm of the paper on and off
  untouched,  // changes of 0
};

/// A long hold with tremor and converter noise.
struct Readings {
  std::vector<Nanoseconds> t_hard, t_soft;
  std::vector<double> hard, soft;

  explicit Readings(Kind kind) {
    Noise noise;
    const bool whole = kind == Kind::readings;
    for (std::size_t i = 0; i < first + chunk * chunks; ++i) {
      const auto t = 26000000 * static_cast<std::int64_t>(i) + static_cast<std::int64_t>(i % 7) * 50000;
      const auto press = [&](std::int64_t at) {
        const double s = static_cast<double>(at) * 1e-9;
        return i < idle || kind == Kind::untouched ? 0.0
                                                   : 0.25 * (1 + 0.03 * std::sin(50 * s) + 0.01 * std::sin(27 * s));
      };
      const double burst = kind == Kind::flicker && i / 4 % 2 ? (noise.coin() ? 0.03 : -0.03) : 0.0;
      t_hard.push_back(Nanoseconds(t));
      t_soft.push_back(Nanoseconds(t + 13000000));
      hard.push_back(truth * press(t) + noise.next() + burst);
      soft.push_back(whole ? press(t + 13000000) + noise.next() : press(t));
    }
  }
};

/// An estimator alone, behind the interface of a tracker.
template <class Estimator>
struct Alone {
  struct Ratio {
    double ratio;
  };
  struct {
    std::uint32_t samples;
    double seconds;
  } settings;
  Estimator estimator;

  Ratio feed(Nanoseconds, Nanoseconds, double output, double regressor) {
    estimator.update(output, regressor);
    return {estimator.ratio()};
  }
};

struct Line : VectorRls<double, 1, true> {
  void update(double output, double regressor) { VectorRls::update(output, {regressor}); }
  double ratio() const { return coefficients()[0]; }
};

/// A subject on its way through the readings, part by part, and from the start again at the end.
template <class Subject>
class Walk {
 public:
  Walk(const Readings& readings, std::size_t part) : in_(readings), part_(part) { begin(); }

  /// Take the part; the subject stays as it was before it, so that this can be repeated.
  void work() {
    Subject subject = subject_;
    sink_ = pass(subject, at_, at_ + part_);
  }

  /// Go to the next part, and read it into the cache.
  void renew() {
    pass(subject_, at_, at_ + part_);
    at_ += part_;
    if (at_ + part_ > in_.hard.size()) {
      begin();
    }
    double sum = 0;
    for (std::size_t i = at_; i < at_ + part_; ++i) {
      sum += static_cast<double>(in_.t_hard[i].count + in_.t_soft[i].count) + in_.hard[i] + in_.soft[i];
    }
    sink_ = sum;
  }

  /// rms of ratio / truth - 1 over the second half of the first chunk.
  double error() const {
    Subject subject = subject_;
    pass(subject, first, first + chunk / 2);
    double sum = 0;
    for (std::size_t i = first + chunk / 2; i < first + chunk; ++i) {
      const double off = subject.feed(in_.t_hard[i], in_.t_soft[i], in_.hard[i], in_.soft[i]).ratio / truth - 1;
      sum += off * off;
    }
    return std::sqrt(sum / (static_cast<double>(chunk) / 2));
  }

 private:
  __attribute__((noinline)) double pass(Subject& subject, std::size_t from, std::size_t to) const {
    Subject local = subject;
    double sum = 0;
    for (std::size_t i = from; i < to; ++i) {
      sum += local.feed(in_.t_hard[i], in_.t_soft[i], in_.hard[i], in_.soft[i]).ratio;
    }
    subject = local;
    return sum;
  }

  void begin() {
    subject_ = Subject();
    subject_.settings.samples = 0;  // one touch, whatever the scene's length
    subject_.settings.seconds = 0;
    pass(subject_, 0, first);
    at_ = first;
  }

  const Readings& in_;
  std::size_t part_, at_ = first;
  Subject subject_;
  volatile double sink_ = 0;
};

/// The equations of the paper as printed, with the alarm of its text.
struct Literal {
  double r = 1, p = 1e12, g = 0;
  bool alarm = false;

  void update(double output, double regressor) {
    const double e = output - regressor * r;
    g = std::max(0.0, g + std::abs(e) - 0.01);
    alarm = g > (alarm ? 0.0 : 0.05);
    const double lambda = alarm ? 0.9 : 0.995;
    const double gain = p * regressor / (lambda + regressor * p * regressor);
    p = (p - p * regressor * regressor * p / (lambda + regressor * regressor * p)) / lambda;
    r += gain * e;
  }
  double ratio() const { return r; }
};

/// Subjects that are timed alternately: a slow moment of the machine affects all of them.
///
/// A branch predictor learns thousands of samples by heart. So each is timed on its first pass over a part that no loop has
/// seen, read into the cache before.
class Bench {
 public:
  template <class Subject>
  void add(const char* name, const Readings& readings, std::size_t part = chunk) {
    const auto walk = std::make_shared<Walk<Subject>>(readings, part);
    rows_.push_back(
        {name, sizeof(Subject), part, walk->error(), [walk] { walk->work(); }, [walk] { walk->renew(); }, {}});
  }

  void run(int rounds) {
    for (int round = 0; round < rounds; ++round) {
      for (Row& row : rows_) {
        row.work();  // the code into the caches
        row.renew();
        const auto start = Clock::now();
        row.work();
        const std::chrono::duration<double, std::nano> passed = Clock::now() - start;
        row.ns.push_back(passed.count() / static_cast<double>(row.part));
      }
    }
  }

  void print() {
    for (Row& row : rows_) {
      std::sort(row.ns.begin(), row.ns.end());
      std::printf("%s\"%s\": {\"min\": %.4f, \"median\": %.4f, \"error\": %.3e, \"bytes\": %zu}",
                  &row == rows_.data() ? "{" : ",\n ", row.name.c_str(), row.ns.front(), row.ns[row.ns.size() / 2],
                  row.error, row.bytes);
    }
    std::printf("}\n");
  }

 private:
  struct Row {
    std::string name;
    std::size_t bytes, part;
    double error;
    std::function<void()> work, renew;
    std::vector<double> ns;
  };
  std::vector<Row> rows_;
};

/// No pair goes to the test of the model.
template <class Stage>
struct Unmatched : Stage {
  static constexpr Pace pace() noexcept { return Pace::fast; }
  FilteredPair<double> feed(Nanoseconds hard_time, Nanoseconds soft_time, double hard, double soft, bool wanted) {
    const auto pair = Stage::feed(hard_time, soft_time, hard, soft, wanted);
    return {pair.hard, pair.soft, pair.valid};
  }
};
using Aligned = Unmatched<Align<double, Nanoseconds>>;
using Unaligned = Unmatched<NoAlign<double, Nanoseconds>>;
using Matched = MatchedPair<double, Nanoseconds>;
using Hand = Handover<double>;

/// Scene "handheld" with another alignment.
template <class AlignStage>
struct With : Handheld<double> {
  using align = AlignStage;
  template <class Estimator>
  using judge_for = Judge<Estimator, Nanoseconds, NoLevelRatio<double>>;
  template <class Estimator>
  using settings_for = Kept<TrackerSettings<Estimator>>;
};
struct Unjudged : With<Matched> {
  template <class Estimator>
  using judge_for = NoJudge<Estimator>;
};
struct Ungated : Unjudged {
  using baseline = NoBaseline<double>;
  using contact = AlwaysContact<double>;
};
struct Paperlike : Unjudged {
  using estimator = AdaptiveRls<double>;
};

}  // namespace

int main(int argc, char** argv) {
  const Readings readings(Kind::readings), changes(Kind::changes), flicker(Kind::flicker), untouched(Kind::untouched);
  using Adaptive = Alone<AdaptiveRls<double>>;
  Bench bench;
  bench.add<Alone<Literal>>("the paper's form literally", changes);
  bench.add<Alone<FixedRls<double>>>("Rls", changes);
  bench.add<Adaptive>("AdaptiveRls", changes);
  bench.add<Adaptive>("AdaptiveRls, alarm flickering", flicker);
  bench.add<Adaptive>("AdaptiveRls, idle", untouched);
  bench.add<Adaptive>("AdaptiveRls, 250 samples", changes, 250);
  bench.add<Alone<AdaptiveWindow<double>>>("HandoverRls", changes);
  bench.add<Alone<AdaptiveWindow<double>>>("HandoverRls, 250 samples", changes, 250);
  bench.add<Alone<Hand>>("Handover, of the scenes", changes);
  bench.add<Alone<Line>>("VectorRls, slope and intercept", changes);
  bench.add<FixedTracker<double>>("scene fixed", readings);
  bench.add<PaperTracker<double>>("scene paper", readings);
  bench.add<HandheldTracker<double>>("scene handheld", readings);
  bench.add<Tracker<With<Matched>>>("handheld without level ratio", readings);
  bench.add<Tracker<Unjudged>>("handheld without fit", readings);
  bench.add<Tracker<With<Unaligned>>>("handheld without align", readings);
  bench.add<Tracker<With<Aligned>>>("handheld, interpolated", readings);
  bench.add<Tracker<Ungated>>("handheld without baseline, contact and fit", readings);
  bench.add<Tracker<Paperlike>>("handheld with AdaptiveRls, without fit", readings);
  bench.run(argc > 1 ? std::atoi(argv[1]) : 100);
  bench.print();
}
