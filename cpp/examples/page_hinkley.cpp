// SPDX-License-Identifier: MIT
// A change detector with a state: the Page-Hinkley test of |e|. It survives a NaN, which the estimator refuses.

#include <cmath>
#include <cstdio>
#include <palpate/estimator/rls.hpp>

struct PageHinkley {
  using real_type = double;
  double tolerance = 0.002, threshold = 0.05;       // pF
  double count = 0, mean = 0, sum = 0, lowest = 0;  // of |e|; sum of |e| - mean - tolerance, and its lowest value

  constexpr double statistic() const noexcept { return sum - lowest; }
  constexpr bool alarm() const noexcept { return statistic() > threshold; }
  constexpr bool next(double innovation) noexcept {
    const double size = palpate::magnitude(innovation);
    count += 1;
    mean += (size - mean) / count;
    sum += size - mean - tolerance;
    lowest = sum < lowest ? sum : lowest;
    return alarm();
  }
  constexpr void reset() noexcept { count = mean = sum = lowest = 0; }
  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    visit(count), visit(mean), visit(sum), visit(lowest);
  }
};

int main() {
  palpate::Rls<double, palpate::SwitchedForgetting<double>, PageHinkley> estimator;
  int first = -1;
  for (int k = 0; k < 400; ++k) {
    const double regressor = 0.25 + 0.05 * std::sin(0.1 * k), ratio = k < 200 ? 2.5 : 3.0;
    estimator.update(k == 100 ? std::nan("") : ratio * regressor, regressor);
    first = first < 0 && estimator.alarm() ? k : first;
  }
  std::printf("alarm at sample %d, then ratio %.2f, mean |e| %.3f pF\n", first, estimator.ratio(),
              estimator.detector().mean);
}
