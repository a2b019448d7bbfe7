// SPDX-License-Identifier: MIT
#include "../rows/columns.hpp"

#include <pybind11/stl.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "constructors.hpp"

namespace {

using palpate::rows::CleanColumn;
using palpate::rows::CleanLines;
using palpate::rows::Piece;
using palpate::rows::Target;

class PyCleanRows {
 public:
  PyCleanRows(char delimiter, char decimal, std::vector<CleanColumn> columns)
      : rows_(delimiter, decimal, std::move(columns)) {}

  py::tuple read(py::handle text) {
    if (!PyBytes_Check(text.ptr())) {
      throw py::type_error("text: got " + py::str(py::type::of(text)).cast<std::string>() + ", allowed: bytes");
    }
    const char* const begin = PyBytes_AS_STRING(text.ptr());
    const Piece piece{begin, begin + PyBytes_GET_SIZE(text.ptr())};
    const py::ssize_t most = std::count(piece.begin, piece.end, '\n') + 1;
    std::vector<py::array> arrays;
    std::vector<Target> targets;
    for (const CleanColumn& column : rows_.columns()) {
      const auto type =
          column.is_number() ? py::dtype::of<double>() : py::dtype("S" + std::to_string(column.shape.size()));
      arrays.emplace_back(type, py::array::ShapeContainer{most});
      void* const items = arrays.back().mutable_data();
      targets.push_back({static_cast<double*>(items), static_cast<char*>(items)});
    }
    CleanLines lines{0, piece.begin};
    run_block(PyBytes_GET_SIZE(text.ptr()), [&] { lines = rows_.read(piece, targets); });
    py::list found;
    for (const py::array& array : arrays) {
      found.append(array[py::slice(0, static_cast<py::ssize_t>(lines.count), 1)]);
    }
    return py::make_tuple(lines.end - piece.begin, found);
  }

  py::tuple marked() const { return of_columns(&CleanColumn::is_marked); }
  py::tuple sure() const { return of_columns(&CleanColumn::is_sure); }

 private:
  py::tuple of_columns(bool CleanColumn::* member) const {
    py::list found;
    for (const CleanColumn& column : rows_.columns()) {
      found.append(column.*member);
    }
    return py::tuple(found);
  }

  palpate::rows::CleanRows rows_;
};

constexpr auto rows_doc = R"(Reads the clean lines of a table: numbers as float() reads them, and texts of one shape.

Parameters
----------
shapes : sequence of str
    One for each column: "" for numbers, else a text with 0 for each digit that its cells have.
delimiter : str
    One character, or "" for any number of blanks.
decimal : str
    Decimal mark, "." or ",".

Raises
------
ValueError
    No column, or more than one character.

Notes
-----
A line is clean if it has a cell for each column and a line end, and each cell is a plain number or has its shape.
)";

constexpr auto read_doc = R"(read($self, text, /)
--

Read bytes from the beginning of a line on; return where the first line begins that is not clean or has no end, and an
array for each column.

A number that is the one of the line before in another spelling is not clean: so equal bits are equal texts.)";

/// The one character that `settings` has under this name, which is taken out of it; '\0' for an empty text.
char take_character(py::dict& settings, const char* name, const std::string& allowed) {
  const auto text = settings.attr("pop")(name, "?").cast<std::string>();
  if (text.size() > 1 || allowed.find(text.c_str()[0]) == std::string::npos) {
    // NOLINTNEXTLINE(readability-redundant-string-cstr): up to its NUL, which stands for none
    throw py::value_error(std::string(name) + ": got '" + text + "', allowed: one character of '" + allowed.c_str() +
                          "'");
  }
  return text.c_str()[0];
}

PyCleanRows made(const methods::Given& given) {
  methods::Given others = given;
  const bool is_said = given.settings.contains("delimiter") && given.settings.contains("decimal");
  if (!is_said) {
    methods::refuse_others(given, "shapes, delimiter, decimal");
    throw py::type_error("CleanRows: got no delimiter, or no decimal, allowed: both");
  }
  const char delimiter = take_character(others.settings, "delimiter", std::string("\t;|,\0", 5));
  const char decimal = take_character(others.settings, "decimal", ".,");
  methods::refuse_others(others, "shapes, delimiter, decimal");
  std::vector<CleanColumn> columns;
  for (const auto& shape : given.first ? given.first.cast<std::vector<std::string>>() : std::vector<std::string>()) {
    columns.push_back({shape});
  }
  if (columns.empty()) {
    throw py::value_error("shapes: got none, allowed: one for each column");
  }
  return {delimiter, decimal, std::move(columns)};
}

void refuse_pickle(py::handle, py::handle) { throw py::type_error("cannot pickle a CleanRows: it is inside a file"); }

}  // namespace

void bind_columns(py::module_& module) {
  auto type = methods::define_class<&made>(module, "CleanRows", "(shapes, *, delimiter, decimal)", rows_doc);
  methods::define<&PyCleanRows::read>(type, read_doc);
  methods::define<&refuse_pickle>(type, "__reduce_ex__($self, protocol, /)\n--\n\n");
  methods::property<&PyCleanRows::marked>(type, "marked",
                                          "For each column, whether a number so far has the decimal mark.");
  methods::property<&PyCleanRows::sure>(
      type, "sure", "For each column, whether a number so far has it where no mark of groups of digits can be.");
}
