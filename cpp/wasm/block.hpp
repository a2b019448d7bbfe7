// SPDX-License-Identifier: MIT
#pragma once

// What JavaScript gets of a block of samples: the columns and flags of the live page's rows, and the touches as numbers.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

#include "../rows/row.hpp"
#include "../runs/run.hpp"

namespace palpate::wasm {

constexpr char flag_names[] =
    "short,saturated,refused,unsettled,unexcited,one-sided,offset,drift,lag,curve,creep,baseline,gap";

/// The bit of a flag: its place in `flag_names`.
inline double bit_of(const char* name) noexcept {
  double bit = 1;
  const std::size_t size = std::strlen(name);
  for (const char* at = flag_names; *at != '\0'; ++at) {
    if (std::strncmp(at, name, size) == 0 && (at[size] == ',' || at[size] == '\0') &&
        (at == flag_names || at[-1] == ',')) {
      break;
    }
    bit = *at == ',' ? 2 * bit : bit;
  }
  return bit;
}

constexpr std::size_t touch_size = 22;

/// The touches that ended, or were revised, in order.
template <std::size_t most>
struct Touches {
  double numbers[most * touch_size];
  std::size_t count = 0;  // in `numbers`
  double ended = 0;       // in all
  double now_s = 0;       // time of the last sample
  double end_s = 0;       // that of the last touch that ended

  void clear() noexcept { count = 0; }
  void end(const runs::Result& touch) noexcept {
    ended += 1;
    end_s = now_s;
    add(touch);
  }
  void revise(const runs::Result& touch) noexcept { add(touch); }

 private:
  void add(const runs::Result& r) noexcept {
    double flags = 0;
    r.visit_flags([&](const char* name) { flags += bit_of(name); });
    const auto& f = r.fitted;
    const double all[] = {ended,
                          static_cast<double>(r.start),
                          r.start_s,
                          end_s,
                          static_cast<double>(r.samples),
                          r.ratio,
                          r.covariance,
                          r.standard_error,
                          r.revised() ? 1.0 : 0.0,
                          r.first_ratio,
                          r.first_standard_error,
                          f.offset_ratio,
                          f.offset_error,
                          f.offset,
                          f.drift,
                          r.lag_ms(),
                          f.curve,
                          r.shift,
                          r.alarm_share(),
                          static_cast<double>(r.saturated),
                          static_cast<double>(r.refused),
                          flags};
    static_assert(sizeof all == touch_size * sizeof(double));
    std::memcpy(numbers + count * touch_size, all, sizeof all);
    count += 1;
  }
};

// Of palpate.Status, and palpate.live.feed.Flag.
enum Status : std::uint8_t { saturated_status = 3, excitation_status = 4, lost_status = 8 };
enum Flag : std::uint8_t { contact = 1, measured = 2, alarmed = 4, refused = 8, saturated = 16 };

template <std::size_t most>
struct Block {
  double columns[6][most];
  std::uint8_t flags[most];
  Touches<2 * most> touches;
  std::size_t count = 0;
  double last_s = -std::numeric_limits<double>::infinity();
  bool alarm = false;

  void clear() noexcept {
    count = 0;
    touches.clear();
  }

  template <class Run>
  void take(Run& run, const rows::Row& row) noexcept {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const bool shut = is_forbidden(row, run.core.settings.full_scale);
    const double t_s = static_cast<double>(row.t_hard_ns) * 1e-9;
    touches.now_s = t_s;
    const auto report = run.take(row.t_hard_ns, row.t_soft_ns, shut ? nan : row.hard, shut ? nan : row.soft, touches);
    const auto state = run.row(report, static_cast<std::size_t>(touches.ended));
    alarm = report.alarm;
    last_s = t_s > last_s ? t_s : last_s;  // times of a file may go back
    const bool useless =
        (row.status & (excitation_status | lost_status)) != 0 || !std::isfinite(row.hard) || !std::isfinite(row.soft);
    const bool shown = state.touch > 0;
    const double values[] = {last_s,
                             useless ? nan : row.hard - state.hard_baseline,
                             useless ? nan : row.soft - state.soft_baseline,
                             shown ? state.ratio : nan,
                             shown ? state.standard_error : nan,
                             shown ? state.statistic : nan};
    for (std::size_t i = 0; i < 6; ++i) {
      columns[i][count] = values[i];
    }
    const bool full = (row.status & saturated_status) != 0;
    flags[count] = static_cast<std::uint8_t>((state.contact ? contact : 0) | (shown ? measured : 0) |
                                             (state.alarm && shown ? alarmed : 0) | (useless ? refused : 0) |
                                             (full ? saturated : 0));
    count += 1;
  }

 private:
  /// Whether a tracker may not have a sample: with an excitation error, or saturated where it would not see it.
  static bool is_forbidden(const rows::Row& row, double full_scale) noexcept {
    const bool seen = std::fabs(row.hard) >= full_scale || std::fabs(row.soft) >= full_scale;
    return (row.status & excitation_status) != 0 || ((row.status & saturated_status) != 0 && !seen);
  }
};

}  // namespace palpate::wasm
