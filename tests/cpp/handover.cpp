// SPDX-License-Identifier: MIT
// What Handover is made of, each by itself, at compile time: the instrument, the two-sided CUSUM, the noise model.

#include <palpate/estimator/handover.hpp>

namespace {

using namespace palpate;

constexpr bool near(double left, double right, double relative) noexcept {
  return magnitude(left - right) <= relative * magnitude(right);
}

// The mean of the first 1 / smoothing regressors; then a share of each.
constexpr bool instrument_is_the_mean() noexcept {
  Instrument<double> instrument;
  for (int n = 1; n <= 16; ++n) {
    instrument.add(n, n, 0.0625);
    if (!near(instrument.mean(), (n + 1) / 2.0, 1e-15)) {
      return false;
    }
  }
  instrument.add(24.5, 17, 0.0625);
  return near(instrument.mean(), 8.5 + 16 / 16.0, 1e-15);
}
static_assert(instrument_is_the_mean());

// The regressor itself stands in where the mean is of the other sign, or beyond a factor of 4: w x > 0 always.
constexpr bool instrument_gives_way() noexcept {
  Instrument<double> instrument;
  const bool first = instrument.weight(3.0) == 3.0;
  instrument.add(1.0, 1, 0.0625);
  const double close[] = {0.26, 1.0, 3.9}, far[] = {0.25, 4.0, -1.0, 0.0, 1e300};
  bool right = first;
  for (const double x : close) {
    right = right && instrument.weight(x) == 1.0;
  }
  for (const double x : far) {
    right = right && instrument.weight(x) == x;
  }
  return right;
}
static_assert(instrument_gives_way());

template <class Cusum>
constexpr SidesInTurn<double> sides_of(const Cusum& cusum) noexcept {
  if constexpr (std::is_same_v<Cusum, SidesInTurn<double>>) {
    return cusum;
  } else {
    return cusum.in_turn();
  }
}

// The sums are those since the side was last 0, without the first `guard` samples; the other side stays at 0.
template <class Cusum>
constexpr bool cusum_knows_when(int guard) noexcept {
  Cusum cusum;
  for (int i = 0; i < 5; ++i) {
    cusum.add(-0.5, 0.75, guard, {1.0, 7.0, 1.0});
  }
  const auto idle = sides_of(cusum);
  bool right = cusum.statistic() == 0 && idle.up.sums.count == 0 && idle.down.sums.information == 0;
  for (int i = 0; i < 4; ++i) {
    const double next = cusum.next_statistic(2.75, 0.75);
    cusum.add(2.75, 0.75, guard, {2.0, i < guard ? 99.0 : 10.0, 3.0});
    right = right && next == cusum.statistic();
  }
  const auto up = cusum.larger();
  const int n = guard < 4 ? 4 - guard : 0;
  return right && cusum.statistic() == 8 && sides_of(cusum).down.statistic == 0 && up.weighted_output == 20 * n &&
         up.sums.information == 6 * n && up.sums.squares == 4 * n && up.sums.count == n && up.age == 4;
}
constexpr bool cusums_know_when() noexcept {
  bool right = true;
  const int guards[] = {0, 2, 7};
  for (const int guard : guards) {
    right = right && cusum_knows_when<TwoSidedCusum<double>>(guard) && cusum_knows_when<SidesInTurn<double>>(guard);
  }
  return right;
}
static_assert(cusums_know_when());

// A hand-over leaves out the first `guard` samples since the CUSUM was 0, and takes the last one if none is left.
constexpr bool handover_keeps_its_guard(double guard) noexcept {
  HandoverSettings<double> settings;
  settings.guard = guard;
  Handover<double> estimator({settings});
  for (int i = 0; i < 40; ++i) {
    estimator.update(2.0 + (i % 2 ? 1e-3 : -1e-3), 1.0);
  }
  for (int i = 0; i < 20; ++i) {
    if (estimator.update(i < 2 ? 2.5 : 3.0, 1.0).alarm) {  // the first two are smeared
      const double n = i + 1 - guard, mean = guard < 2 ? 3.0 - 0.5 * (2 - guard) / n : 3.0;
      return estimator.count() == (n > 1 ? n : 1) && near(estimator.ratio(), mean, 1e-12);
    }
  }
  return false;
}
static_assert(handover_keeps_its_guard(0) && handover_keeps_its_guard(2) && handover_keeps_its_guard(60));

// Alternating innovations have the correlation -1, the least that is believed; what the forecast leaves is small.
constexpr bool noise_learns_a_correlation() noexcept {
  InnovationNoise<double> noise;
  for (int n = 1; n <= 400; ++n) {
    const double e = n % 2 ? 1.0 : -1.0;
    noise.add_magnitude(noise.whitened(e), n);
    noise.add(e, 1);
  }
  const double limit = 31.0 / 33.0;  // (1 + r) / (1 - r) = 32
  const bool forecast = near(noise.whitened(1.0), 1 - limit, 1e-12) && noise.scale() < 0.2;
  return forecast && noise.settled() && near(noise.long_run_variance(), 1.0 / 32, 1e-9);
}
static_assert(noise_learns_a_correlation());

// Equal innovations are the longest correlation that is believed, and an offset: the ratio drifts, from 16 of them on. An
// outlier then counts as one more.
constexpr bool noise_sees_an_offset() noexcept {
  InnovationNoise<double> noise;
  int first = 0;
  for (int n = 1; n <= 100; ++n) {
    noise.add(1.0, 1);
    first = first == 0 && noise.drifts() ? n : first;
  }
  const bool longest = near(noise.long_run_variance(), 32.0, 1e-9);
  const double share = noise.least_share();
  noise.skip(1.0);
  const bool follows = noise.drifts() && share == 0.9;
  noise.restart();
  return first == 17 && longest && follows && noise.whitened(1.0) == 1.0 && !noise.drifts();
}
static_assert(noise_sees_an_offset());

// Innovations of 4.9 and 3.1 in turn have the roughness 1.8 and the mean 4, 2.2 times as large: a share of about 0.2.
constexpr bool noise_has_an_allowance() noexcept {
  InnovationNoise<double> noise;
  bool drifts = false;
  for (int n = 1; n <= 400; ++n) {
    noise.add(n % 2 ? 4.9 : 3.1, 1);  // roughness 1.8, offset 4
  }
  drifts = noise.drifts();
  return drifts && noise.least_share() > 0.15 && noise.least_share() < 0.3;
}
static_assert(noise_has_an_allowance());

// An outlier is remembered as its forecast and what it counts as: the next forecast hardly moves.
constexpr bool noise_skips_an_outlier() noexcept {
  InnovationNoise<double> noise;
  for (int n = 1; n <= 100; ++n) {
    noise.add(n % 2 ? 1.0 : -1.0, 1);
  }
  noise.skip(0.25);  // the forecast of what follows -1 is 31 / 33
  return near(noise.whitened(0.0), 31.0 / 33.0 * (31.0 / 33.0 + 0.25), 1e-12);
}
static_assert(noise_skips_an_outlier());

}  // namespace

// The same again at run time, where a flipped operator is noticed.
int main() {
  return instrument_is_the_mean() && instrument_gives_way() && cusums_know_when() && handover_keeps_its_guard(2) &&
                 noise_learns_a_correlation() && noise_sees_an_offset() && noise_skips_an_outlier()
             ? 0
             : 1;
}
