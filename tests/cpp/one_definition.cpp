// SPDX-License-Identifier: MIT
#include <palpate/palpate.hpp>

double ratio_elsewhere();

int main() {
  palpate::AdaptiveRls<double> estimator;
  return estimator.update(0.5, 0.25).ratio == ratio_elsewhere() ? 0 : 1;
}
