// SPDX-License-Identifier: MIT
#pragma once

// The rows of a recording as palpate writes them, read and written; python/palpate/recording/rows.py has the format, and
// reads every row that is not plain: with blanks, a plus, more digits than a nanosecond, or a mistake.

#include <algorithm>
#include <cstdint>

#include "cells.hpp"

namespace palpate::rows {

/// palpate.Sample as the ring carries it and a recording keeps it. The padding is a member, so that equal samples have
/// equal bytes.
struct Row {
  std::int64_t seq, t_hard_ns, t_soft_ns;
  std::int32_t hard_raw, soft_raw;
  double hard, soft;
  std::uint8_t status;
  unsigned char padding[3];
  std::int32_t t_uncertainty_us;

  static constexpr std::uint8_t last_status = 8;
};

/// What is known of the rows of a recording.
struct Form {
  bool uncertainty = true;  ///< whether there is the column of the uncertainty; without it the uncertainty is -1
  bool codes = true;      ///< whether the scale of the codes is known: then a code outweighs the capacitance beside it
  std::int64_t zero = 0;  ///< the code of 0 pF
  double per_pF = 1;

  double capacitance(std::int32_t code) const noexcept { return static_cast<double>(code - zero) / per_pF; }
};

/// The capacitance in a cell, or of the code, which then is left out of the row where its scale is not known.
inline double capacitance(Cells& cells, const Form& form, Cell cell, std::int32_t& code) noexcept {
  if (code >= 0 && form.codes) {
    cells.skip_real(cell);
    return form.capacitance(code);
  }
  code = -1;
  return cells.real(cell);
}

/// A copy of some text, with room to read behind it, and the rows in it.
class Batch {
 public:
  /// As much of [begin, end) as there is room for; the last line of all may lack its end.
  Batch(const char* begin, const char* end) noexcept {
    const auto size = std::min(end - begin, most);
    char* last = append(text_, begin, static_cast<int>(size));
    std::memset(last, 0, behind);
    if (size == end - begin && last[-1] != '\n' && last[-1] != '\r') {
      *last++ = '\n';
    }
    last_ = find_commas(text_, last, places_);
  }

  /// Where the rows so far end, from the begin of the text.
  std::ptrdiff_t read() const noexcept { return at_ - text_; }

  /// Read the next row; false: there is no whole one, or it is not plain.
  bool next(const Form& form, Row& row) noexcept {
    if (last_ - place_ < (form.uncertainty ? 8 : 7)) {
      return false;
    }
    Cells cells;
    row.seq = static_cast<std::int64_t>(cells.whole(cell(cells)));
    row.t_hard_ns = cells.nanoseconds(cell(cells));
    row.t_soft_ns = cells.nanoseconds(cell(cells));
    row.hard_raw = cells.code(cell(cells));
    row.soft_raw = cells.code(cell(cells));
    row.hard = capacitance(cells, form, cell(cells), row.hard_raw);
    row.soft = capacitance(cells, form, cell(cells), row.soft_raw);
    row.t_uncertainty_us = form.uncertainty ? cells.code(cell(cells)) : -1;
    row.status = cells.digit(at_);
    cells.require(row.status <= Row::last_status);
    std::memset(row.padding, 0, sizeof row.padding);
    at_ += 1 + (at_[1] == '\r');
    cells.require(*at_++ == '\n');
    return cells.plain();
  }

 private:
  static constexpr std::ptrdiff_t most = 4096, behind = 80;

  /// The next cell, up to a comma.
  Cell cell(Cells& cells) noexcept {
    const Cell found{at_, text_ + *place_++};
    cells.require(*found.end == ',');
    at_ = found.end + 1;
    return found;
  }

  char text_[most + behind];
  std::uint16_t places_[most + behind];
  const std::uint16_t* place_ = places_;
  const std::uint16_t* last_;
  const char* at_ = text_;
};

/// Number of line ends.
inline std::size_t count_lines(const char* at, const char* end) noexcept {
  std::size_t count = 0;
  while (at != end) {
    const char* const stop = at + std::min<std::ptrdiff_t>(end - at, 255);
    unsigned char few = 0;  // so that the compiler counts in bytes, 16 and more of them at a time
    for (; at != stop; ++at) {
      few = static_cast<unsigned char>(few + (*at == '\n'));
    }
    count += few;
  }
  return count;
}

/// Read the rows of [begin, end) to `rows`, which has room for every line; how many there are before the first that is
/// not plain. `begin` moves there.
inline std::size_t parse_rows(const char*& begin, const char* end, const Form& form, Row* rows) noexcept {
  std::size_t count = 0;
  for (std::ptrdiff_t read = 1; read != 0 && begin != end; begin += read) {
    Batch batch(begin, end);
    for (read = 0; batch.next(form, rows[count]); ++count) {
      read = batch.read();
    }
    read = std::min(read, end - begin);  // a line end was added
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
  format_eight(to + 1, rest % (second / 10));
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
