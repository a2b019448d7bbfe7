// SPDX-License-Identifier: MIT
#pragma once

// What a block call accepts: arrays of real numbers, of any stride and type that numpy converts; and an `out` that is
// exactly what will be written into it. Arrays of the right type that lie dense in memory are read and written where
// they are, without a Python object being made on the way. numpy is imported by the first of these calls, not before.

#include <pybind11/gil_safe_call_once.h>
#include <pybind11/numpy.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "module.hpp"

constexpr int aligned = py::detail::npy_api::NPY_ARRAY_ALIGNED_;
constexpr int writeable = py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
template <class Real, int flags = 0>
using Samples = py::array_t<Real, py::array::forcecast | aligned | flags>;

/// What Make() gives, made by the first call and kept for as long as the process lives.
template <auto Make>
const py::dtype& once() {
  static py::gil_safe_call_once_and_store<py::dtype> storage;
  return storage.call_once_and_store_result([] { return Make(); }).get_stored();
}

/// A structured dtype, field by field. PYBIND11_NUMPY_DTYPE would register it for the whole process.
struct Column {
  const char* name;
  py::dtype type;
  std::size_t offset;
};
#define PALPATE_COLUMN(Row, field) \
  Column { #field, py::dtype::of<decltype(Row::field)>(), offsetof(Row, field) }

template <class Row>
py::dtype dtype_of(std::initializer_list<Column> columns) {
  py::list names, formats, offsets;
  for (const Column& column : columns) {
    names.append(column.name);
    formats.append(column.type);
    offsets.append(column.offset);
  }
  return py::dtype(names, formats, offsets, sizeof(Row));
}

inline std::string shape_of(const py::array& array) { return py::str(array.attr("shape")).cast<std::string>(); }

/// Lengths; -1 for any.
using Shape = std::vector<py::ssize_t>;

inline void require_shape(const py::array& array, const std::string& name, const Shape& shape) {
  bool right = array.ndim() == static_cast<py::ssize_t>(shape.size());
  std::string allowed;
  for (std::size_t i = 0; i < shape.size(); ++i) {
    right = right && (shape[i] < 0 || array.shape(static_cast<py::ssize_t>(i)) == shape[i]);
    allowed += (i > 0 ? " " : "") + (shape[i] < 0 ? "n" : std::to_string(shape[i])) + ",";
  }
  if (!right) {
    allowed.resize(allowed.size() - (shape.size() > 1));
    throw py::value_error(name + ": got shape " + shape_of(array) + ", allowed: (" + allowed + ")");
  }
}

/// `value` as an array of real numbers; numpy's own error where it cannot make an array of it. A masked value is none.
inline py::array real_array(const py::object& value, const std::string& name) {
  const bool masked = py::hasattr(value, "mask") && py::hasattr(value, "filled");
  const py::object plain = masked ? value.attr("astype")("float64").attr("filled")(py::float_(NAN)) : value;
  py::array array(plain);
  if (std::string("biuf").find(array.dtype().kind()) == std::string::npos) {
    throw py::type_error(name + ": got dtype " + py::str(array.dtype()).cast<std::string>() +
                         ", allowed: real numbers");
  }
  return array;
}

/// `value` as an array that the loops can read: the caller's own memory where its type allows it, a copy elsewhere.
template <class Real, int flags = 0>
Samples<Real, flags> samples_of(const py::object& value, const std::string& name, const Shape& shape) {
  const py::array array = real_array(value, name);
  require_shape(array, name, shape);
  return Samples<Real, flags>(py::object(array));
}

/// `out` itself, checked, or a new array where it is None.
inline py::array output_array(const py::object& out, const py::dtype& dtype, const Shape& shape, int flags = 0) {
  if (out.is_none()) {
    return py::array(dtype, shape);
  }
  if (!py::isinstance<py::array>(out)) {
    throw py::type_error("out: got " + py::str(py::type::of(out)).cast<std::string>() + ", allowed: a numpy array");
  }
  auto array = py::reinterpret_borrow<py::array>(out);
  if (!array.dtype().equal(dtype)) {
    throw py::type_error("out: got dtype " + py::str(array.dtype()).cast<std::string>() +
                         ", allowed: " + py::str(py::handle(dtype)).cast<std::string>());
  }
  if (!array.writeable() || !(array.flags() & aligned)) {
    throw py::value_error("out: got a read-only or unaligned array, allowed: a writeable, aligned one");
  }
  require_shape(array, "out", shape);
  if ((array.flags() & flags) != flags) {
    throw py::value_error("out: got shape " + shape_of(array) + ", strided, allowed: a contiguous array");
  }
  if (array.strides(0) == 0 && shape[0] > 1) {
    throw py::value_error("out: got an array whose items share one place, allowed: a place for each");
  }
  return array;
}

/// The addresses [first, last) that an array covers: contiguous, or of one dimension.
inline std::pair<std::uintptr_t, std::uintptr_t> extent(const py::array& array) {
  const auto first = reinterpret_cast<std::uintptr_t>(array.data());
  const py::ssize_t stride = array.ndim() == 1 ? array.strides(0) : array.itemsize();
  const auto span = static_cast<std::uintptr_t>(std::abs(stride) * (array.size() - 1));
  const auto size = static_cast<std::uintptr_t>(array.itemsize());
  return stride < 0 ? std::pair{first - span, first + size} : std::pair{first, first + span + size};
}

/// Writing out[i] must not change a sample that is read later: where `out` overlaps `samples` in any other way than
/// lying exactly over it, the samples are copied first.
template <class Array>
Array apart_from(const Array& samples, const py::array& out) {
  const bool same = samples.size() == 0 || (samples.data() == out.data() && samples.strides(0) == out.strides(0));
  const auto [first, last] = extent(samples);
  const auto [out_first, out_last] = extent(out);
  return same || last <= out_first || out_last <= first ? samples : Array(samples.attr("copy")());
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

/// Items at equal distances, in memory that someone else keeps.
template <class Item>
struct View {
  char* data = nullptr;
  py::ssize_t stride = 0, size = -1;

  Item& operator[](py::ssize_t i) const { return *static_cast<Item*>(static_cast<void*>(data + i * stride)); }
  bool dense() const { return stride == static_cast<py::ssize_t>(sizeof(Item)) || size < 2; }
  Item* items() const { return static_cast<Item*>(static_cast<void*>(data)); }

  static View of(const py::array& array) {
    return {const_cast<char*>(static_cast<const char*>(array.data())), array.strides(0), array.shape(0)};
  }
};

/// The items of `value` where it is a one-dimensional, aligned array of exactly this dtype; else size < 0.
template <class Item>
View<Item> strided_view(py::handle value, py::handle dtype, int flags = 0) {
  const auto& api = py::detail::npy_api::get();
  if (Py_TYPE(value.ptr()) != api.PyArray_Type_) {
    return {};
  }
  const auto* const array = py::detail::array_proxy(value.ptr());
  const int needed = flags | aligned;
  if (array->nd != 1 || array->descr != dtype.ptr() || (array->flags & needed) != needed) {
    return {};
  }
  return {array->data, array->strides[0], array->dimensions[0]};
}

/// The same where it is dense, too.
template <class Item>
View<Item> dense_view(py::handle value, py::handle dtype, int flags = 0) {
  return strided_view<Item>(value, dtype, flags | py::array::c_style);
}

/// Whether neither covers a part of the other, or both lie in exactly the same place.
template <class Item, class Out>
bool apart(const View<Item>& samples, const View<Out>& out) {
  return (samples.data == out.data && sizeof(Item) == sizeof(Out)) ||
         samples.data + samples.size * samples.stride <= out.data || out.data + out.size * out.stride <= samples.data;
}

/// What a block call works on, and what keeps it alive.
template <class Real, class Item>
struct Block {
  View<Real> output, regressor;
  View<Item> out;
  py::object result, kept_output, kept_regressor;

  Block(py::handle output_given, py::handle regressor_given, py::handle out_given, const py::dtype& real,
        const py::dtype& item)
      : output(dense_view<Real>(output_given, real)),
        regressor(dense_view<Real>(regressor_given, real)),
        out(dense_view<Item>(out_given, item, writeable)) {
    const bool plain = output.size >= 0 && output.size == regressor.size && output.size == out.size;
    if (plain && apart(output, out) && apart(regressor, out)) {
      result = py::reinterpret_borrow<py::object>(out_given);
      kept_output = py::reinterpret_borrow<py::object>(output_given);
      kept_regressor = py::reinterpret_borrow<py::object>(regressor_given);
    } else {
      convert(py::reinterpret_borrow<py::object>(output_given), py::reinterpret_borrow<py::object>(regressor_given),
              py::reinterpret_borrow<py::object>(out_given), item);
    }
  }

  /// Call `loop` with three things that have items by [i], and their number.
  template <class Loop>
  void run(Loop&& loop) const {
    run_block(out.size, [&] {
      if (output.dense() && regressor.dense() && out.dense()) {
        loop(static_cast<const Real*>(output.items()), static_cast<const Real*>(regressor.items()), out.items(),
             out.size);
      } else {
        loop(output, regressor, out, out.size);
      }
    });
  }

 private:
  void convert(const py::object& output_given, const py::object& regressor_given, const py::object& out_given,
               const py::dtype& item) {
    const auto y = samples_of<Real>(output_given, "output", {-1});
    const auto x = samples_of<Real>(regressor_given, "regressor", {y.shape(0)});
    const py::array written = output_array(out_given, item, {y.shape(0)});  // last: an __array__ may have changed it
    const auto outputs = apart_from(y, written), regressors = apart_from(x, written);
    output = View<Real>::of(outputs);
    regressor = View<Real>::of(regressors);
    out = View<Item>::of(written);
    kept_output = outputs;
    kept_regressor = regressors;
    result = written;
  }
};
