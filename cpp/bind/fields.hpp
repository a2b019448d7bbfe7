// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "arrays.hpp"

/// A structured dtype, field by field. PYBIND11_NUMPY_DTYPE would register it for the whole process.
struct FieldList {
  py::list names, formats, offsets;

  template <class Real>
  void add(const char* name, std::size_t offset) {
    names.append(name);
    formats.append(py::dtype::of<Real>());
    offsets.append(offset);
  }
  py::dtype dtype(std::size_t size) const { return py::dtype(names, formats, offsets, static_cast<py::ssize_t>(size)); }
};
