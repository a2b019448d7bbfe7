// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

/// The equations of the paper as printed.
struct Literal {
  double r = 1, p = 1e4, g = 0;

  double update(double output, double regressor) {
    const double e = output - regressor * r;
    g = std::max(0.0, g + std::abs(e) - 0.01);
    const double lambda = g > 0.05 ? 0.9 : 0.995;
    const double gain = p * regressor / (lambda + regressor * p * regressor);
    p = (p - p * regressor * regressor * p / (lambda + regressor * regressor * p)) / lambda;
    r += gain * e;
    return r;
  }
  double ratio() const { return r; }
};
