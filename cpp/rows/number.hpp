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

/// The double nearest to a number without a sign, that is all of [begin, end); false where the double is 0 or infinite.
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

/// The exponent after the letter at `at`, which moves behind it; 0, and `at` stays, where no digit follows. It ends at 9999.
inline int take_exponent(const char*& at, const char* end) noexcept {
  const char* next = at + 1;
  const bool negative = next != end && *next == '-';
  next += next != end && (*next == '-' || *next == '+');
  if (next == end || !is_digit(*next)) {
    return 0;
  }
  int exponent = 0;
  for (; next != end && is_digit(*next); ++next) {
    exponent = exponent < 1000 ? exponent * 10 + (*next - '0') : 9999;
  }
  at = next;
  return negative ? -exponent : exponent;
}

/// digits * 10^exponent where both are doubles, so that one rounding is all (Clinger, PLDI 1990); else false.
inline bool exact_quotient(std::uint64_t digits, int exponent, double& value) noexcept {
  constexpr double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                               1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
  if (digits == 0) {
    value = 0;
    return true;
  }
  if (FLT_EVAL_METHOD != 0 || digits > (std::uint64_t{1} << 53) || exponent < -22 || exponent > 22) {
    return false;
  }
  const auto number = static_cast<double>(digits);
  value = exponent < 0 ? number / powers[-exponent] : number * powers[exponent];
  return true;
}

/// What a number without its sign is made of: digits * 10^exponent; `count` digits were read, leading zeros too.
struct Decimal {
  const char* end;
  std::uint64_t digits;
  int exponent;
  std::ptrdiff_t count;
};

/// The decimal number at `at`; count 0: there is none.
inline Decimal take_decimal(const char* at, const char* end) noexcept {
  Run run = append_digits({at, 0}, end);
  auto count = run.at - at;
  int exponent = 0;
  if (run.at != end && *run.at == '.') {
    const char* const fraction = run.at + 1;
    run = append_digits({fraction, run.number}, end);
    count += run.at - fraction;
    exponent = static_cast<int>(fraction - run.at);
  }
  if (count != 0 && run.at != end && (*run.at == 'e' || *run.at == 'E')) {
    exponent += take_exponent(run.at, end);
  }
  return {run.at, run.number, exponent, count};
}

/// Read a plain decimal number, [+-]d.d[e[+-]d] with a digit before or after the point, and move `at` behind it. False,
/// with `at` as it was: no such number is there, or the nearest double is infinite, or 0 though a digit is not.
/// Blanks, underscores, nan, inf and hexadecimal numbers are none.
inline bool parse_real(const char*& at, const char* end, double& value) noexcept {
  const char* next = at;
  const bool negative = next != end && *next == '-';
  next += next != end && (*next == '-' || *next == '+');
  const Decimal number = take_decimal(next, end);
  const bool all_kept = number.count <= 19;  // 10^19 < 2^64
  const bool found = number.count != 0 && ((all_kept && exact_quotient(number.digits, number.exponent, value)) ||
                                           nearest(next, number.end, value));
  if (found) {
    value = negative ? -value : value;
    at = number.end;
  }
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
