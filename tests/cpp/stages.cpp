// SPDX-License-Identifier: MIT
// Estimators, stages and scenes at compile time, where undefined behaviour is an error. What they compute is compared with the reference:
// tests/core.

#include <limits>
#include <palpate/elasticity.hpp>
#include <palpate/palpate.hpp>

#include "alike.hpp"

namespace {

using namespace palpate;

constexpr bool near(double left, double right, double relative) noexcept {
  return magnitude(left - right) <= relative * magnitude(right);
}

// A touch of 250 samples through the paper's estimator.
template <class Real>
constexpr AdaptiveRls<Real> touch() noexcept {
  constexpr Samples<Real> samples;
  AdaptiveRls<Real> estimator;
  for (int i = 0; i < samples.size; ++i) {
    estimator.update(samples.output[i], samples.regressor[i]);
  }
  return estimator;
}

constexpr auto in_double = touch<double>();
static_assert(near(in_double.ratio(), 3.25, 3e-3) && near(static_cast<double>(touch<float>().ratio()), 3.25, 3e-3));

// A cubic is interpolated exactly by four points, whatever the times; up to rounding.
template <class Real, class Time>
constexpr bool interpolates(Real tolerance) noexcept {
  Align<Real, Time> align;
  const auto cubic = [](Real t) { return 2 + 3 * t - t * t + t * t * t / 4; };
  int valid = 0;
  Time hard_time(1000);
  for (int i = 0; i < 20; ++i) {
    const Time soft_time = hard_time.later(9000 + 700 * (i % 3));
    const Real value = cubic(static_cast<Real>(soft_time.count) / 100000);
    const auto pair = align.feed(hard_time, soft_time, static_cast<Real>(hard_time.count) / 100000, value);
    if (pair.valid) {
      const Real expected = cubic(pair.hard);
      valid += magnitude(pair.soft - expected) <= tolerance * magnitude(expected);
    }
    hard_time = hard_time.later(20000);
  }
  return valid == 17;
}
static_assert(interpolates<double, Nanoseconds>(1e-14) && interpolates<float, Microseconds>(3e-6f));

// A touch from the first reading on, with a baseline that is given and channels that fall when pressed.
template <class Real>
constexpr bool begins_in_contact() noexcept {
  HandheldTracker<Real, Microseconds> probe;
  probe.settings.falling = true;
  probe.hard_baseline.give(-Real(6.5), Real(4e-5));
  probe.soft_baseline.give(-Real(4.5), Real(4e-5));
  Microseconds time(1000);
  bool ended = false;
  for (int i = 0; i < 300 && !ended; ++i) {
    const Real soft = Real(0.2) + Real(1e-3) * static_cast<Real>(i % 4 - 1);
    ended = probe.feed(time, time, Real(6.5) - Real(2.5) * soft, Real(4.5) - soft).finished;
    time = time.later(26000);
  }
  const auto touch = probe.touch();
  return ended && touch.start == 0 && near(static_cast<double>(touch.ratio), 2.5, 1e-4) &&
         probe.soft_baseline.level() == -Real(4.5) && probe.soft_baseline.variance() == 0;
}
static_assert(begins_in_contact<double>() && begins_in_contact<float>());

// Two touches with a pause: the result of each, and its bookkeeping. In the middle the ticks of 32 bits wrap.
template <class Scene>
constexpr int touches(Scene scene, double tolerance) noexcept {
  using Real = typename Scene::real_type;
  using Time = typename Scene::time_type;
  constexpr auto period = Time::second / 1000 * 26;
  int right = 0;
  for (unsigned i = 0; i < 840; ++i) {  // clang evaluates 2^20 steps at most
    const bool pressed = (i >= 60 && i < 400) || i >= 500;
    const Real soft = (pressed ? Real(0.25) : Real(0)) + static_cast<Real>(static_cast<int>(i * 7 % 5) - 2) / 100000;
    const Real hard = (pressed ? Real(0.625) : Real(0)) + static_cast<Real>(static_cast<int>(i * 3 % 7) - 3) / 100000;
    const auto passed = static_cast<typename Time::Signed>(i) * period - 450 * period;
    const Time t = Time(std::numeric_limits<decltype(Time::count)>::max()).later(passed);
    const auto report = scene.feed(t, t.later(period / 2), hard + Real(0.5), soft - Real(0.25));
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
static_assert(touches(HandheldTracker<float, Microseconds>(), 1e-3) == 2);
static_assert(touches(HandheldTracker<float, Milliseconds>(), 1e-3) == 2);
static_assert(touches(HandheldTracker<float, Ticks<std::uint32_t, 84000000>>(), 1e-3) == 2);
static_assert(touches(embedded::HandheldTracker<float>(), 1e-3) == 2 &&
              touches(embedded::PaperTracker<float>(), 1e-3) == 2);

// An offset of a quarter is seen in float, too, where the depth of the press varies by a thousandth.
template <class Real>
constexpr bool sees_an_offset() noexcept {
  int seen = 0;
  for (std::uint32_t touch = 0; touch < 10; ++touch) {
    ModelTest<Real> fit;
    std::uint32_t state = touch;
    for (std::uint32_t i = 0; i < 250; ++i) {
      state = state * 1664525u + 1013904223u;
      const Real x = 1 + static_cast<Real>(static_cast<std::int32_t>(state >> 19) - 4096) / Real(4194304);
      fit.add(3 * x + Real(0.25), x, i);
    }
    const auto found = fit.result(Real(1e-6), Real(1e-6), Real(3.25));
    seen += found.flags == misfit_offset && near(static_cast<double>(found.offset), -0.25 / 3, 0.01);
  }
  return seen == 10;
}
static_assert(sees_an_offset<double>() && sees_an_offset<float>());

// A line through eight samples of y = 2 x + 1 predicts any other one, with a standard error near 0; seven values of one x
// are a mean, and no line. A prediction needs as many samples as a standard error. (At run time: it needs an infinity.)
template <class Real>
bool predicts(bool is_line) noexcept {
  Kept<VectorSettings<Real>> without_forgetting;
  without_forgetting.settings.steady = 1;
  VectorRls<Real, 1, true> line(without_forgetting);
  bool known_too_early = false;
  for (int i = 0; i < 8; ++i) {
    const auto x = static_cast<Real>(is_line ? i : 3);
    line.update(2 * x + 1, {x});
    const auto early = line.predict({Real(3)});
    known_too_early = known_too_early || (i < 5 && early.standard_error == early.standard_error);
  }
  const auto inside = line.predict({Real(3)}), outside = line.predict({Real(5)});
  const bool known_outside = outside.standard_error < Real(1e-3);
  return !known_too_early && near(static_cast<double>(inside.value), 7, 1e-5) && inside.standard_error < Real(1e-3) &&
         known_outside == is_line && (!is_line || near(static_cast<double>(outside.value), 11, 1e-5));
}

// What has no modulus has a reason, and the last number below the rigid ratio still has one.
template <class Real>
constexpr bool no_answer() noexcept {
  constexpr Elasticity<Real> probe;
  constexpr Real nan = std::numeric_limits<Real>::quiet_NaN(), all[] = {nan, Real(0.99), 10, 1, Real(9.99)};
  constexpr Reach reasons[] = {Reach::unknown, Reach::too_soft, Reach::too_stiff, Reach::within, Reach::within};
  bool right = probe.modulus(1) == 0 && probe.modulus(Real(5.5)) == 2 && probe.ratio(-1) != probe.ratio(-1);
  for (int i = 0; i < 5; ++i) {
    const Real modulus = probe.modulus(all[i]);
    right = right && probe.reach(all[i]) == reasons[i] && (modulus == modulus) == (i > 2);
  }
  return right;
}
static_assert(no_answer<float>() && no_answer<double>());

// (2) as printed: k_h = 800, k_s = 100 and k_o = 400 N/m; r = k_h (k_o + k_s) / (k_s (k_o + k_h)).
constexpr Elasticity<double> springs{800.0 / 100, 800};
constexpr double shown = 800.0 * (400 + 100) / (100.0 * (400 + 800));
static_assert(magnitude(springs.modulus(shown) - 400) < 1e-12 * 400 && magnitude(springs.ratio(400) - shown) < 1e-15);

// A policy with a state: a refused sample leaves it as it was, and reset() begins it again.
struct Growing {
  using real_type = double;
  double taken = 0;
  constexpr double discount(double information, double, double, bool) noexcept {
    taken += 1;
    return information;
  }
  constexpr void reset() noexcept { taken = 0; }
  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    visit(taken);
  }
};
bool keeps_its_state() noexcept {
  Rls<double, Growing, Cusum<double>> estimator;
  estimator.update(3.0, 1.0);
  estimator.update(std::numeric_limits<double>::quiet_NaN(), 1.0);
  const bool taken = estimator.alarm() && estimator.statistic() > 0 && estimator.forgetting().taken == 1;
  int numbers = 0;
  estimator.visit_state([&](double&) { ++numbers; });
  estimator.reset();
  return taken && numbers == 4 && !estimator.alarm() && estimator.forgetting().taken == 0;
}

// What is derived from an estimator with a standard error has one.
struct Derived : Handover<double> {};
static_assert(knows_its_error<Derived> && !knows_its_error<AdaptiveRls<double>>);

// Null policies cost nothing, and the real ones their parameters.
static_assert(sizeof(Rls<float>) == 2 * sizeof(float) && sizeof(Rls<double>) == 2 * sizeof(double));
static_assert(sizeof(Rls<float, FixedForgetting<float>>) == 3 * sizeof(float));
static_assert(sizeof(FixedRls<float>) == 4 * sizeof(float));
static_assert(sizeof(AdaptiveRls<float>) == 9 * sizeof(float));
static_assert(sizeof(embedded::AdaptiveRls<float>) == 3 * sizeof(float));

static_assert(noexcept(AdaptiveRls<double>().update(0.0, 0.0)) && noexcept(AdaptiveRls<double>().reset()));

// Without settings, as a variable, an array, or a member of a struct.
struct Estimators {
  AdaptiveRls<float> paper;
  Handover<double> handover;
  AdaptiveWindow<double> window;
  VectorRls<float, 2, true> plane;
};
constexpr AdaptiveRls<float> alone = {};
constexpr AdaptiveRls<float> several[2] = {};
constexpr Estimators every = {};
constexpr Estimators in_array[2] = {{}, {}};
constexpr float after_a_change() noexcept {
  embedded::AdaptiveWindow<float> estimator;
  constexpr float noise[] = {0.01f, -0.02f, 0.015f, 0.003f, -0.01f};
  for (int i = 0; i < 60; ++i) {
    estimator.update((i < 40 ? 2.0f : 3.0f) + noise[i % 5], 1.0f);
  }
  return estimator.ratio();
}
static_assert(after_a_change() > 2.98f && after_a_change() < 3.02f);
static_assert(sizeof(embedded::AdaptiveWindow<float, 4>) < sizeof(embedded::AdaptiveWindow<float>) &&
              noexcept(AdaptiveWindow<double>().update(0.0, 0.0)));
constexpr Handover<float> with_settings({HandoverSettings<float>()}, 2.5f);
static_assert(alone.ratio() == 1 && several[1].ratio() == 1 && every.handover.ratio() == 1 &&
              every.window.ratio() == 1 && in_array[1].plane.coefficients()[2] == 0 && with_settings.ratio() == 2.5f);

// A fast converter, in ticks of 0.5 ms: the readings of a mean that is not complete are forgotten by tare().
bool forgets_a_mean() noexcept {
  HandheldTracker<float> probe;
  Nanoseconds time(0);
  const auto read = [&probe, &time](int readings, float value) {
    for (int i = 0; i < readings; ++i, time = time.later(500000)) {
      probe.feed(time, time.later(100000), value + static_cast<float>(i % 5) * 1e-6f, value);
    }
  };
  read(2030, 0.5f);
  probe.tare();
  read(2500, 0.75f);
  return probe.ready() && near(static_cast<double>(probe.hard_baseline.level()), 0.75, 1e-4) &&
         probe.soft_baseline.noise() < 2e-6f;
}

// Two readings of a mean whose difference is beyond the range of float.
bool survives_huge_readings() noexcept {
  constexpr float huge = std::numeric_limits<float>::max();
  HandheldTracker<float> probe;
  for (int i = 0; i < 4000; ++i) {
    const Nanoseconds time(std::int64_t{i} * 500000);
    const float noise = static_cast<float>(i * i % 1009) * 1e-7f;
    const float value = i == 207 ? huge : i == 208 ? -huge : 0.5f + noise;
    probe.feed(time, time.later(100000), value, value);
  }
  return probe.ready() && near(static_cast<double>(probe.hard_baseline.level()), 0.5, 1e-3);
}

// Regressors of extreme scales: what would leave infinity in the state is refused, and the state stays as it was.
bool refuses_extreme_scales() noexcept {
  VectorRls<float, 2> estimator;
  std::uint32_t state = 1, refused = 0;
  const auto scaled = [&state] {
    state = state * 1664525u + 1013904223u;
    float value = static_cast<float>(state >> 8) / 16777216 - 0.5f;
    for (std::uint32_t power = state % 16; power > 0; --power) {
      value *= state & 4096 ? 10.0f : 0.1f;
    }
    return value;
  };
  for (int i = 0; i < 200000; ++i) {
    if (i % 50 == 0) {
      estimator.reset();
    }
    const float regressors[] = {scaled(), scaled()};
    refused += !estimator.update(scaled(), regressors).accepted;
    bool finite = true;
    estimator.visit_state([&finite](float& value) { finite = finite && is_finite(value); });
    if (!finite) {
      return false;
    }
  }
  return refused > 0 && refused < 20000;
}

// A scene without a gate: a touch that reaches its length in seconds is followed by the next one, of the same length.
struct Endless : Handheld<float, Microseconds> {
  using contact = AlwaysContact<float>;
};
bool follows_at_once() noexcept {
  Tracker<Endless> probe;
  std::size_t ended = 0;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const Microseconds time(i * 26000);
    const float soft = 0.5f + static_cast<float>(i * i % 1009) * 1e-6f;
    if (probe.feed(time, time.later(13000), 2.5f * soft, soft).finished) {
      ended += 1;
      if (probe.touch().samples < 245) {
        return false;
      }
    }
  }
  return ended >= 3;
}

// A VectorRls of two coefficients that remembers those before the last sample.
template <int Window>
struct Plane {
  using Estimator = VectorRls<double, 2, false, Kept<VectorSettings<double>>, Window>;
  Estimator estimator;
  double before[2] = {};  // the coefficients before the last sample

