// SPDX-License-Identifier: MIT
// The paper's literal form over a block, for the Python benches (by ctypes).

#include "literal.hpp"

extern "C" double literal_block(const double* hard, const double* soft, double* ratios, int size) {
  static Literal kept;
  Literal estimator = kept;
  for (int i = 0; i < size; ++i) {
    ratios[i] = estimator.update(hard[i], soft[i]);
  }
  kept = estimator;
  return estimator.ratio();
}
