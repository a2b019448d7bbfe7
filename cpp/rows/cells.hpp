// SPDX-License-Identifier: MIT
#pragma once

// The cells of rows that palpate writes, read between the commas around them, so that no cell waits for the one before it.
// 16 characters behind a cell are read, whatever they are.

#include <limits>

#include "number.hpp"

namespace palpate::rows {

constexpr std::uint64_t each_byte = ~std::uint64_t{0} / 255;

/// Eight characters, the first one in the lowest byte.
inline std::uint64_t word(const char* at) noexcept {
  std::uint64_t found = 0;
#if defined(_WIN32) || (defined(__BYTE_ORDER__) && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__)
  std::memcpy(&found, at, sizeof found);
#else
  for (int i = 7; i >= 0; --i) {
    found = found << 8 | static_cast<unsigned char>(at[i]);
  }
#endif
  return found;
}

/// A bit for each of 64 characters that is a comma, or one with its highest bit set.
inline std::uint64_t commas(const char* at) noexcept {
  std::uint64_t found = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    const std::uint64_t others = ((word(at + 8 * i) ^ each_byte * ',') & each_byte * 0x7F) + each_byte * 0x7F;
    found |= ((~others & each_byte * 0x80) >> 7) * 0x0102040810204080 >> 56 << (8 * i);
  }
  return found;
}

/// Position of the lowest bit of a number that is not 0.
inline int lowest_bit(std::uint64_t bits) noexcept {
#ifdef __GNUC__
  return __builtin_ctzll(bits);
#else
  int found = 0;
  for (; (bits & 1) == 0; bits >>= 1) {
    ++found;
  }
  return found;
#endif
}

/// Write where the commas of a text are, from its begin, to `places`; their end. 64 characters behind it are read.
inline std::uint16_t* find_commas(const char* begin, const char* end, std::uint16_t* places) noexcept {
  for (const char* at = begin; at < end; at += 64) {
    for (std::uint64_t bits = commas(at); bits != 0; bits &= bits - 1) {
      *places++ = static_cast<std::uint16_t>(at - begin + lowest_bit(bits));
    }
  }
  return places;
}

struct Cell {
  const char* begin;
  const char* end;

  std::size_t size() const noexcept { return static_cast<std::size_t>(end - begin); }
};

/// Reads cells. What is not plain is remembered: what was read then means nothing.
class Cells {
 public:
  bool plain() const noexcept { return wrong_ == 0; }

  void require(bool holds) noexcept { wrong_ |= holds ? 0 : 1; }

  /// One digit; more than 9 where it is none.
  static std::uint8_t digit(const char* at) noexcept { return static_cast<std::uint8_t>(*at - '0'); }

  /// An integer from 0, with at most 18 digits.
  std::uint64_t whole(Cell cell) noexcept {
    if (cell.size() - 1 < 8) {
      wrong_ |= others(few(cell));
      return number_of_digits(few(cell));
    }
    const Run run = append_digits({cell.begin, 0}, cell.end);
    require(run.at == cell.end && cell.size() - 1 < 18);
    return run.number;
  }

  /// An integer from -1 to 2^31 - 1.
  std::int32_t code(Cell cell) noexcept {
    if (*cell.begin == '-') {
      require(cell.size() == 2 && cell.begin[1] == '1');
      return -1;
    }
    const std::uint64_t number = whole(cell);
    require(number <= std::numeric_limits<std::int32_t>::max());
    return static_cast<std::int32_t>(number);
  }

