// SPDX-License-Identifier: MIT
// The core for a browser: rows of a recording, or readings as they come, through the tracker of the scene `handheld`, in
// blocks of memory that JavaScript reads. One module instance has one measurement. docs/try/core.js is the other side.

#include <algorithm>
#include <limits>
#include <new>
#include <type_traits>

#include "../rows/own_rows.hpp"
#include "../runs/run.hpp"
#include "block.hpp"

#define EXPORT(name) __attribute__((export_name(#name)))

namespace {

using palpate::rows::Row;
using palpate::wasm::Block;
using Core = palpate::HandheldTracker<double>;
using Run = palpate::runs::Run<Core>;

constexpr std::size_t most_text = 1 << 15, shortest_row = 16;  // "0,0,0,0,0,0,0,0" and a line end
constexpr std::size_t most_rows = most_text / shortest_row + 2, most_at_once = 256;

struct Measurement {
  Run run;
  Block<most_at_once> block;
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
  return value > 0 && value <= std::numeric_limits<double>::max();
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

/// Begin a measurement. seconds, samples: the length of a touch, 0: none of this kind.
EXPORT(begin) void begin(double seconds, double samples, double release, double full_scale, bool host_stamps) {
  Core core;
  core.settings.seconds = seconds;
  core.settings.samples = static_cast<std::uint32_t>(samples);
  core.settings.full_scale = full_scale;
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
EXPORT(touch_size) std::size_t touch_size() { return palpate::wasm::touch_size; }
/// The names of the flags, one for each bit, between commas.
EXPORT(flag_names) const char* flag_names() { return palpate::wasm::flag_names; }

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
EXPORT(finish) bool finish() {
  block.touches.clear();
  return run.finish(block.touches);
}

EXPORT(state) const char* state() { return run.state(); }
EXPORT(ratio) double ratio() { return run.core.estimator.ratio(); }
EXPORT(standard_error) double standard_error() { return run.core.standard_error(); }
EXPORT(alarm) bool alarm() { return block.alarm; }
EXPORT(retaken) std::uint32_t retaken() { return run.core.retaken(); }
}
