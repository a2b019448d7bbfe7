// SPDX-License-Identifier: MIT
#pragma once

// What a block call accepts: arrays of real numbers, of any stride and type that numpy converts; and an `out` that is
// exactly what will be written into it. Arrays of the right type are read and written where they are. numpy is imported
// by the first of these calls, not before.

#include <pybind11/gil_safe_call_once.h>
#include <pybind11/numpy.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "methods.hpp"

constexpr int aligned = py::detail::npy_api::NPY_ARRAY_ALIGNED_;
constexpr int writeable = py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
/// Lengths; -1 for any.
using Shape = std::vector<py::ssize_t>;
constexpr py::ssize_t no_axis = -2;

/// The shape with only the axes that are there.
inline Shape axes(Shape lengths) {
  lengths.erase(std::remove(lengths.begin(), lengths.end(), no_axis), lengths.end());
  return lengths;
}

/// What Make() gives, made by the first call and kept for as long as the process lives.
template <auto Make>
const py::dtype& once() {
  static py::gil_safe_call_once_and_store<py::dtype> storage;
  return storage.call_once_and_store_result([] { return Make(); }).get_stored();
}

/// A structured dtype of an item of this size. PYBIND11_NUMPY_DTYPE would register it for the whole process.
using Fields = std::vector<py::detail::field_descriptor>;
inline py::dtype dtype_of(const Fields& fields, py::ssize_t size, bool is_aligned = false) {
  py::list names, formats, offsets;
  for (const auto& field : fields) {
    names.append(field.name);
    formats.append(field.descr);
    offsets.append(field.offset);
  }
  const py::dict all(py::arg("names") = names, py::arg("formats") = formats, py::arg("offsets") = offsets,
                     py::arg("itemsize") = size);
  return py::module_::import("numpy").attr("dtype")(all, py::arg("align") = is_aligned);
}

inline std::string shape_of(const py::array& array) { return "shape " + text_of(array.attr("shape")); }
inline std::string dtype_name(const py::array& array) { return "dtype " + text_of(array.dtype()); }

inline void require_shape(const py::array& array, const char* name, const Shape& shape) {
  const auto fits = [](py::ssize_t wanted, py::ssize_t found) { return wanted < 0 || wanted == found; };
  if (std::equal(shape.begin(), shape.end(), array.shape(), array.shape() + array.ndim(), fits)) {
    return;
  }
  std::string allowed;
  for (const py::ssize_t length : shape) {
    allowed += (allowed.empty() ? "" : " ") + (length < 0 ? "n" : std::to_string(length)) + ",";
  }
  allowed.resize(allowed.size() - (shape.size() > 1));
  refuse<value_error>(name, shape_of(array), "(" + allowed + ")");
}

/// `value` as an array of real numbers; numpy's own error where it cannot make an array of it. A masked value is none.
inline py::array real_array(const py::object& value, const char* name) {
  const bool plain_array = Py_TYPE(value.ptr()) == py::detail::npy_api::get().PyArray_Type_;
  const bool masked = !plain_array && py::hasattr(value, "mask") && py::hasattr(value, "filled");
  const py::object plain = masked ? value.attr("astype")("float64").attr("filled")(py::float_(NAN)) : value;
  py::array array(plain);
  if (std::string("biuf").find(array.dtype().kind()) == std::string::npos) {
    refuse<type_error>(name, dtype_name(array), "real numbers");
  }
  return array;
}

/// With an array of shape (n,) where one column is wanted, of shape (n, 1), the column.
inline py::array as_column(const py::array& array, const Shape& shape) {
  const bool one_column = shape.size() == 2 && shape[1] == 1 && array.ndim() == 1;
  const bool fits = one_column && (shape[0] < 0 || shape[0] == array.shape(0));
  return fits ? py::array(array).reshape({array.shape(0), py::ssize_t{1}}) : array;
}

