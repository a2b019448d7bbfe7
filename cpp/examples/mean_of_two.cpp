// SPDX-License-Identifier: MIT
// An alignment stage for channels that are read in turn, evenly: a hard reading is half-way between two soft ones, so
// their mean is the soft channel at its time. Prints the ratio of a press with it and without an alignment.

#include <cmath>
#include <cstdio>
#include <limits>
#include <palpate/scenes.hpp>

struct MeanOfTwo {
  using time_type = palpate::Nanoseconds;
  double before = std::numeric_limits<double>::quiet_NaN();  // the last soft reading

  constexpr palpate::Pair<double> feed(time_type, time_type, double hard, double soft, bool) noexcept {
    const double mean = (before + soft) / 2;
    before = soft;
    return {hard, mean, palpate::is_finite(hard) && palpate::is_finite(mean)};
  }
  constexpr void reset() noexcept { before = std::numeric_limits<double>::quiet_NaN(); }
};

struct Aligned : palpate::Paper<double> {
  using align = MeanOfTwo;
};

template <class Scene>
double ratio_of_a_press() {
  palpate::Tracker<Scene> tracker;
  const auto press = [](double k) { return k < 60 ? 0.0 : 0.002 * (k - 60); };  // pF; it becomes deeper all the time
  for (int k = 0; k < 350; ++k) {
    const palpate::Nanoseconds time(26000000 * static_cast<std::int64_t>(k));
    tracker.feed(time, time.later(13000000), 2.5 * press(k), press(k + 0.5));
  }
  tracker.finish();
  return tracker.touch().ratio;
}

int main() {
  std::printf("ratio %.4f, without an alignment %.4f\n", ratio_of_a_press<Aligned>(),
              ratio_of_a_press<palpate::Paper<double>>());
}
