// SPDX-License-Identifier: MIT
#include <algorithm>
#include <vector>

#include "../rows/own_rows.hpp"
#include "constructors.hpp"
#include "sample_rows.hpp"

namespace {

using palpate::rows::Form;
using palpate::rows::Row;

class OwnRows {
 public:
  explicit OwnRows(const Form& form) : form_(form) {}

  py::object parse(py::handle text) const {
    if (!PyBytes_Check(text.ptr())) {
      throw py::type_error("text: got " + py::str(py::type::of(text)).cast<std::string>() + ", allowed: bytes");
    }
    const char* const begin = PyBytes_AS_STRING(text.ptr());
    const char* const end = begin + PyBytes_GET_SIZE(text.ptr());
    const py::ssize_t lines = std::count(begin, end, '\n') + (begin != end && end[-1] != '\n');
    const py::array found(once<&sample_dtype>(), py::array::ShapeContainer{lines});
    auto* const rows = View<Row>::of(found).items();
    const char* at = begin;
    run_block(lines, [&] { palpate::rows::parse_rows(at, end, form_, rows); }, least);
    return at == end ? py::object(found) : py::none();
  }

  static py::bytes format(OwnRows&, py::handle samples) {
    const auto rows = sample_rows(samples, "samples", 0);
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

Parameters
----------
scale : (int, float) or None
    The code of 0 pF, and the codes for one pF: capacitances are computed from the codes. None: the codes are left out.
uncertainty : bool
    Whether the rows have the column `t_uncertainty_us`.

Notes
-----
Other threads go on meanwhile. `palpate.recording.rows` reads what is not plain, and says what is wrong.
)";

constexpr auto parse_doc = R"(parse($self, text, /)
--

Return whole lines, bytes, as an array of `SampleRing.dtype`; None where a line is not plain: with blanks, a plus, more
than 9 decimals of a time, or no row.)";

constexpr auto format_doc = R"(format($self, samples, /)
--

Return an array of `SampleRing.dtype`, contiguous, as lines, bytes.)";

OwnRows made(const methods::Given& given) {
  Form form;
  form.codes = given.first && !given.first.is_none();
  if (form.codes) {
    const auto scale = given.first.cast<py::tuple>();
    form.zero = scale[0].cast<std::int64_t>();
    form.per_pF = scale[1].cast<double>();
  }
  if (given.settings.contains("uncertainty")) {
    form.uncertainty = given.settings.attr("pop")("uncertainty").cast<bool>();
  }
  methods::refuse_others(given, "scale, uncertainty");
  return OwnRows(form);
}

void refuse_pickle(py::handle, py::handle) { throw py::type_error("cannot pickle OwnRows: make another one"); }

}  // namespace

void bind_rows(py::module_& module) {
  auto type = methods::define_class<&made>(module, "OwnRows", "(scale=None, *, uncertainty=True)", rows_doc);
  methods::define<&OwnRows::parse>(type, parse_doc);
  methods::define<&OwnRows::format>(type, format_doc);
  methods::define<&refuse_pickle>(type, "__reduce_ex__($self, protocol, /)\n--\n\n");
}
