// SPDX-License-Identifier: MIT
#include <pybind11/stl.h>

#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "../rows/ordinary.hpp"
#include "../rows/own_rows.hpp"
#include "sample_rows.hpp"

namespace {

using palpate::rows::Form;
using palpate::rows::Row;

class OwnRows {
 public:
  explicit OwnRows(const Form& form) : form_(form) {}

  py::object parse(const py::bytes& text) const {
    const char *at = PyBytes_AS_STRING(text.ptr()), *const end = at + PyBytes_GET_SIZE(text.ptr());
    const py::ssize_t lines = count_lines(*this, text) + (at != end && end[-1] != '\n');
    py::array found(once<&sample_dtype>(), lines);
    auto* const rows = static_cast<Row*>(found.mutable_data());
    run_block(lines, [&] { palpate::rows::parse_rows(at, end, form_, rows); }, least);
    return at == end ? py::object(found) : py::none();
  }

  static py::ssize_t count_lines(const OwnRows&, const py::bytes& text) {
    const char* const begin = PyBytes_AS_STRING(text.ptr());
    return static_cast<py::ssize_t>(palpate::rows::count_lines(begin, begin + PyBytes_GET_SIZE(text.ptr())));
  }

  static py::object ordinary(const OwnRows&, py::handle samples, std::int64_t largest_code) {
    const auto rows = sample_rows(samples, "samples");
    if (rows.size == 0) {
      return py::none();
    }
    const palpate::rows::Ordinary found(rows.items(), static_cast<std::size_t>(rows.size), largest_code);
    const auto [holds, pause_s, before, hard, soft] = found;
    return !holds ? py::object(py::none())
                  : py::make_tuple(pause_s, before, py::make_tuple(hard.low, hard.high),
                                   py::make_tuple(soft.low, soft.high));
  }

  static py::bytes format(const OwnRows&, py::handle samples) {
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

 private:
  static constexpr py::ssize_t least = 512;  // rows: some 50 us

  Form form_;
};

constexpr auto rows_doc = R"(The rows of a recording as palpate writes them, as text and as samples.

scale: the code of 0 pF, and the codes for one pF, to compute capacitances from codes; None: codes are left out.
uncertainty: whether the rows have the column `t_uncertainty_us`.

Other threads go on meanwhile. `palpate.recording.rows` reads what is not plain, and says what is wrong.)";

constexpr auto parse_doc = R"(parse(self, text, /)
--

Return whole lines, bytes, as an array of `SampleRing.dtype`; None where a line is not plain: with blanks, a plus, more
than 9 decimals of a time, or no row.)";

constexpr auto lines_doc = R"(count_lines(self, text, /)
--

Return the number of line ends in bytes.)";

constexpr auto ordinary_doc = R"(ordinary(self, samples, largest_code, /)
--

Return the longest time from sample to sample, s, the sample before it, and (lowest, highest) of both channels, pF.

None where a sample is not ordinary: not the next one by its number, earlier than the one before, with a status, without
a value, or with a code above the largest one. `samples` is an array of `SampleRing.dtype`, contiguous.)";

constexpr auto format_doc = R"(format(self, samples, /)
--

Return an array of `SampleRing.dtype`, contiguous, as lines, bytes.)";

OwnRows made(const std::optional<std::pair<std::int64_t, double>>& scale, bool uncertainty) {
  Form form;
  form.codes = scale.has_value();
  if (scale) {
    std::tie(form.zero, form.per_pF) = *scale;
  }
  form.uncertainty = uncertainty;
  return OwnRows(form);
}

}  // namespace

void bind_rows(py::module_& module) {
  methods::define_class<OwnRows>(module, "OwnRows", "(scale=None, *, uncertainty=True)", rows_doc, &made,
                                 py::arg("scale") = py::none(), py::kw_only(), py::arg("uncertainty") = true)
      .def("parse", &OwnRows::parse, parse_doc)
      .def("count_lines", &OwnRows::count_lines, lines_doc)
      .def("ordinary", &OwnRows::ordinary, ordinary_doc)
      .def("format", &OwnRows::format, format_doc);
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
