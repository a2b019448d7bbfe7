// SPDX-License-Identifier: MIT
#include <utility>
#include <vector>

#include "../rows/ordinary.hpp"
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
    const auto bytes = bytes_of(text);
    const char* const begin = bytes.first;
    const char* const end = bytes.second;
    const auto lines =
        static_cast<py::ssize_t>(palpate::rows::count_lines(begin, end)) + (begin != end && end[-1] != '\n');
    const py::array found(once<&sample_dtype>(), py::array::ShapeContainer{lines});
    auto* const rows = View<Row>::of(found).items();
    const char* at = begin;
    run_block(lines, [&] { palpate::rows::parse_rows(at, end, form_, rows); }, least);
    return at == end ? py::object(found) : py::none();
  }

  static std::size_t count_lines(OwnRows&, py::handle text) {
    const auto [begin, end] = bytes_of(text);
    return palpate::rows::count_lines(begin, end);
  }

  static py::object ordinary(OwnRows&, py::handle samples, py::handle largest_code) {
    const auto rows = sample_rows(samples, "samples", 0);
    const auto largest = largest_code.cast<std::int64_t>();
    if (rows.size == 0) {
      return py::none();
    }
    const palpate::rows::Ordinary found(rows.items(), static_cast<std::size_t>(rows.size), largest);
    const auto [holds, pause_s, before, hard, soft] = found;
    return !holds ? py::object(py::none())
                  : py::make_tuple(pause_s, before, py::make_tuple(hard.low, hard.high),
                                   py::make_tuple(soft.low, soft.high));
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
  static std::pair<const char*, const char*> bytes_of(py::handle text) {
    if (!PyBytes_Check(text.ptr())) {
      throw py::type_error("text: got " + py::str(py::type::of(text)).cast<std::string>() + ", allowed: bytes");
    }
    const char* const begin = PyBytes_AS_STRING(text.ptr());
    return {begin, begin + PyBytes_GET_SIZE(text.ptr())};
  }

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

constexpr auto lines_doc = R"(count_lines($self, text, /)
--

Return the number of line ends in bytes.)";

constexpr auto ordinary_doc = R"(ordinary($self, samples, largest_code, /)
--

Return the longest time from sample to sample, s, the sample before it, and (lowest, highest) of both channels, pF.

None where a sample is not ordinary: not the next one by its number, earlier than the one before, with a status, without
a value, or with a code above the largest one. `samples` is an array of `SampleRing.dtype`, contiguous.)";

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
  methods::define<&OwnRows::count_lines>(type, lines_doc);
  methods::define<&OwnRows::ordinary>(type, ordinary_doc);
  methods::define<&OwnRows::format>(type, format_doc);
  methods::define<&refuse_pickle>(type, "__reduce_ex__($self, protocol, /)\n--\n\n");
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
