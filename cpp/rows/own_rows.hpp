// SPDX-License-Identifier: MIT
#pragma once

// The rows of a recording as palpate writes them, read and written; python/palpate/recording/rows.py has the format, and
// reads every row that is not plain: with blanks, a plus, more digits than a nanosecond, or a mistake.

#include <limits>

#include "number.hpp"
#include "row.hpp"

namespace palpate::rows {

/// What is known of the rows of a recording.
struct Form {
  bool uncertainty = true;  ///< whether there is the column of the uncertainty; without it the uncertainty is -1
  bool codes = true;      ///< whether the scale of the codes is known: then a code outweighs the capacitance beside it
  std::int64_t zero = 0;  ///< the code of 0 pF
  double per_pF = 1;

  double capacitance(std::int32_t code) const noexcept { return static_cast<double>(code - zero) / per_pF; }
};

/// Reads cells one after the other. What is not plain is remembered; then nothing more is worth reading.
class Cells {
 public:
  Cells(const char* at, const char* end) noexcept : at_(at), end_(end) {}

  const char* at() const noexcept { return at_; }
  bool plain() const noexcept { return plain_; }

  /// The character that has to be next.
  void pass(char c) noexcept {
    plain_ = plain_ && at_ != end_ && *at_ == c;
    at_ += plain_;
  }

  bool skip(char c) noexcept {
    const bool found = at_ != end_ && *at_ == c;
    at_ += found;
    return found;
  }

  /// An integer from 0, with at most 18 digits.
  std::int64_t whole() noexcept { return static_cast<std::int64_t>(digits(18)); }

  /// An integer from -1 to 2^31 - 1.
  std::int32_t code() noexcept {
    const bool none = skip('-');
    const std::uint64_t number = digits(10);
    plain_ = plain_ && (none ? number == 1 : number <= most);
    return none ? -1 : static_cast<std::int32_t>(number);
  }

  /// A time in s with at most 9 decimals, as ns.
  std::int64_t nanoseconds() noexcept {
    const bool negative = skip('-');
    Run run = append_few({at_, 0}, end_);
    plain_ = plain_ && run.at != at_ && run.at - at_ <= 10;
    std::ptrdiff_t missing = 9;
    if (run.at != end_ && *run.at == '.') {
      const char* const fraction = run.at + 1;
      run = append_digits({fraction, run.number}, end_);
      missing -= run.at - fraction;
    }
    for (; missing > 0; --missing) {
      run.number *= 10;
    }
    constexpr auto latest = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
    plain_ = plain_ && missing == 0 && run.number <= latest;
    at_ = run.at;
    return static_cast<std::int64_t>(negative ? 0 - run.number : run.number);
  }

  /// A number, nan, or nothing, which is nan, too.
  double real() noexcept {
    double value = std::numeric_limits<double>::quiet_NaN();
    if (!blank() && !nan()) {
      const char* at = at_;
      plain_ = plain_ && parse_real(at, end_, value);
      at_ = at;
    }
    return value;
  }

  /// The same, where its value does not matter.
  void skip_real() noexcept {
    if (!blank() && !nan()) {
      skip('-');
      const Decimal number = take_decimal(at_, end_);
      plain_ = plain_ && number.count != 0;
      at_ = number.end;
    }
  }

  /// One digit.
  std::uint8_t status() noexcept {
    const auto number = static_cast<unsigned char>(at_ == end_ ? 255 : *at_ - '0');
    plain_ = plain_ && number <= Row::last_status;
    at_ += plain_;
    return number;
  }

  /// A line end, of Windows, too; or the end of all.
  void pass_line_end() noexcept {
    if (at_ != end_) {
      skip('\r');
      pass('\n');
    }
  }

 private:
  static constexpr std::uint64_t most = std::numeric_limits<std::int32_t>::max();