  bool update(double output, const double (&regressors)[2]) noexcept {
    before[0] = estimator.coefficients()[0];
    before[1] = estimator.coefficients()[1];
    return estimator.update(output, regressors).alarm;
  }
  bool equals(const double* coefficients) const noexcept {
    return estimator.coefficients()[0] == coefficients[0] && estimator.coefficients()[1] == coefficients[1];
  }
};

// A hand-over is least squares over the last count() samples. A shorter window chooses as the
// longest does where that one needs no more samples, and never takes more than it has.
template <int Window>
bool hands_over_in(int& within, int& beyond) noexcept {
  constexpr double eps = 16 * std::numeric_limits<double>::epsilon();
  std::uint32_t state = 1;
  const auto noise = [&state] {
    state = state * 1664525u + 1013904223u;
    return static_cast<double>(state >> 8) / 16777216 - 0.5;
  };
  for (int run = 0; run < 400; ++run) {
    Plane<Window> shorter;
    Plane<32> longest;
    double outputs[200] = {}, regressors[200][2] = {};
    const double jump = 0.3 + run % 20 * 0.1;
    for (int k = 0; k < 200; ++k) {
      regressors[k][0] = noise();
      regressors[k][1] = noise();
      outputs[k] = (k < 60 ? 0.0 : jump) * regressors[k][0] + regressors[k][1] + 0.1 * noise();
      const bool alarm = shorter.update(outputs[k], regressors[k]);
      if (alarm != longest.update(outputs[k], regressors[k])) {
        return false;
      }
      if (!alarm) {
        continue;
      }
      const int count = static_cast<int>(shorter.estimator.count());
      LeastSquares<double, 2> right(2 * defaults<VectorSettings<double>>.min_information, shorter.before);
      for (int m = 0; m < count; ++m) {
        right.add(1.0, 1 / (16 * eps * eps), {{regressors[k - m][0], regressors[k - m][1]}, outputs[k - m], 1.0});
      }
      const bool same = longest.estimator.count() <= Window;
      ++(same ? within : beyond);
      if (count > Window || !shorter.equals(right.coefficients) ||
          (same && !shorter.equals(longest.estimator.coefficients()))) {
        return false;
      }
      break;  // from here on they have other samples
    }
  }
  return true;
}

bool windows_hand_over() noexcept {
  int within = 0, beyond = 0;
  return hands_over_in<3>(within, beyond) && hands_over_in<8>(within, beyond) && hands_over_in<16>(within, beyond) &&
         hands_over_in<32>(within, beyond) && within > 400 && beyond > 400;
}
static_assert(sizeof(VectorRls<float, 2>) - sizeof(VectorRls<float, 2, false, Kept<VectorSettings<float>>, 8>) ==
              24 * sizeof(Observation<float, 2>));

// What a Cortex-M needs of a state: no constructor to run, a plain copy, and not much memory.
static_assert(std::is_trivially_copyable_v<AdaptiveRls<float>> && std::is_trivially_destructible_v<AdaptiveRls<float>>);
static_assert(sizeof(FixedTracker<float, Microseconds>) <= 160 && sizeof(HandheldTracker<float, Microseconds>) <= 3100);

}  // namespace

int main() {
  const auto again = touch<double>();
  const bool same = again.ratio() == in_double.ratio() && again.statistic() == in_double.statistic();
  const bool robust = refuses_extreme_scales() && forgets_a_mean() && survives_huge_readings() && follows_at_once() &&
                      windows_hand_over() && predicts<double>(true) && predicts<float>(true) &&
                      predicts<double>(false) && predicts<float>(false);
  return same && touches(HandheldTracker<double>(), 1e-3) == 2 && keeps_its_state() && robust ? 0 : 1;
}
