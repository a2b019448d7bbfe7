// SPDX-License-Identifier: MIT
#pragma once

// What palpate.recording.survey counts, where there is nothing to count.

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "own_rows.hpp"

namespace palpate::rows {

struct Span {
  double low, high;

  void add(double value) noexcept { low = std::min(low, value), high = std::max(high, value); }
};

/// Rows with rising times and values that need no remark.
struct Ordinary {
  bool holds = true;
  double pause_s = 0;  ///< the longest time from row to row; of equal ones the first
  std::size_t before_pause = 0;
  Span hard, soft;

  /// Of one row at least.
  Ordinary(const Row* rows, std::size_t count, std::int64_t largest_code) noexcept
      : hard{rows->hard, rows->hard}, soft{rows->soft, rows->soft} {
    double time_s = seconds(rows->t_hard_ns);
    for (std::size_t i = 0; i < count; ++i) {
      const Row& row = rows[i];
      const Row& last = rows[i - (i != 0)];
      const double last_s = time_s;
      time_s = seconds(row.t_hard_ns);
      if (time_s - last_s > pause_s) {
        pause_s = time_s - last_s;
        before_pause = i - 1;
      }
      hard.add(row.hard);
      soft.add(row.soft);
      holds = holds && is_ordinary(row, largest_code) && (i == 0 || follows(last, row));
    }
  }

 private:
  static bool is_ordinary(const Row& row, std::int64_t largest_code) noexcept {
    return row.status == 0 && std::isfinite(row.hard) && std::isfinite(row.soft) && row.hard_raw <= largest_code &&
           row.soft_raw <= largest_code;
  }

  static bool follows(const Row& last, const Row& row) noexcept {
    return row.seq > last.seq && row.seq - 1 == last.seq && row.t_hard_ns >= last.t_hard_ns;
  }

  static double seconds(std::int64_t ns) noexcept { return static_cast<double>(ns) / 1e9; }
};

}  // namespace palpate::rows
