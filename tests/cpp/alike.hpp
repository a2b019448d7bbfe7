// SPDX-License-Identifier: MIT
#pragma once

// Numbers that any type and any place computes alike, and a hash of numbers by their bits.

#include <cstdint>
#include <cstring>
#include <type_traits>

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

/// FNV-1a of 64 bits, the same for either byte order.
struct Hash {
  std::uint64_t value = 14695981039346656037u;

  /// The bytes from the lowest to the highest.
  template <class Real>
  void add(Real number) {
    std::conditional_t<sizeof(Real) == 8, std::uint64_t, std::uint32_t> bits = 0;
    static_assert(sizeof bits == sizeof number);
    std::memcpy(&bits, &number, sizeof bits);
    for (unsigned i = 0; i < sizeof bits; ++i) {
      value = (value ^ (bits >> 8 * i & 0xFF)) * 1099511628211u;
    }
  }
};
