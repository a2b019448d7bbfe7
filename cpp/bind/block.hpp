// SPDX-License-Identifier: MIT
#pragma once

// How a block of samples reaches its loop. Arrays of the right type that lie dense in memory are read and written where
// they are, without a Python object being made on the way; everything else goes through arrays.hpp.

#include "arrays.hpp"

/// Items at equal distances, in memory that someone else keeps.
template <class Item>
struct View {
  char* data = nullptr;
  py::ssize_t stride = 0, size = -1;

  Item& operator[](py::ssize_t i) const { return *reinterpret_cast<Item*>(data + i * stride); }
  bool dense() const { return stride == static_cast<py::ssize_t>(sizeof(Item)) || size < 2; }
  Item* items() const { return reinterpret_cast<Item*>(data); }

  static View of(const py::array& array) {
    return {const_cast<char*>(static_cast<const char*>(array.data())), array.strides(0), array.shape(0)};
  }
};

/// The items of `value` where it is a one-dimensional, dense, aligned array of exactly this dtype; else size < 0.
template <class Item>
View<Item> dense_view(py::handle value, py::handle dtype, int flags = 0) {
  const auto& api = py::detail::npy_api::get();
  if (Py_TYPE(value.ptr()) != api.PyArray_Type_) {
    return {};
  }
  const auto* const array = py::detail::array_proxy(value.ptr());
  const int needed = flags | aligned | py::array::c_style;
  if (array->nd != 1 || array->descr != dtype.ptr() || (array->flags & needed) != needed) {
    return {};
  }
  return {array->data, sizeof(Item), array->dimensions[0]};
}

/// Whether neither covers a part of the other, or both lie in exactly the same place.
template <class Item, class Out>
bool apart(const View<Item>& samples, const View<Out>& out) {
  return (samples.data == out.data && sizeof(Item) == sizeof(Out)) ||
         samples.data + samples.size * samples.stride <= out.data || out.data + out.size * out.stride <= samples.data;
}

constexpr int writeable = py::detail::npy_api::NPY_ARRAY_WRITEABLE_;

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
    const auto y = samples_of<Real>(output_given, "output");
    const auto x = samples_of<Real>(regressor_given, "regressor", y.shape(0));
    const py::array written = output_array(out_given, item, y.shape(0));  // last: an __array__ may have changed it
    const auto outputs = apart_from(y, written), regressors = apart_from(x, written);
    output = View<Real>::of(outputs);
    regressor = View<Real>::of(regressors);
    out = View<Item>::of(written);
    kept_output = outputs;
    kept_regressor = regressors;
    result = written;
  }
};
