// SPDX-License-Identifier: MIT
#pragma once

// A table of another program, as long as its lines are clean: each with the same number of cells, and each cell a plain
// number, or a text with digits and other characters where the first line has them. It stops before the first other line,
// so that a reader that knows more goes on there.

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "number.hpp"

namespace palpate::rows {

/// A piece of a text.
struct Piece {
  const char* begin = nullptr;
  const char* end = nullptr;

  std::size_t size() const noexcept { return static_cast<std::size_t>(end - begin); }
  bool operator==(const Piece& other) const noexcept {
    return size() == other.size() && std::memcmp(begin, other.begin, size()) == 0;
  }
};

/// Whether a number can also be a whole one with groups of digits: [+-]d.ddd to [+-]ddd.ddd, the first digit not 0.
inline bool is_doubtful(Piece number, char decimal) noexcept {
  const char* const first = number.begin + (*number.begin == '-' || *number.begin == '+');
  const char* at = first;
  while (at != number.end && is_digit(*at)) {
    ++at;
  }
  return at - first >= 1 && at - first <= 3 && *first != '0' && number.end - at == 4 && *at == decimal &&
         is_digit(at[1]) && is_digit(at[2]) && is_digit(at[3]);
}

/// One column: `shape` is a text with 0 for each digit, empty for numbers.
struct CleanColumn {
  std::string shape;
  bool is_marked = false;  // a number has the decimal mark
  bool is_sure = false;    // and cannot be one with groups of digits
  std::string last = {};   // the cell of the last line
  double last_number = 0;

  bool is_number() const noexcept { return shape.empty(); }
};

/// Where the cells of a column go: an item for each line, and one for the last line without an end.
struct Target {
  double* numbers;
  char* texts;
};

/// What was read: so many lines, and where they end.
struct CleanLines {
  std::size_t count;
  const char* end;
};

/// Reads clean lines, block by block.
class CleanRows {
 public:
  /// `delimiter` '\0' is any number of blanks; `decimal` is the decimal mark.
  CleanRows(char delimiter, char decimal, std::vector<CleanColumn> columns)
      : delimiter_(delimiter), decimal_(decimal), columns_(std::move(columns)), now_(columns_.size()) {}

  const std::vector<CleanColumn>& columns() const noexcept { return columns_; }

  /// Read lines up to the first one that is not clean, or has no end.
  CleanLines read(Piece text, const std::vector<Target>& targets) {
    std::vector<Piece> before;
    for (const CleanColumn& column : columns_) {
      before.push_back({column.last.data(), column.last.data() + column.last.size()});
    }
    CleanLines lines{0, text.begin};
    while (const char* const end = line_end(lines.end, text.end, targets, lines.count)) {
      if (!follows(before, targets, lines.count)) {
        break;
      }
      note_marks();
      std::swap(before, now_);
      lines = {lines.count + 1, end};
    }
    keep_last(before, targets, lines.count);
    return lines;
  }

 private:
  static constexpr std::ptrdiff_t kLongest = 1 << 16;  // characters of a line
  static constexpr std::size_t kLongestNumber = 64;

  void keep_last(const std::vector<Piece>& last, const std::vector<Target>& targets, std::size_t count) {
    for (std::size_t i = 0; i < columns_.size() && count > 0; ++i) {
      columns_[i].last = std::string(last[i].begin, last[i].size());
      columns_[i].last_number = columns_[i].is_number() ? targets[i].numbers[count - 1] : 0;
    }
  }

  bool is_blank(char c) const noexcept { return c == ' ' || (c == '\t' && delimiter_ == '\0'); }

  const char* after_blanks(const char* at, const char* end) const noexcept {
    while (at != end && is_blank(*at)) {
      ++at;
    }
    return at;
  }

  /// The end of the line at `at`, its cells read; null: it is not clean.
  const char* line_end(const char* at, const char* end, const std::vector<Target>& targets, std::size_t row) {
    const char* const begin = at;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if (i > 0 && !take_delimiter(at, end)) {
        return nullptr;
      }
      at = after_blanks(at, end);
      now_[i].begin = at;
      if (!(columns_[i].is_number() ? take_number(at, end, targets[i].numbers[row]) : take_text(at, end, i))) {
        return nullptr;
      }
      now_[i].end = at;
      at = after_blanks(at, end);
    }
    at += at != end && *at == '\r';
    const bool ends = at != end && *at == '\n' && at - begin < kLongest;
    return ends && !is_two_whole() ? at + 1 : nullptr;
  }

  bool take_delimiter(const char*& at, const char* end) const noexcept {
    if (delimiter_ == '\0') {
      return is_blank(at[-1]);
    }
    return at != end && *at++ == delimiter_;
  }

  bool take_number(const char*& at, const char* end, double& value) const noexcept {
    return decimal_ == '.' ? parse_real(at, end, value) : take_other(at, end, value);
  }

  /// A number with another decimal mark than the point.
  bool take_other(const char*& at, const char* end, double& value) const noexcept {
    char text[kLongestNumber];
    std::size_t size = 0;
    for (; at + size != end && size < kLongestNumber && at[size] != '.'; ++size) {
      text[size] = at[size] == decimal_ ? '.' : at[size];
    }
    const char* next = text;
    const bool found = parse_real(next, text + size, value) && next != text + kLongestNumber;
    at += next - text;
    return found;
  }

  bool take_text(const char*& at, const char* end, std::size_t column) const noexcept {
    const std::string& shape = columns_[column].shape;
    if (static_cast<std::size_t>(end - at) < shape.size()) {
      return false;
    }
    for (const char each : shape) {
      if (is_digit(each) ? !is_digit(*at) : *at != each) {
        return false;
      }
      ++at;
    }
    return true;
  }

  bool has_mark(Piece number) const noexcept { return std::memchr(number.begin, decimal_, number.size()) != nullptr; }

  /// Whether the line may be one number with a decimal comma, where commas seem to separate two cells.
  bool is_two_whole() const noexcept {
    return delimiter_ == ',' && columns_.size() == 2 && !has_mark(now_[0]) && !has_mark(now_[1]);
  }

  /// Keep the texts; false: a number is that of the line before in another spelling, of which equal bits do not tell.
  bool follows(const std::vector<Piece>& before, const std::vector<Target>& targets, std::size_t row) noexcept {
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if (!columns_[i].is_number()) {
        std::memcpy(targets[i].texts + row * now_[i].size(), now_[i].begin, now_[i].size());
        continue;
      }
      const double* const number = targets[i].numbers + row;
      const double& last = row > 0 ? number[-1] : columns_[i].last_number;
      if (before[i].size() != 0 && std::memcmp(number, &last, sizeof last) == 0 && !(before[i] == now_[i])) {
        return false;
      }
    }
    return true;
  }

  void note_marks() noexcept {
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      CleanColumn& column = columns_[i];
      if (column.is_number() && !column.is_sure && has_mark(now_[i])) {
        column.is_marked = true;
        column.is_sure = !is_doubtful(now_[i], decimal_);
      }
    }
  }

  char delimiter_, decimal_;
  std::vector<CleanColumn> columns_;
  std::vector<Piece> now_;
};

}  // namespace palpate::rows
