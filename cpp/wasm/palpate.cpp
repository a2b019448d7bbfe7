// SPDX-License-Identifier: MIT
// The core for a browser: rows of a recording, or readings as they come, through the tracker of the scene `handheld`, in
// blocks of memory that JavaScript reads. One module instance has one measurement. docs/try/core.js is the other side.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <new>
#include <type_traits>

#include "../rows/own_rows.hpp"
#include "../runs/run.hpp"

#define EXPORT(name) __attribute__((export_name(#name)))

namespace {

using palpate::rows::Row;
using palpate::runs::Result;
using Core = palpate::HandheldTracker<double>;
using Run = palpate::runs::Run<Core>;

constexpr std::size_t most_text = 1 << 15, shortest_row = 16;  // "0,0,0,0,0,0,0,0" and a line end
constexpr std::size_t most_rows = most_text / shortest_row + 2, most_at_once = 256, touch_numbers = 33;
constexpr std::size_t most_judged = 64, judgement_numbers = 5;

/// The touches that ended, or were revised, in order; in a block each sample may end and revise one.
struct Touches {
  struct Flags {
    char names[128];  // of all flags, each with a comma behind it
  };

  double numbers[2 * most_at_once * touch_numbers];
  Flags flags[2 * most_at_once];
  double judgements[most_judged * judgement_numbers];
  std::size_t count = 0;   // in `numbers`
  std::size_t judged = 0;  // in `judgements`; no more are kept
  double ended = 0;        // in all
  double now_s = 0;        // time of the last sample
  double end_s = 0;        // end of the last touch

  void clear() noexcept { count = judged = 0; }
  void end(const Result& touch) noexcept {
    ended += 1;
    end_s = now_s;
    add(touch);
  }
  void revise(const Result& touch) noexcept { add(touch); }
  template <class Judgement>
  void judge(const Judgement& judgement) noexcept {
    if (judged < most_judged) {
      const double all[] = {static_cast<double>(judgement.what), static_cast<double>(judgement.channel),
                            static_cast<double>(judgement.time.count) * 1e-9, judgement.size, judgement.soft_size};
      static_assert(sizeof all == judgement_numbers * sizeof(double));
      std::memcpy(judgements + judged * judgement_numbers, all, sizeof all);
      judged += 1;
    }
  }

 private:
  void add(const Result& r) noexcept {
    const auto& f = r.misfits;
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
                          f.tilt,
                          r.shift,
                          r.alarm_share(),
                          static_cast<double>(r.saturated),
                          static_cast<double>(r.refused),
                          static_cast<double>(r.outliers),
                          r.level.ratio,
                          r.level.standard_error,
                          r.contact_exponent,
                          r.depth,
                          r.rise,
                          r.age,
                          r.before.ratio,
                          r.before.standard_error,
                          r.after.ratio,
                          r.after.standard_error};
    static_assert(sizeof all == touch_numbers * sizeof(double));
    std::memcpy(numbers + count * touch_numbers, all, sizeof all);
    char* at = flags[count].names;
    r.visit_flags([&](const char* name) {
      at = std::copy(name, name + std::strlen(name), at);
      *at++ = ',';
    });
    *at = '\0';
    count += 1;
  }
};

// Of palpate.Status, and palpate.live.feed.Flag.
enum Status : std::uint8_t { saturated_status = 3, excitation_status = 4, lost_status = 8 };
enum Flag : std::uint8_t { contact = 1, measured = 2, alarmed = 4, refused = 8, saturated = 16 };

struct Block {
  double columns[6][most_at_once];
  std::uint8_t flags[most_at_once];
  Touches touches;
  std::size_t count = 0;
  double last_s = -std::numeric_limits<double>::infinity();
  bool alarm = false;

  void clear() noexcept {
    count = 0;
    touches.clear();
  }

  void take(Run& run, const Row& row) noexcept {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const bool shut = is_forbidden(row, run.core.settings.full_scale);
    const double t_s = static_cast<double>(row.t_hard_ns) * 1e-9;
    touches.now_s = t_s;
    const auto report = run.take(palpate::Nanoseconds(row.t_hard_ns), palpate::Nanoseconds(row.t_soft_ns),
                                 shut ? nan : row.hard, shut ? nan : row.soft, touches);
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
  static bool is_forbidden(const Row& row, double full_scale) noexcept {
    const bool seen = std::fabs(row.hard) >= full_scale || std::fabs(row.soft) >= full_scale;
    return (row.status & excitation_status) != 0 || ((row.status & saturated_status) != 0 && !seen);
  }
};

struct Measurement {
  Run run;
  Block block;
};
static_assert(std::is_trivially_destructible_v<Measurement>);

char text[most_text];
std::size_t parsed_bytes;
palpate::rows::Form form;
Row rows[most_rows];
alignas(Measurement) unsigned char memory[sizeof(Measurement)];  // zeros, which a module does not have to carry
Run& run = reinterpret_cast<Measurement*>(memory)->run;
auto& block = reinterpret_cast<Measurement*>(memory)->block;

}  // namespace

