// SPDX-License-Identifier: MIT
#pragma once

// Methods that are called for every sample, or for a few. pybind11's dispatcher looks at each argument through a caster
// and at each overload in turn: 60 to 100 ns a call, ten times the estimator's own work. A METH_FASTCALL method on the
// same type gets the arguments as they lie on the interpreter's stack. The method descriptor has checked that self is
// of the type; left to check is that __init__ was called.

#include <array>
#include <cstddef>
#include <cstring>
#include <exception>
#include <utility>

#include "bind.hpp"

namespace fastcall {

/// The C++ object in `self`; null, with a Python error set, where __init__ was not called.
template <class T>
T* object_of(PyObject* self) {
  auto* const instance = reinterpret_cast<py::detail::instance*>(self);
  void* value;
  if (instance->simple_layout) {
    value = instance->simple_value_holder[0];
  } else {  // a Python class with several bound bases
    value = instance->get_value_and_holder(py::detail::get_type_info(typeid(T))).value_ptr();
  }
  if (!value) {
    PyErr_Format(PyExc_TypeError, "%s.__init__() has not been called", Py_TYPE(self)->tp_name);
  }
  return static_cast<T*>(value);
}

/// What float(value) gives: floats, integers, numpy's scalars. An integer beyond a double is a value out of range.
inline double to_double(PyObject* value) {
  if (PyFloat_CheckExact(value)) {
    return PyFloat_AS_DOUBLE(value);
  }
  const double result = PyFloat_AsDouble(value);
  if (result == -1.0 && PyErr_Occurred()) {
    if (PyErr_ExceptionMatches(PyExc_OverflowError)) {
      PyErr_Clear();
      throw py::value_error("got an integer beyond the range of a float, allowed: real numbers");
    }
    throw py::error_already_set();
  }
  return result;
}

/// `arguments` in the order of `names`, by position and by name; null for those that were not given.
template <std::size_t Count>
std::array<PyObject*, Count> in_order(const std::array<const char*, Count>& names, std::size_t required,
                                      PyObject* const* arguments, std::size_t count, PyObject* keywords) {
  std::array<PyObject*, Count> ordered{};
  const auto refuse = [](const std::string& what) { throw py::type_error(what); };
  if (count > Count) {
    refuse("takes at most " + std::to_string(Count) + " arguments (" + std::to_string(count) + " given)");
  }
  std::copy(arguments, arguments + count, ordered.begin());
  const py::ssize_t named = keywords ? PyTuple_GET_SIZE(keywords) : 0;
  for (py::ssize_t k = 0; k < named; ++k) {
    const auto name = py::handle(PyTuple_GET_ITEM(keywords, k)).cast<std::string>();
    std::size_t place = 0;
    while (place < Count && name != names[place]) {
      ++place;
    }
    if (place == Count) {
      refuse("got an unexpected keyword argument '" + name + "'");
    } else if (ordered[place]) {
      refuse("got multiple values for argument '" + name + "'");
    } else {
      ordered[place] = arguments[count + static_cast<std::size_t>(k)];
    }
  }
  for (std::size_t place = 0; place < required; ++place) {
    if (!ordered[place]) {
      refuse(std::string("missing required argument: '") + names[place] + "'");
    }
  }
  return ordered;
}

/// Run `work`, which returns a new reference; its C++ exceptions become Python's.
template <class Work>
PyObject* guarded(Work&& work) {
  try {
    return work();
  } catch (py::error_already_set& error) {
    error.restore();
  } catch (const py::builtin_exception& error) {
    error.set_error();
  } catch (const std::bad_alloc&) {
    PyErr_NoMemory();
  } catch (const std::exception& error) {
    PyErr_SetString(PyExc_RuntimeError, error.what());
  }
  return nullptr;
}

template <class T, auto Function, std::size_t... Index>
PyObject* call_numbers(T& object, PyObject* const* arguments, std::index_sequence<Index...>) {
  const double values[] = {to_double(arguments[Index])...};
  return Function(object, values[Index]...);
}

/// A method of Count numbers, positional only: Function is PyObject* (*)(T&, double, ...).
template <class T, std::size_t Count, auto Function>
PyObject* numbers(PyObject* self, PyObject* const* arguments, Py_ssize_t count) {
  if (count != static_cast<Py_ssize_t>(Count)) {
    PyErr_Format(PyExc_TypeError, "takes exactly %zu numbers (%zd given)", Count, count);
    return nullptr;
  }
  T* const object = object_of<T>(self);
  return !object ? nullptr : guarded([&] {
    return call_numbers<T, Function>(*object, arguments, std::make_index_sequence<Count>());
  });
}

/// A method of two arrays and where the result goes: Function is PyObject* (*)(T&, output, regressor, out).
template <class T, auto Function>
PyObject* block(PyObject* self, PyObject* const* arguments, Py_ssize_t count, PyObject* keywords) {
  T* const object = object_of<T>(self);
  return !object ? nullptr : guarded([&] {
    const auto [output, regressor, out] =
        in_order<3>({"output", "regressor", "out"}, 2, arguments,
                    static_cast<std::size_t>(PyVectorcall_NARGS(static_cast<std::size_t>(count))), keywords);
    return Function(*object, output, regressor, out ? out : Py_None);
  });
}

/// A method of one object: Function is PyObject* (*)(T&, py::handle).
template <class T, auto Function>
PyObject* single(PyObject* self, PyObject* argument) {
  T* const object = object_of<T>(self);
  return !object ? nullptr : guarded([&] { return Function(*object, argument); });
}

/// Put a method on the type. Its doc begins with "name($self, a, b, /)\n--\n\n", which becomes the signature.
template <class T>
void put(py::class_<T>& type, PyMethodDef& method) {
  PyObject* const descriptor = PyDescr_NewMethod(reinterpret_cast<PyTypeObject*>(type.ptr()), &method);
  if (!descriptor) {
    throw py::error_already_set();
  }
  type.attr(method.ml_name) = py::reinterpret_steal<py::object>(descriptor);
}

template <class F>
PyCFunction as_method(F function) {
  return reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(function));
}

template <class T, std::size_t Count, auto Function>
void def_numbers(py::class_<T>& type, const char* name, const char* doc) {
  static PyMethodDef method{name, as_method(&numbers<T, Count, Function>), METH_FASTCALL, doc};
  put(type, method);
}

template <class T, auto Function>
void def_block(py::class_<T>& type, const char* name, const char* doc) {
  static PyMethodDef method{name, as_method(&block<T, Function>), METH_FASTCALL | METH_KEYWORDS, doc};
  put(type, method);
}

template <class T, auto Function>
void def_single(py::class_<T>& type, const char* name, const char* doc) {
  static PyMethodDef method{name, as_method(&single<T, Function>), METH_O, doc};
  put(type, method);
}

}  // namespace fastcall
