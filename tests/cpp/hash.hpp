// SPDX-License-Identifier: MIT
#pragma once

// A hash of numbers by their bits (FNV-1a of 64 bits), the same for either byte order.

#include <cstdint>
#include <cstring>
#include <type_traits>

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
