// SPDX-License-Identifier: MIT
#pragma once

// What a block call accepts: one-dimensional arrays of real numbers, of any stride and type that numpy converts; and
// an `out` that is exactly what will be written into it. numpy is imported by the first of these calls, not before.

#include <pybind11/gil_safe_call_once.h>
#include <pybind11/numpy.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <utility>

#include "bind.hpp"

constexpr int aligned = py::detail::npy_api::NPY_ARRAY_ALIGNED_;
template <class Real>
using Samples = py::array_t<Real, py::array::forcecast | aligned>;

/// What Make() gives, made by the first call and kept for as long as the process lives.
template <auto Make>
const py::dtype& once() {
  static py::gil_safe_call_once_and_store<py::dtype> storage;
  return storage.call_once_and_store_result([] { return Make(); }).get_stored();
}

inline std::string shape_of(const py::array& array) { return py::str(array.attr("shape")).cast<std::string>(); }

inline void require_shape(const py::array& array, const std::string& name, py::ssize_t size) {
  if (array.ndim() != 1 || (size >= 0 && array.shape(0) != size)) {
    const std::string allowed = size < 0 ? "one dimension" : "shape (" + std::to_string(size) + ",)";
    throw py::value_error(name + ": got shape " + shape_of(array) + ", allowed: " + allowed);
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
/// size < 0: any length.
template <class Real>
Samples<Real> samples_of(const py::object& value, const std::string& name, py::ssize_t size = -1) {
  const py::array array = real_array(value, name);
  require_shape(array, name, size);
  return Samples<Real>(py::object(array));
}

/// `out` as the array that it must be, of any shape.
inline py::array writeable_array(const py::object& out, const py::dtype& dtype) {
  if (!py::isinstance<py::array>(out)) {
    throw py::type_error("out: got " + py::str(py::type::of(out)).cast<std::string>() + ", allowed: a numpy array");
  }
  auto array = py::reinterpret_borrow<py::array>(out);
  if (!array.dtype().equal(dtype)) {
    throw py::type_error("out: got dtype " + py::str(array.dtype()).cast<std::string>() +
                         ", allowed: " + py::str(dtype).cast<std::string>());
  }
  if (!array.writeable() || !(array.flags() & aligned)) {
    throw py::value_error("out: got a read-only or unaligned array, allowed: a writeable, aligned one");
  }
  return array;
}

/// `out` itself, checked, or a new array where it is None.
inline py::array output_array(const py::object& out, const py::dtype& dtype, py::ssize_t size) {
  if (out.is_none()) {
    return py::array(dtype, size);
  }
  py::array array = writeable_array(out, dtype);
  require_shape(array, "out", size);
  if (array.strides(0) == 0 && size > 1) {
    throw py::value_error("out: got an array whose items share one place, allowed: a place for each");
  }
  return array;
}

/// The addresses [first, last) that a one-dimensional array covers.
inline std::pair<std::uintptr_t, std::uintptr_t> extent(const py::array& array) {
  const auto first = reinterpret_cast<std::uintptr_t>(array.data());
  const auto span = static_cast<std::uintptr_t>(std::abs(array.strides(0)) * (array.shape(0) - 1));
  const auto size = static_cast<std::uintptr_t>(array.itemsize());
  return array.strides(0) < 0 ? std::pair{first - span, first + size} : std::pair{first, first + span + size};
}

/// Writing out[i] must not change a sample that is read later: where `out` overlaps `samples` in any other way than
/// lying exactly over it, the samples are copied first.
template <class Real>
Samples<Real> apart_from(Samples<Real> samples, const py::array& out) {
  if (samples.size() == 0 || (samples.data() == out.data() && samples.strides(0) == out.strides(0))) {
    return samples;
  }
  const auto [first, last] = extent(samples);
  const auto [out_first, out_last] = extent(out);
  if (last <= out_first || out_last <= first) {
    return samples;
  }
  return Samples<Real>(samples.attr("copy")());
}

/// Run a loop over n samples, other Python threads going on meanwhile where that is worth the hand-over.
template <class Loop>
void run_block(py::ssize_t size, Loop&& loop) {
  if (size < 4096) {
    loop();
    return;
  }
  const py::gil_scoped_release release;
  loop();
}
