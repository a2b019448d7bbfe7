// SPDX-License-Identifier: MIT
#include <pybind11/stl.h>

#include <optional>
#include <utility>
#include <vector>

#include "../rows/own_rows.hpp"
#include "sample_rows.hpp"

namespace {

constexpr py::ssize_t least = 512;  // rows: some 50 us; from here on other threads go on meanwhile

py::object parse_rows(const py::bytes& text, const std::optional<std::pair<std::int64_t, double>>& scale,
                      bool uncertainty) {
  const auto [zero, per_pF] = scale.value_or(std::pair<std::int64_t, double>(0, 1));
  const palpate::rows::Form form{uncertainty, scale.has_value(), zero, per_pF};
  const char *at = PyBytes_AS_STRING(text.ptr()), *const end = at + PyBytes_GET_SIZE(text.ptr());
  const auto lines = static_cast<py::ssize_t>(palpate::rows::count_lines(at, end)) + (at != end && end[-1] != '\n');
  py::array found(once<&sample_dtype>(), lines);
  auto* const rows = static_cast<Row*>(found.mutable_data());
  run_block(lines, [&] { palpate::rows::parse_rows(at, end, form, rows); }, least);
  return at == end ? py::object(found) : py::none();
}

py::bytes format_rows(py::handle samples) {
  const auto rows = sample_rows(samples, "samples");
  std::vector<char> text(static_cast<std::size_t>(rows.size) * palpate::rows::longest_row);
  char* end = text.data();
  const auto write = [&] {
    for (py::ssize_t i = 0; i < rows.size; ++i) {
      end = palpate::rows::format_row(end, rows.items()[i]);
    }
  };
  run_block(rows.size, write, least);
  return py::bytes(text.data(), static_cast<std::size_t>(end - text.data()));
}

}  // namespace

void bind_rows(py::module_& module) {
  module.def("parse_rows", &parse_rows, R"(parse_rows(text, scale, uncertainty, /)
--

Return whole lines of a recording, bytes, as an array of `SampleRing.dtype`; None where a line is not plain: with blanks,
a plus, more than 9 decimals of a time, or no row.

scale: the code of 0 pF, and the codes for one pF, to compute capacitances from codes; None: codes are left out.
uncertainty: whether the rows have the column `t_uncertainty_us`.)");
  module.def("format_rows", &format_rows,
             "format_rows(samples, /)\n--\n\nReturn an array of `SampleRing.dtype`, contiguous, as lines, bytes.");
}

#ifdef PALPATE_EXACT_ELSEWHERE
// Where the standard library can neither read nor write doubles, Python does. The callers may have released the GIL.
namespace palpate::rows {

bool nearest(const char* begin, const char* end, double& value) noexcept {
  const std::string text(begin, end);
  const py::gil_scoped_acquire held;
  value = PyOS_string_to_double(text.c_str(), nullptr, nullptr);
  PyErr_Clear();  // -1 where it was set
  return value >= 0 && value <= DBL_MAX;
}

char* format_finite(char* to, double value) noexcept {
  const py::gil_scoped_acquire held;
  char* const text = PyOS_double_to_string(value, 'r', 0, Py_DTSF_ADD_DOT_0, nullptr);
  char* const end = append(to, text, static_cast<int>(std::strlen(text)));
  PyMem_Free(text);
  return end;
}

}  // namespace palpate::rows
#endif
