// SPDX-License-Identifier: MIT
#pragma once

// Arrays of samples, of the dtype that SampleRing.dtype is.

#include "../rows/own_rows.hpp"
#include "arrays.hpp"

using palpate::rows::Row;

inline py::dtype sample_dtype() {
  return dtype_of({PYBIND11_MAP_LIST(PYBIND11_FIELD_DESCRIPTOR, Row, seq, t_hard_ns, t_soft_ns, hard_raw, soft_raw,
                                     hard, soft, status, t_uncertainty_us)},
                  sizeof(Row));
}

/// The items of an array of samples, shape (n,), contiguous and aligned.
inline View<Row> sample_rows(py::handle value, const char* name, int flags = 0) {
  const auto array = py::reinterpret_borrow<py::array>(value);
  if (!py::isinstance<py::array>(value) || !array.dtype().equal(once<&sample_dtype>())) {
    const py::object got = py::getattr(value, "dtype", py::type::of(value));
    refuse<type_error>(name, got, "a numpy array of SampleRing.dtype");
  }
  require_shape(array, name, {-1});
  const int needed = flags | aligned | py::array::c_style;
  if ((array.flags() & needed) != needed) {
    const char* const allowed = flags ? "a contiguous one that may be written" : "a contiguous one";
    refuse<value_error>(name, "a strided, unaligned or read-only array", allowed);
  }
  return View<Row>(array);
}
