// SPDX-License-Identifier: MIT
#pragma once

// Decimal numbers in text, as Python's float() reads them and repr() writes them: the nearest double, and the shortest
// text that gives it back. Nothing here throws, allocates, reads the locale, or looks at or past `end`.

#include <algorithm>
#include <cfloat>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace palpate::rows {

// Some standard libraries have no floating-point std::from_chars: there PALPATE_EXACT_ELSEWHERE is defined, and whoever
// includes this has to define both functions.
#if !defined(__cpp_lib_to_chars) || __cpp_lib_to_chars < 201611L
#define PALPATE_EXACT_ELSEWHERE
#endif

/// The double nearest to a number without a sign, that is all of [begin, end); false where it is none, or infinite.
bool nearest(const char* begin, const char* end, double& value) noexcept;

/// Write a finite number without a sign as repr does, at most 23 characters; their end.
char* format_finite(char* to, double value) noexcept;

inline bool is_digit(char c) noexcept { return static_cast<unsigned char>(c - '0') < 10; }

/// The number of eight digits, bytes from 0 to 9: pairs, then fours, then both.
inline std::uint64_t number_of_digits(std::uint64_t digits) noexcept {
  digits = (digits * 10 + (digits >> 8)) & 0x00FF00FF00FF00FF;
  digits = (digits * 100 + (digits >> 16)) & 0x0000FFFF0000FFFF;
  return (digits * 10000 + (digits >> 32)) & 0xFFFFFFFF;
}

/// A place in text, and the number that the digits before it make; more than 19 of them wrap around.
struct Run {
  const char* at;
  std::uint64_t number;
};

/// Append the digits that come next.
inline Run append_digits(Run run, const char* end) noexcept {
  for (; run.at != end && is_digit(*run.at); ++run.at) {
    run.number = run.number * 10 + static_cast<std::uint64_t>(*run.at - '0');
  }
  return run;
}

/// Read a plain decimal number, all of [begin, end): [-]d.d[e[+-]d] with a digit before or after the point. False: it is
/// something else, or the nearest double is infinite, or 0 though a digit is not.
inline bool parse_real(const char* begin, const char* end, double& value) noexcept {
  const bool negative = begin != end && *begin == '-';
  begin += negative;
  // Not nan, inf, a second sign, or hexadecimal.
  const auto may_follow = [](char c) {
    return is_digit(c) || c == '.' || c == 'e' || c == 'E' || c == '-' || c == '+';
  };
  const bool plain = begin != end && (is_digit(*begin) || *begin == '.') && std::all_of(begin, end, may_follow);
  const bool found = plain && nearest(begin, end, value);
  value = negative ? -value : value;
  return found;
}

inline char* append(char* to, const char* from, int count) noexcept {
  std::memcpy(to, from, static_cast<std::size_t>(count));
  return to + count;
}

/// Write a number below 10^8 with eight digits.
inline void format_eight(char* to, std::uint64_t number) noexcept {
  for (int place = 7; place >= 0; --place, number /= 10) {
    to[place] = static_cast<char>('0' + number % 10);
  }
}

#ifndef PALPATE_EXACT_ELSEWHERE
inline bool nearest(const char* begin, const char* end, double& value) noexcept {
  const auto found = std::from_chars(begin, end, value);
  return found.ec == std::errc() && found.ptr == end;
}

inline char* format_finite(char* to, double value) noexcept {
  if (value != 0 && (value < 1e-4 || value >= 1e16)) {
    return std::to_chars(to, to + 24, value, std::chars_format::scientific).ptr;
  }
  char* const end = std::to_chars(to, to + 24, value, std::chars_format::fixed).ptr;
  return std::find(to, end, '.') == end ? append(end, ".0", 2) : end;
}
#endif

/// Write a number as Python's repr does, at most 24 characters: nan, -inf, 0.25, 1e+16. Returns the end.
inline char* format_real(char* to, double value) noexcept {
  if (value != value) {
    return append(to, "nan", 3);
  }
  if (std::signbit(value)) {
    *to++ = '-';
    value = -value;
  }
  if (value > DBL_MAX) {
    return append(to, "inf", 3);
  }
  return format_finite(to, value);
}

}  // namespace palpate::rows
