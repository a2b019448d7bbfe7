// SPDX-License-Identifier: MIT
#pragma once

// What a bank's calls accept: one row of samples, one for each stream, or a table of such rows.

#include <algorithm>
#include <vector>

#include "arrays.hpp"

template <class Real>
using Table = py::array_t<Real, py::array::c_style | py::array::forcecast | aligned>;

/// dimensions 1: shape (streams,); 2: (frames, streams), any number of frames where that is < 0.
template <class Real>
Table<Real> table_of(const py::object& value, const std::string& name, int dimensions, py::ssize_t streams,
                     py::ssize_t frames) {
  const py::array array = real_array(value, name);
  const bool rows = dimensions == 1 || (array.ndim() == 2 && (frames < 0 || array.shape(0) == frames));
  if (array.ndim() != dimensions || !rows || array.shape(dimensions - 1) != streams) {
    const std::string count = frames < 0 ? "n" : std::to_string(frames);
    throw py::value_error(name + ": got shape " + shape_of(array) + ", allowed: (" +
                          (dimensions == 1 ? "" : count + ", ") + std::to_string(streams) +
                          (dimensions == 1 ? ",)" : ")"));
  }
  return Table<Real>(py::object(array));
}

/// `out` itself, checked, or a new array of the shape of `like` where it is None.
template <class Real>
py::array table_out(const py::object& out, const Table<Real>& like, const py::dtype& dtype) {
  const std::vector<py::ssize_t> shape(like.shape(), like.shape() + like.ndim());
  if (out.is_none()) {
    return py::array(dtype, shape);
  }
  py::array array = writeable_array(out, dtype);
  const bool same = array.ndim() == like.ndim() && std::equal(shape.begin(), shape.end(), array.shape());
  if (!same || !(array.flags() & py::array::c_style)) {
    throw py::value_error("out: got shape " + shape_of(array) + (same ? ", strided" : "") +
                          ", allowed: " + shape_of(like) + ", contiguous");
  }
  return array;
}

/// As apart_from, for contiguous arrays.
template <class Real>
Table<Real> table_apart(const Table<Real>& samples, const py::array& out) {
  const auto* const first = reinterpret_cast<const char*>(samples.data());
  const auto* const out_first = static_cast<const char*>(out.data());
  const bool apart = first + samples.nbytes() <= out_first || out_first + out.nbytes() <= first;
  return first == out_first || apart ? samples : Table<Real>(samples.attr("copy")());
}
