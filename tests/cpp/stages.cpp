// SPDX-License-Identifier: MIT
// Each stage by itself, and every scene as a whole, at compile time.

#include <limits>
#include <palpate/palpate.hpp>

namespace {

using namespace palpate;

constexpr bool near(double left, double right, double relative) noexcept {
  return magnitude(left - right) <= relative * magnitude(right);
}

// A cubic is interpolated exactly by four points, a line by two, whatever the times; up to rounding.
template <class Real, class Ticks, int Order>
constexpr bool interpolates(Real tolerance) noexcept {
  Align<Real, Ticks, Order> align;
  align.settings.max_gap = 1000000;
  int valid = 0;
  Ticks hard_time = 1000;
  for (int i = 0; i < 20; ++i) {
    const auto soft_time = static_cast<Ticks>(hard_time + static_cast<Ticks>(9000 + 700 * (i % 3)));
    const Real t = static_cast<Real>(soft_time) / 100000;
    const Real value = Order == 2 ? 2 + 3 * t : 2 + 3 * t - t * t + t * t * t / 4;
    const auto pair = align.feed(hard_time, soft_time, static_cast<Real>(hard_time) / 100000, value);
    if (pair.valid) {
      const Real at = pair.hard;
      const Real expected = Order == 2 ? 2 + 3 * at : 2 + 3 * at - at * at + at * at * at / 4;
      valid += magnitude(pair.soft - expected) <= tolerance * magnitude(expected);
    }
    hard_time = static_cast<Ticks>(hard_time + 20000);
  }
  return valid == 20 - Order / 2 - (Order == 2 ? 0 : Order / 2 - 1);
}
static_assert(interpolates<double, long long, 4>(1e-14) && interpolates<double, long long, 2>(1e-14));
static_assert(interpolates<double, long long, 6>(1e-13) && interpolates<float, unsigned, 4>(3e-6f));

// A lost value leaves the others usable; a clock that goes back, or a long gap, starts anew.
bool survives_gaps() noexcept {
  Align<double, long long, 4> align;
  align.settings.max_gap = 100;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (long long i = 0; i < 6; ++i) {
    align.feed(20 * i, 20 * i + 10, 1.0, 5.0);
  }
  const bool lost_hard = align.feed(120, 130, nan, 5.0).hard == 1.0;  // the pair that it completes is an earlier one
  const bool lost_soft = !align.feed(140, 150, 1.0, nan).valid;
  const auto later = align.feed(160, 170, 1.0, 5.0);
  const bool back = !align.feed(20, 30, 1.0, 5.0).valid;
  return lost_hard && lost_soft && later.soft == 5.0 && back;
}

// A quarter of the first values may be anything: the level is theirs who remain.
constexpr bool baseline_is_robust() noexcept {
  Baseline<double> baseline;
  for (int i = 0; i < 32; ++i) {
    baseline.collect(i % 4 == 3 ? 1e3 + i : 5.0 + 0.01 * (i % 3 - 1));
  }
  const bool first = near(baseline.level(), 5.0, 1e-3) && baseline.noise() < 0.05;
  baseline.mark();
  for (int i = 0; i < 10; ++i) {
    baseline.follow(9.0);  // clipped: 3 noises at most, a share of each
  }
  const bool clipped = baseline.level() < 5.0 + 10 * 3 * 0.05 / 24;
  baseline.rewind();
  const bool rewound = near(baseline.level(), 5.0, 1e-3);
  for (int i = 0; i < 1000; ++i) {
    baseline.follow(5.001);
  }
  return first && clipped && rewound && near(baseline.level(), 5.001, 1e-5) && baseline.variance() > 0;
}
static_assert(baseline_is_robust());

// Contact after four large values, dated back to the first; a single spike is none; hysteresis at the end.
constexpr bool gate_opens_and_closes() noexcept {
  Contact<double> gate;
  bool spike = false;
  for (int i = 0; i < 20; ++i) {
    spike = spike || gate.update(i == 10 ? 1e6 : 0.5, 1.0);
  }
  int opened = 0;
  for (int i = 1; i <= 10 && opened == 0; ++i) {
    opened = gate.update(100.0, 1.0) ? i : 0;
  }
  const bool dated = gate.age() == opened;
  bool held = true;
  for (int i = 0; i < 50; ++i) {
    held = held && gate.update(i % 3 == 0 ? 40.0 : 100.0, 1.0);  // below half, but not three times in a row
  }
  const bool a = gate.update(40.0, 1.0), b = gate.update(40.0, 1.0), c = gate.update(40.0, 1.0);
  const bool released = a && b && !c && !gate.idle();
  for (int i = 0; i < 3; ++i) {
    gate.update(5.0, 1.0);
  }
  return !spike && opened == 4 && dated && held && released && gate.idle() && gate.age() == 0;
}
static_assert(gate_opens_and_closes());

// Changes without a baseline have no noise: nothing is no contact, and what is not nothing counts as the clip.
bool gate_without_noise() noexcept {
  Tracker<double, NoAlign<double, long long>, NoBaseline<double>, Contact<double>, FixedRls<double>> tracker;
  bool touched = false;
  for (int i = 0; i < 40; ++i) {
    touched = touched || tracker.feed(i, i, 0.0, 0.0).contact;
  }
  int opened = 0;
  for (int i = 1; i <= 10 && opened == 0; ++i) {
    opened = tracker.feed(40 + i, 40 + i, 0.5, 0.25).contact ? i : 0;
  }
  return !touched && opened == 4;
}

// The next touch, whose baseline could not be measured: found from the old one, by values in a row.
constexpr bool gate_opens_between() noexcept {
  Contact<double> gate;
  const bool before_any = gate.update_between(1e3, 1.0) || gate.update_between(1e3, 1.0);
  for (int i = 0; i < 10; ++i) {
    gate.update(100.0, 1.0);
  }
  for (int i = 0; i < 6; ++i) {
    gate.update(0.0, 1.0);
  }
  const bool idle = gate.idle();
  int opened = 0;
  for (int i = 1; i <= 10 && opened == 0; ++i) {
    opened = gate.update_between(i == 2 ? 10.0 : 30.0, 1.0) ? i : 0;
  }
  return !before_any && idle && opened == 6 && gate.age() == 4;
}
static_assert(gate_opens_between());

template <class Real>
constexpr bool roots() noexcept {
  const Real values[] = {Real(1e-30), Real(1e-3), Real(1), Real(2), Real(4), Real(1e5), Real(1e30)};
  for (const Real value : values) {
    const Real root = square_root(value);
    if (magnitude(root * root - value) > 4 * std::numeric_limits<Real>::epsilon() * value) {
      return false;
    }
  }
  return square_root(Real(0)) == 0 && square_root(Real(-1)) == 0 && square_root(Real(9)) == 3;
}
static_assert(roots<float>() && roots<double>());

// Two touches with a pause: the result of each, and its bookkeeping.
template <class Scene>
constexpr int touches(Scene scene, double tolerance) noexcept {
  using Real = typename Scene::real_type;
  using Ticks = typename Scene::ticks_type;
  constexpr Ticks period = ticks_per_second<Ticks> / 1000 * 26;
  int right = 0;
  for (int i = 0; i < 900; ++i) {
    const bool pressed = (i >= 60 && i < 400) || (i >= 500 && i < 850);
    const Real soft = (pressed ? Real(0.25) : Real(0)) + static_cast<Real>(i * 7 % 5 - 2) / 100000;
    const Real hard = (pressed ? Real(0.625) : Real(0)) + static_cast<Real>(i * 3 % 7 - 3) / 100000;
    const Ticks t = period * static_cast<Ticks>(i);
    const auto report = scene.feed(t, t + period / 2, hard + Real(0.5), soft - Real(0.25));
    if (report.finished) {
      const auto touch = scene.touch();
      const bool start = (touch.start >= 57 && touch.start <= 60) || (touch.start >= 497 && touch.start <= 500);
      right += start && (touch.samples == 250 || touch.samples == 251) &&
               near(static_cast<double>(touch.ratio), 2.5, tolerance);
    }
  }
  return right;
}
static_assert(touches(PaperTracker<double>(), 1e-3) == 2 && touches(HandheldTracker<double>(), 1e-3) == 2);
static_assert(touches(HandheldTracker<float, unsigned>(), 1e-3) == 2);
static_assert(SlidingTracker<double>().settings.samples == 0 && SlidingTracker<double>().gate.settings.release == 0.3);
static_assert(touches(embedded::HandheldTracker<float>(), 1e-3) == 2 &&
              touches(embedded::PaperTracker<float>(), 1e-3) == 2);

// A loop without contact: one touch without an end; a tare, a finish or `samples` end it, and the next begins at once.
constexpr bool fixed_goes_on() noexcept {
  FixedTracker<double> tracker;
  const auto feed = [&](int n) noexcept {
    int finished = 0;
    for (int i = 0; i < n; ++i) {
      finished += tracker.feed(i, i, 0.5, 0.25).finished;
    }
    return finished;
  };
  const bool endless = feed(1000) == 0 && tracker.open() && tracker.touch().samples == 1000;
  tracker.tare();
  const bool tared = feed(10) == 0 && tracker.open() && tracker.touch().samples == 10 && tracker.started() == 1000;
  const bool ended = tracker.finish() && !tracker.open() && feed(1) == 0 && tracker.touch().samples == 1;
  tracker.finish();
  tracker.settings.samples = 100;
  return endless && tared && ended && feed(1000) == 10;
}
static_assert(fixed_goes_on());

// A touch that has its samples, one that is released early, and values that are none in both.
bool gated_touches() noexcept {
  embedded::GatedRls<float> gated;
  int finished[2] = {}, samples[2] = {};
  for (int i = 0; i < 700; ++i) {
    const bool pressed = (i >= 20 && i < 400) || (i >= 500 && i < 600), second = i >= 450;
    const float soft = i % 50 == 49 ? std::numeric_limits<float>::quiet_NaN() : pressed ? 0.25f : 0.0f;
    const auto before = gated.wanted();
    const auto report = gated.feed(2.5f * soft, soft);
    samples[second] += before > gated.wanted() && report.contact;
    finished[second] += report.finished;
    if (report.finished && !near(static_cast<double>(report.ratio), 2.5, 1e-3)) {
      return false;
    }
  }
  return finished[0] == 1 && finished[1] == 1 && samples[0] == 249 && samples[1] > 80 && samples[1] < 100;
}

// Ticks may wrap, and be far apart, without undefined behaviour.
template <class Ticks>
constexpr bool wraps() noexcept {
  Align<double, Ticks, 4> align;
  auto time = static_cast<Ticks>(std::numeric_limits<Ticks>::max() - 50000);
  bool right = true;
  for (int i = 0; i < 12; ++i) {
    const auto pair = align.feed(time, static_cast<Ticks>(static_cast<std::uint32_t>(time) + 13000u), 1.0, 5.0);
    right = right && (i < 3 || (pair.valid && near(pair.soft, 5.0, 1e-14)));
    time = static_cast<Ticks>(static_cast<std::uint32_t>(time) + 26000u);
  }
  return right;
}
static_assert(wraps<std::uint32_t>() && wraps<std::int32_t>());

// Each scene starts from what its estimator needs.
static_assert(HandheldTracker<float>().settings.initial_covariance == 1e10f &&
              PaperTracker<float>().settings.initial_covariance == 1e12f);

// What a microcontroller has to hold.
static_assert(sizeof(FixedTracker<float, unsigned>) <= 160 && sizeof(HandheldTracker<float, unsigned>) <= 1024);

}  // namespace

int main() {
  return touches(HandheldTracker<double>(), 1e-3) == 2 && survives_gaps() && gate_without_noise() && gated_touches()
             ? 0
             : 1;
}