  /// A time in s with at most 9 decimals, as ns.
  std::int64_t nanoseconds(Cell cell) noexcept {
    const bool negative = skip_minus(cell);
    const bool nine = cell.size() > 10 && cell.end[-10] == '.';
    const std::uint64_t number = nine ? with_nine_decimals(cell) : with_decimals(cell);
    require(number <= static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()));
    return static_cast<std::int64_t>(negative ? 0 - number : number);
  }

  /// A number, nan, or nothing, which is nan, too.
  double real(Cell cell) noexcept {
    double value = std::numeric_limits<double>::quiet_NaN();
    if (!is_nan(cell) && !is_usual(cell, value)) {
      require(parse_real(cell.begin, cell.end, value));
    }
    return value;
  }

  /// The same, where its value does not matter.
  void skip_real(Cell cell) noexcept {
    Cell digits = cell;
    skip_minus(digits);
    if (!has_usual_digits(digits)) {
      real(cell);
    }
  }

 private:
  static bool skip_minus(Cell& cell) noexcept {
    const bool negative = *cell.begin == '-';
    cell.begin += negative;
    return negative;
  }

  /// Not 0 where one of eight bytes is above 9.
  static std::uint64_t others(std::uint64_t digits) noexcept { return above(digits, each_byte * (0x80 - 10)); }

  /// Not 0 where a byte, or one with what is added to it, is above 0x7F.
  static std::uint64_t above(std::uint64_t bytes, std::uint64_t added) noexcept {
    return (bytes | (bytes + added)) & each_byte * 0x80;
  }

  static std::uint64_t eight(const char* at) noexcept { return word(at) ^ each_byte * '0'; }

  /// The digits of a cell with 1 to 8 characters, zeros before them.
  static std::uint64_t few(Cell cell) noexcept { return eight(cell.begin) << (64 - 8 * cell.size()); }

  /// Whether it is d.ddd with 8 to 22 decimals.
  static bool has_usual_digits(Cell cell) noexcept {
    if (cell.size() < 10 || cell.size() > 24) {
      return false;
    }
    // the byte of the point is 0
    const std::uint64_t first = eight(cell.begin) ^ ('0' ^ '.') << 8;
    const std::uint64_t middle = cell.size() > 16 ? others(eight(cell.begin + 8)) : 0;
    return (above(first, each_byte * (0x80 - 10) + (9 << 8)) | middle | others(eight(cell.end - 8))) == 0;
  }

  /// [-]d.ddd with 9 to 16 decimals: digits over a power of ten, rounded once where both are doubles (Clinger, PLDI 1990).
  static bool is_usual(Cell cell, double& value) noexcept {
    constexpr std::uint64_t powers[] = {1, 10, 100, 1000, 10'000, 100'000, 1'000'000, 10'000'000, 100'000'000};
    const bool negative = skip_minus(cell);
    const Cell rest{cell.begin + 10, cell.end};
    if (FLT_EVAL_METHOD != 0 || rest.size() - 1 >= 8 || !has_usual_digits(cell)) {
      return false;
    }
    const std::uint64_t first = digit(cell.begin) * powers[8] + number_of_digits(eight(cell.begin + 2));
    const std::uint64_t number = first * powers[rest.size()] + number_of_digits(few(rest));
    value = static_cast<double>(number) / static_cast<double>(powers[8] * powers[rest.size()]);
    value = negative ? -value : value;
    return number <= std::uint64_t{1} << 53;
  }

  std::uint64_t with_nine_decimals(Cell cell) noexcept {
    const std::uint64_t fraction = eight(cell.end - 9);
    const std::uint8_t last = digit(cell.end - 1);
    wrong_ |= others(fraction);
    require(last < 10 && cell.size() <= 20);
    return whole({cell.begin, cell.end - 10}) * 1'000'000'000 + number_of_digits(fraction) * 10 + last;
  }

  std::uint64_t with_decimals(Cell cell) noexcept {
    Run run = append_digits({cell.begin, 0}, cell.end);
    std::ptrdiff_t missing = 9;
    require(run.at != cell.begin && run.at - cell.begin <= 10);
    if (run.at != cell.end && *run.at == '.') {
      const char* const fraction = run.at + 1;
      run = append_digits({fraction, run.number}, cell.end);
      missing -= run.at - fraction;
    }
    for (; missing > 0; --missing) {
      run.number *= 10;
    }
    require(missing == 0 && run.at == cell.end);
    return run.number;
  }

  static bool is_nan(Cell cell) noexcept {
    return cell.size() == 0 || (cell.size() == 3 && std::memcmp(cell.begin, "nan", 3) == 0);
  }

  std::uint64_t wrong_ = 0;
};

}  // namespace palpate::rows