namespace palpate::rows {
// The nearest double, by JavaScript's Number.
extern "C" double palpate_number(const char* begin, std::size_t size) __attribute__((import_name("number")));

bool nearest(const char* begin, const char* end, double& value) noexcept {
  value = palpate_number(begin, static_cast<std::size_t>(end - begin));
  return value >= 0 && value <= std::numeric_limits<double>::max();
}
}  // namespace palpate::rows

extern "C" {

/// Where text goes: `most` bytes.
EXPORT(text) char* text_of() { return text; }
EXPORT(most) std::size_t most_of() { return most_text; }
/// The samples of the last text; or where samples go, `most_rows` of them.
EXPORT(rows) Row* rows_of() { return rows; }
EXPORT(most_rows) std::size_t most_rows_of() { return most_rows; }

/// What is known of the rows of a recording.
EXPORT(form) void set_form(bool uncertainty, bool codes, double zero, double per_pF) {
  form = {uncertainty, codes, static_cast<std::int64_t>(zero), per_pF};
}

/// Begin a measurement. seconds, samples: the length of a touch, 0: no such limit.
EXPORT(begin)
void begin(double seconds, double samples, double release, double full_scale, bool host_stamps, double confirmed,
           double contact_exponent, double age) {
  Core core;
  core.settings.seconds = seconds;
  core.settings.samples = static_cast<std::uint32_t>(samples);
  core.settings.full_scale = full_scale;
  core.settings.confirmed = confirmed;
  core.level_settings().contact_exponent = contact_exponent;
  core.level_settings().age = age;
  core.gate.settings.release = release;
  new (memory) Measurement{Run(core, host_stamps), {}};
}

/// Read the first `size` bytes of the text as rows; how many there are before the first that is not plain.
EXPORT(parse) std::size_t parse(std::size_t size) {
  const char* at = text;
  const std::size_t count = palpate::rows::parse_rows(at, text + size, form, rows);
  parsed_bytes = static_cast<std::size_t>(at - text);
  return count;
}
/// How many bytes those rows are.
EXPORT(parsed) std::size_t parsed_of() { return parsed_bytes; }

/// Give the samples [from, to) to the tracker, or as many of them as there is room for; how many. `column` and `flags` have
/// a row for each, `touches` what ended or was revised.
EXPORT(take) std::size_t take(std::size_t from, std::size_t to) {
  const std::size_t count = std::min(to - from, most_at_once);
  block.clear();
  for (std::size_t i = 0; i < count; ++i) {
    block.take(run, rows[from + i]);
  }
  return count;
}
/// t, hard, soft, ratio, standard error, statistic: as palpate.live.feed.FIELDS.
EXPORT(column) const double* column(std::size_t number) { return block.columns[number]; }
EXPORT(flags) const std::uint8_t* flags() { return block.flags; }

/// The numbers of the touches since the last `take`, `gap`, `tare` or `finish`: `touch_size` for each.
EXPORT(touches) const double* touches() { return block.touches.numbers; }
EXPORT(touch_count) std::size_t touch_count() { return block.touches.count; }
EXPORT(touch_size) std::size_t touch_size() { return touch_numbers; }
/// The names of the flags of one of them, each with a comma behind it.
EXPORT(touch_flags) const char* touch_flags(std::size_t number) { return block.touches.flags[number].names; }

/// What was judged since then: the number of its name and of its channel, time, size, and size of the soft channel.
EXPORT(judgements) const double* judgements() { return block.touches.judgements; }
EXPORT(judgement_count) std::size_t judgement_count() { return block.touches.judged; }
EXPORT(judgement_size) std::size_t judgement_size() { return judgement_numbers; }

EXPORT(gap) void gap() {
  block.touches.clear();
  run.gap(block.touches);
}
/// Measure the baseline again; false: it is in contact, and not `forced`.
EXPORT(tare) bool tare(bool forced) {
  if (!forced && run.pressed()) {
    return false;
  }
  block.touches.clear();
  run.finish(block.touches);
  run.tare(true);
  return true;
}
/// The end: the last readings wait for those after them, so the last touch may be revised without one that ends.
EXPORT(finish) void finish() {
  block.touches.clear();
  run.finish(block.touches);
}

EXPORT(state) const char* state() { return run.state(); }
EXPORT(ratio) double ratio() { return run.core.estimator.ratio(); }
EXPORT(standard_error) double standard_error() { return run.core.standard_error(); }
EXPORT(alarm) bool alarm() { return block.alarm; }
EXPORT(retaken) std::uint32_t retaken() { return run.core.retaken(); }
}