  std::uint64_t digits(std::ptrdiff_t longest) noexcept {
    const Run run = append_digits({at_, 0}, end_);
    plain_ = plain_ && run.at != at_ && run.at - at_ <= longest;
    at_ = run.at;
    return run.number;
  }

  bool blank() const noexcept { return at_ != end_ && *at_ == ','; }

  bool nan() noexcept {
    const bool found = end_ - at_ >= 3 && at_[0] == 'n' && at_[1] == 'a' && at_[2] == 'n';
    at_ += found ? 3 : 0;
    return found;
  }

  const char* at_;
  const char* end_;
  bool plain_ = true;
};

/// The capacitance in the next cell, or of the code, which then is left out of the row where its scale is not known.
inline double capacitance(Cells& cells, const Form& form, std::int32_t& code) noexcept {
  if (code >= 0 && form.codes) {
    cells.skip_real();
    return form.capacitance(code);
  }
  code = -1;
  return cells.real();
}

/// Read one row, and move `at` behind its line end; false, with `at` as it was: it is not plain.
inline bool parse_row(const char*& at, const char* end, const Form& form, Row& row) noexcept {
  Cells cells(at, end);
  row.seq = cells.whole();
  cells.pass(',');
  row.t_hard_ns = cells.nanoseconds();
  cells.pass(',');
  row.t_soft_ns = cells.nanoseconds();
  cells.pass(',');
  row.hard_raw = cells.code();
  cells.pass(',');
  row.soft_raw = cells.code();
  cells.pass(',');
  row.hard = capacitance(cells, form, row.hard_raw);
  cells.pass(',');
  row.soft = capacitance(cells, form, row.soft_raw);
  cells.pass(',');
  row.t_uncertainty_us = -1;
  if (form.uncertainty) {
    row.t_uncertainty_us = cells.code();
    cells.pass(',');
  }
  row.status = cells.status();
  std::memset(row.padding, 0, sizeof row.padding);
  cells.pass_line_end();
  at = cells.plain() ? cells.at() : at;
  return cells.plain();
}

/// Read the rows of [begin, end) to `rows`, which has room for every line; how many there are before the first that is
/// not plain. `begin` moves there.
inline std::size_t parse_rows(const char*& begin, const char* end, const Form& form, Row* rows) noexcept {
  std::size_t count = 0;
  while (begin != end && parse_row(begin, end, form, rows[count])) {
    ++count;
  }
  return count;
}

/// More than the text of any row.
constexpr std::size_t longest_row = 200;

template <class Integer>
char* format_whole(char* to, Integer number) noexcept {
  return std::to_chars(to, to + 20, number).ptr;
}

inline char* comma(char* to) noexcept {
  *to = ',';
  return to + 1;
}

inline char* format_seconds(char* to, std::int64_t ns) noexcept {
  constexpr std::uint64_t second = 1'000'000'000;
  const auto size = ns < 0 ? 0 - static_cast<std::uint64_t>(ns) : static_cast<std::uint64_t>(ns);
  if (ns < 0) {
    *to++ = '-';
  }
  to = format_whole(to, size / second);
  *to++ = '.';
  const std::uint64_t rest = size % second;
  *to = static_cast<char>('0' + rest / (second / 10));
  format_digits<8>(to + 1, rest % (second / 10));
  return to + 9;
}

/// Write a row with its line end: times in s with 9 decimals, capacitances with all digits.
inline char* format_row(char* to, const Row& row) noexcept {
  to = comma(format_whole(to, row.seq));
  to = comma(format_seconds(to, row.t_hard_ns));
  to = comma(format_seconds(to, row.t_soft_ns));
  to = comma(format_whole(to, row.hard_raw));
  to = comma(format_whole(to, row.soft_raw));
  to = comma(format_real(to, row.hard));
  to = comma(format_real(to, row.soft));
  to = comma(format_whole(to, row.t_uncertainty_us));
  to = format_whole(to, static_cast<int>(row.status));
  *to++ = '\n';
  return to;
}

}  // namespace palpate::rows
