// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

/// A touch of 250 samples that any type and any place computes alike: integers scaled by powers of two.
template <class Real>
struct Samples {
  static constexpr int size = 250;
  Real output[size] = {};
  Real regressor[size] = {};

  constexpr explicit Samples(int ratio_in_eighths = 20) noexcept {
    std::uint32_t state = 12345;
    for (int i = 0; i < size; ++i) {
      state = state * 1664525u + 1013904223u;
      const auto noise = static_cast<std::int32_t>(state >> 20) - 2048;  // 12 bits
      const std::int32_t press = 400 + (i < 100 ? 4 * i : 400);
      const std::int32_t ratio = i < 180 ? ratio_in_eighths : ratio_in_eighths + 6;
      const std::int32_t eighth = noise / 8;
      regressor[i] = static_cast<Real>(press) / Real(2048);
      output[i] = static_cast<Real>(press * ratio * 16 + eighth) / Real(262144);
    }
  }
};
