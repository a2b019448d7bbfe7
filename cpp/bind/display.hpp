// SPDX-License-Identifier: MIT
#pragma once

#include "methods.hpp"

// How a prompt and a notebook show an object: palpate.display writes it, from what any caller can read.
namespace display {

enum class Kind { estimator, touch, tracker };

/// A function of palpate.display.text or of palpate.display.cards, applied to the object.
template <Kind kind>
py::object written(const char* module, py::handle self) {
  constexpr const char* names[] = {"estimator", "touch", "tracker"};
  return py::module_::import(module).attr(names[static_cast<int>(kind)])(self);
}
template <Kind kind>
py::object text(py::handle self) {
  return written<kind>("palpate.display.text", self);
}
template <Kind kind>
py::object html(py::handle self) {
  return written<kind>("palpate.display.cards", self);
}

template <Kind kind, class T>
void define(py::class_<T>& type) {
  methods::define<&text<kind>>(type, "__repr__($self, /)\n--\n\n");
  methods::define<&html<kind>>(type, "_repr_html_($self)\n--\n\n");
}

}  // namespace display
