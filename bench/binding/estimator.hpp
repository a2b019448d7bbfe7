// SPDX-License-Identifier: MIT
#pragma once

// What each of the bindings exposes: one estimator, a sample at a time and a block at a time.

#include <cstddef>
#include <palpate/palpate.hpp>

namespace MODULE {  // a type of its own for each module: both bindings register types for the whole process

struct Estimator {
  palpate::AdaptiveRls<double> core;

  double update(double output, double regressor) {
    core.update(output, regressor);
    return core.ratio();
  }
  void process(const double* output, const double* regressor, double* ratio, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) {
      ratio[i] = update(output[i], regressor[i]);
    }
  }
  double ratio() const { return core.ratio(); }
};

}  // namespace MODULE

using MODULE::Estimator;
