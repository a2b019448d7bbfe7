// SPDX-License-Identifier: MIT
// A forgetting policy with a state: Fortescue, Kershenbaum and Ydstie, Automatica 17 (1981). With e the innovation,
//   lambda = 1 - (1 - x K) e^2 / Sigma0
// for the next sample, so that the weighted sum of the squared errors stays at Sigma0.

#include <cmath>
#include <cstdio>
#include <palpate/estimator/rls.hpp>

struct Fortescue {
  using real_type = double;
  double sigma0 = 1e-3, least = 0.2;  // pF^2; of lambda
  double lambda = 1;                  // for the next sample

  constexpr double discount(double information, double innovation, double regressor, bool) noexcept {
    const double before = lambda * information, rest = before / (before + regressor * regressor);  // 1 - x K
    const double next = 1 - rest * innovation * innovation / sigma0;
    lambda = next > least ? next : least;
    return before;
  }
  constexpr void reset() noexcept { lambda = 1; }
  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    visit(lambda);
  }
};

int main() {
  palpate::Rls<double, Fortescue> estimator;
  for (int k = 0; k < 400; ++k) {
    const double regressor = 0.25 + 0.05 * std::sin(0.1 * k), ratio = k < 200 ? 2.5 : 3.0;
    estimator.update(ratio * regressor, regressor);
    if (k == 199 || k == 200 || k == 220) {
      std::printf("sample %d: ratio %.2f, lambda %.2f\n", k, estimator.ratio(), estimator.forgetting().lambda);
    }
  }
}
