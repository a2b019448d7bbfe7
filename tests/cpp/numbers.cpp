// SPDX-License-Identifier: MIT
// Each line of standard input as a double and back: its bits and its shortest text, or "none". tests/core/test_numbers.py
// compares both with Python's float() and repr().

#include <cinttypes>
#include <cstdio>
#include <iostream>
#include <string>

#include "../../cpp/rows/number.hpp"

int main() {
  for (std::string line; std::getline(std::cin, line);) {
    double value = 0;
    const char* at = line.data();
    const char* const end = at + line.size();
    if (!palpate::rows::parse_real(at, end, value) || at != end) {
      std::puts("none");
      continue;
    }
    char text[24];
    const std::string shortest(text, palpate::rows::format_real(text, value));
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    std::printf("%016" PRIx64 " %s\n", bits, shortest.c_str());
  }
}
