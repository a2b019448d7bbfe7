// SPDX-License-Identifier: MIT
// libFuzzer: bytes as rows of a recording. The first byte chooses the form; the rest is read from memory that ends
// where they end. Rows that are plain come back from their own text with the same bits.

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "../../cpp/rows/own_rows.hpp"

namespace {

using namespace palpate::rows;

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

std::vector<Row> parsed(const std::vector<char>& text, const Form& form) {
  const auto ends = static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  std::vector<Row> rows(ends + (!text.empty() && text.back() != '\n'));  // as many as there are lines
  const char* at = text.data();
  const char* const end = at + text.size();
  rows.resize(parse_rows(at, end, form, rows.data()));
  require(at == end || at == text.data() || at[-1] == '\n');
  return rows;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const int how = size == 0 ? 0 : data[0];
  const Form form{(how & 1) == 0, (how & 2) == 0, 8388608, 2048000.0};
  const std::vector<Row> rows = parsed({data + (size != 0), data + size}, form);
  std::vector<char> text(rows.size() * longest_row);
  char* end = text.data();
  for (const Row& row : rows) {
    end = format_row(end, row);
    require(row.seq >= 0 && row.hard_raw >= -1 && row.soft_raw >= -1 && row.status <= Row::last_status);
  }
  text.resize(static_cast<std::size_t>(end - text.data()));
  const std::vector<Row> again = parsed(text, {true, form.codes, form.zero, form.per_pF});
  require(again.size() == rows.size());
  require(rows.empty() || std::memcmp(rows.data(), again.data(), rows.size() * sizeof(Row)) == 0);
  return 0;
}
