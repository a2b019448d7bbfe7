// SPDX-License-Identifier: MIT
#pragma once

// Signals that have an index, as columns of pandas: a method of a bound class takes them only if their indices are equal.
// The binding reads values by position, so different indices would pair values that do not belong together.

#include "module.hpp"

/// Given to each method: before it is called, palpate.labels checks its arguments.
struct SameIndex {};

/// Whether a value has no index for sure: an array, a list, a tuple or None.
inline bool is_unlabelled(py::handle value) {
  PyObject* const object = value.ptr();
  return value.is_none() || PyObject_CheckBuffer(object) || PyList_CheckExact(object) || PyTuple_CheckExact(object);
}

inline void require_same_index(const py::detail::function_call& call) {
  py::list names, values;
  for (std::size_t i = 1; i < call.args.size() && i < call.func.args.size(); ++i) {  // the first one is self
    if (!is_unlabelled(call.args[i])) {
      names.append(call.func.args[i].name);
      values.append(call.args[i]);
    }
  }
  if (values.size() > 1) {
    py::module_::import("palpate.labels").attr("require_same_index")(names, values);
  }
}

template <>
struct py::detail::process_attribute<SameIndex> : py::detail::process_attribute_default<SameIndex> {
  static void precall(function_call& call) { require_same_index(call); }
};
