// SPDX-License-Identifier: MIT
// Each line of standard input as a double and back: its bits and its shortest text, or "none". tests/core/test_numbers.py
// compares both with Python's float() and repr(). Built again with the two functions that some standard libraries lack.

#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <string>

#include "../../cpp/rows/number.hpp"

#ifdef PALPATE_EXACT_ELSEWHERE
namespace palpate::rows {

bool nearest(const char* begin, const char* end, double& value) noexcept {
  value = std::strtod(std::string(begin, end).c_str(), nullptr);
  return value <= DBL_MAX && value > 0;
}

char* format_finite(char* to, double value) noexcept {
  char text[40];
  for (int digits = 0; digits < 17 && (digits == 0 || std::strtod(text, nullptr) != value); ++digits) {
    std::snprintf(text, sizeof text, "%.*e", digits, value);
  }
  char figures[24];
  int count = 0;
  const char* at = text;
  for (; *at != 'e'; ++at) {
    if (*at != '.') {
      figures[count++] = *at;
    }
  }
  return lay_out(to, figures, count, std::atoi(at + 1));
}

}  // namespace palpate::rows
#endif

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
