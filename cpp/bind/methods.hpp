// SPDX-License-Identifier: MIT
#pragma once

// What all bound classes share. A doc begins with the signature, for inspect and help: "name(self, /, a, b=None)\n--\n\n...".

#include <array>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

#include "module.hpp"

namespace methods {

/// As Python prints it, or the beginning of that.
inline std::string shown(py::handle value) {
  return py::module_::import("palpate.messages").attr("quoted")(value).cast<std::string>();
}

/// What float(value) gives. An integer beyond a double is a value out of range.
inline double to_real(py::handle value, const char* name, const char* allowed = "a number") {
  const double result = PyFloat_AsDouble(value.ptr());
  if (result == -1.0 && PyErr_Occurred()) {
    const bool large = PyErr_ExceptionMatches(PyExc_OverflowError);
    if (!large && !PyErr_ExceptionMatches(PyExc_TypeError)) {
      throw py::error_already_set();
    }
    PyErr_Clear();
    if (large) {
      throw py::value_error(std::string(name) + ": got an integer beyond the range of a float, allowed: real numbers");
    }
    throw py::type_error(std::string(name) + ": got " + shown(value) + ", allowed: " + allowed);
  }
  return result;
}

/// The same, without a call for a float.
inline double real_of(PyObject* value, const char* name) {
  return PyFloat_CheckExact(value) ? PyFloat_AS_DOUBLE(value) : to_real(value, name);
}

inline py::ssize_t to_size(py::handle value, const char* name) {
  const py::ssize_t size = PyNumber_AsSsize_t(value.ptr(), nullptr);  // beyond the type: its limits
  if (size == -1 && PyErr_Occurred()) {
    PyErr_Clear();
    throw py::type_error(std::string(name) + ": got " + shown(value) + ", allowed: a whole number");
  }
  return size;
}

/// The end of the docs of what takes numbers.
constexpr auto raises = R"(
Raises
------
TypeError, ValueError
    Arguments of another number, type or shape, or out of range; the message names what is allowed.
RuntimeError
    The object is in use by another thread.
)";

constexpr auto reset_doc = "reset(self, /)\n--\n\nForget all samples; the settings stay.";

inline void* refuse_bare(std::size_t) { throw py::type_error("self: got one whose __init__() has not been called"); }

/// A class with a constructor of these parameters, as "(*, forgetting=0.995)".
///
/// The signature stands twice, as inspect asks for it: of a class whose __init__ is a built-in function it takes the
/// one in the class's doc, and newer ones the one of the function.
template <class T, class Make, class... Extra>
py::class_<T> define_class(py::module_& module, const char* name, const std::string& parameters, const char* doc,
                           Make make, const Extra&... extra) {
  py::class_<T> type(module, name, (name + parameters + "\n--\n\n" + doc).c_str());
  type.attr("__module__") = "palpate";
  // Called for an object without __init__: pybind11 would take memory as it is.
  py::detail::get_type_info(typeid(T))->operator_new = &refuse_bare;
  type.def(py::init(make), ("__init__(self, /, " + parameters.substr(1) + "\n--\n\n").c_str(), extra...);
  const auto reduced = [](const py::object& self, int protocol) {  // at 0 and 1 pybind11 ends the process
    return py::module_::import("builtins").attr("object").attr("__reduce_ex__")(self, protocol < 2 ? 2 : protocol);
  };
  type.def("__reduce_ex__", reduced);
  return type;
}

/// Comparison, a method copy(), and pickling by pickled() and restored(); what a subclass in Python has comes along.
template <class T>
void define_copies(py::class_<T>& type) {
  const auto equal = [](const T& left, const T& right) { return left == right; };
  const auto copy = [](const py::object& self) { return py::module_::import("copy").attr("copy")(self); };
  const auto pickled = [](const py::object& self) -> py::tuple {
    return self.cast<const T&>().pickled() + py::make_tuple(py::getattr(self, "__dict__", py::dict()));
  };
  const auto restored = [](const py::tuple& state) {
    return std::pair(T::restored(state), py::dict(state[state.size() - 1]));
  };
  type.def("__eq__", equal, py::is_operator(), "__eq__(self, other, /)\n--\n\n")
      .def("copy", copy, "copy(self, /)\n--\n\nAn independent one in the same state.")
      .def(py::pickle(pickled, restored));
}

/// How a prompt and a notebook show an object: palpate.display writes it, from what any caller can read.
template <class T>
void define_display(py::class_<T>& type, const char* line, const char* card) {
  const auto written_by = [](const char* module, const char* function) {
    return [=](const py::object& self) { return py::module_::import(module).attr(function)(self); };
  };
  type.def("__repr__", written_by("palpate.display.text", line), "__repr__(self, /)\n--\n\n");
  type.def("_repr_html_", written_by("palpate.display.cards", card), "_repr_html_(self, /)\n--\n\n");
}

template <class T>
T& object_of(PyObject* self) {
  auto* const instance = reinterpret_cast<py::detail::instance*>(self);
  void* const value = instance->simple_layout
                          ? instance->simple_value_holder[0]  // else a Python class with several bound bases
                          : instance->get_value_and_holder(py::detail::get_type_info(typeid(T))).value_ptr();
  if (!value) {
    refuse_bare(sizeof(T));
  }
  return *static_cast<T*>(value);
}

/// A method that is called for each sample: a descriptor of the interpreter, as pybind11's dispatcher takes 60 to 100 ns a
/// call, ten times the estimator's own work. Here the doc says "$self": inspect leaves it out of what is bound.
template <auto Function, class T>
void define_fast(py::class_<T>& type, const char* name, const char* doc) {
  static PyMethodDef definition;
  static std::string text;
  text = std::string(doc) + raises;
  const auto call = [](PyObject* self, PyObject* const* given, Py_ssize_t count) -> PyObject* {
    try {
      auto result = Function(self, given, count);
      using Caster = py::detail::make_caster<decltype(result)>;
      return Caster::cast(std::move(result), py::return_value_policy::move, {}).ptr();
    } catch (py::error_already_set& error) {
      error.restore();
    } catch (...) {
      py::detail::try_translate_exceptions();
    }
    return nullptr;
  };
  PyObject* (*const function)(PyObject*, PyObject* const*, Py_ssize_t) = call;
  definition = {name, reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(function)), METH_FASTCALL,
                text.c_str()};
  auto* const descriptor = PyDescr_NewMethod(reinterpret_cast<PyTypeObject*>(type.ptr()), &definition);
  type.attr(name) = py::reinterpret_steal<py::object>(descriptor);
}

/// The numbers by place that such a method is called with.
template <std::size_t size>
std::array<double, size> numbers_of(PyObject* const* given, Py_ssize_t count,
                                    const std::array<const char*, size>& names) {
  if (count != static_cast<Py_ssize_t>(size)) {
    throw py::type_error("takes exactly " + std::to_string(size) + " numbers (" + std::to_string(count) + " given)");
  }
  std::array<double, size> values;
  for (std::size_t i = 0; i < size; ++i) {
    values[i] = real_of(given[i], names[i]);
  }
  return values;
}

}  // namespace methods

inline void require_idle(bool busy, const char* what) {
  if (busy) {
    throw std::runtime_error(std::string("this ") + what +
                             " is processing a block in another thread: give each thread its own");
  }
}

/// While a block is processed, and other threads may run: made when no code of Python can run before the block.
struct InUse {
  InUse(bool& flag, const char* what) : busy(flag) {
    require_idle(busy, what);
    busy = true;
  }
  InUse(const InUse&) = delete;
  ~InUse() { busy = false; }

  bool& busy;
};
