// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "results.hpp"

inline void put_hex(std::uint32_t value) {
  char text[9] = {};
  for (int i = 7; i >= 0; --i, value >>= 4) {
    text[i] = "0123456789abcdef"[value & 15];
  }
  put(text);
}

inline void put_number(std::uint32_t value) {
  char text[11] = {};
  int i = 10;
  do {
    text[--i] = static_cast<char>('0' + value % 10);
    value /= 10;
  } while (value > 0);
  put(text + i);
}
