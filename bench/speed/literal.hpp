// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

/// The equations of the paper as printed, with the alarm of its text.
struct Literal {
  using real_type = double;
  double r = 1, p = 1e12, g = 0;
  bool alarm = false;

  double update(double output, double regressor) {
    const double e = output - regressor * r;
    g = std::max(0.0, g + std::abs(e) - 0.01);
    alarm = g > (alarm ? 0.0 : 0.05);
    const double lambda = alarm ? 0.9 : 0.995;
    const double gain = p * regressor / (lambda + regressor * p * regressor);
    p = (p - p * regressor * regressor * p / (lambda + regressor * regressor * p)) / lambda;
    r += gain * e;
    return r;
  }
  double ratio() const { return r; }
};