/// `value` as an array that the loops can read: the caller's own where its type allows it, a copy elsewhere.
template <class Real, int flags = 0>
py::array samples_of(const py::object& value, const char* name, const Shape& shape) {
  constexpr int needed = flags | aligned;
  const py::array array = as_column(real_array(value, name), shape);
  require_shape(array, name, shape);
  const bool fits = array.dtype().is(once<&py::dtype::of<Real>>()) && (array.flags() & needed) == needed;
  return fits ? array : py::array_t<Real, py::array::forcecast | needed>(array);
}

/// Whether samples_of takes this for an array of shape (size,) as it is, found without another object.
template <class Real>
bool is_plain(py::handle value, py::ssize_t size) {
  const auto* const array = py::detail::array_proxy(value.ptr());
  return Py_TYPE(value.ptr()) == py::detail::npy_api::get().PyArray_Type_ && array->nd == 1 &&
         array->dimensions[0] == size && array->descr == once<&py::dtype::of<Real>>().ptr() && (array->flags & aligned);
}

/// `out` itself, checked, or a new array where it is None.
inline py::array output_array(const py::object& out, const py::dtype& dtype, const Shape& shape, int flags = 0) {
  if (out.is_none()) {
    return py::array(dtype, shape);
  }
  if (!py::isinstance<py::array>(out)) {
    refuse<type_error>("out", py::type::of(out), "a numpy array");
  }
  auto array = py::reinterpret_borrow<py::array>(out);
  if (!array.dtype().equal(dtype)) {
    refuse<type_error>("out", dtype_name(array), text_of(dtype));
  }
  if (!array.writeable() || !(array.flags() & aligned)) {
    refuse<value_error>("out", "a read-only or unaligned array", "a writeable, aligned one");
  }
  require_shape(array, "out", shape);
  if ((array.flags() & flags) != flags) {
    refuse<value_error>("out", shape_of(array) + ", strided", "a contiguous array");
  }
  if (array.strides(0) == 0 && array.shape(0) > 1) {
    refuse<value_error>("out", "an array whose items share one place", "a place for each");
  }
  return array;
}

/// The addresses [first, last) that an array covers: contiguous, or of one dimension.
inline std::pair<std::intptr_t, std::intptr_t> extent(const py::array& array) {
  const auto begin = reinterpret_cast<std::intptr_t>(array.data());
  const py::ssize_t span = (array.ndim() == 1 ? array.strides(0) : array.itemsize()) * (array.size() - 1);
  return {std::min(begin, begin + span), std::max(begin, begin + span) + array.itemsize()};
}

/// Writing out[i] must not change a sample that is read later: where `out` overlaps `samples` in any other way than
/// lying exactly over it, the samples are copied first.
inline py::array apart_from(const py::array& samples, const py::array& out) {
  const bool same = samples.size() == 0 || (samples.data() == out.data() && samples.strides(0) == out.strides(0));
  const auto [first, last] = extent(samples);
  const auto [out_first, out_last] = extent(out);
  return same || last <= out_first || out_last <= first ? samples : py::array(samples.attr("copy")());
}

/// Run a loop over n samples, other Python threads going on meanwhile where that is worth the hand-over.
template <class Loop>
void run_block(py::ssize_t size, Loop&& loop, py::ssize_t least = 4096) {
  if (size < least) {
    loop();
    return;
  }
  const py::gil_scoped_release release;
  loop();
}

/// Items at equal distances, in the memory of an array.
template <class Item>
struct View {
  py::array kept;
  char* data;
  py::ssize_t stride, size;

  explicit View(py::array array)
      : kept(std::move(array)),
        data(const_cast<char*>(static_cast<const char*>(kept.data()))),
        stride(kept.strides(0)),
        size(kept.shape(0)) {}
  Item& operator[](py::ssize_t i) const { return *static_cast<Item*>(static_cast<void*>(data + i * stride)); }
  Item* items() const { return &(*this)[0]; }
};
