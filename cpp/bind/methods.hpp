// SPDX-License-Identifier: MIT
#pragma once

// How a C++ class gets its Python methods. pybind11's dispatcher looks at each argument through a caster and at each
// overload in turn: 60 to 100 ns a call, ten times the estimator's own work, and it leaves no signature to be asked
// for. Here methods are the interpreter's own descriptors, which get the arguments as they lie on its stack, and whose
// doc "name($self, a, b=None, /)\n--\n\n..." is the only place where a parameter is named. A descriptor has checked
// that self is of the type; left to check is that __init__ was called.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "module.hpp"

namespace methods {

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

template <class T>
T& reference(py::handle self) {
  T* const object = object_of<T>(self.ptr());
  if (!object) {
    throw py::error_already_set();
  }
  return *object;
}

/// What float(value) gives: integers, numpy's scalars. An integer beyond a double is a value out of range.
inline double converted(PyObject* value, const std::string& name) {
  const double result = PyFloat_AsDouble(value);
  if (result == -1.0 && PyErr_Occurred()) {
    if (PyErr_ExceptionMatches(PyExc_OverflowError)) {
      PyErr_Clear();
      throw py::value_error(name + ": got an integer beyond the range of a float, allowed: real numbers");
    }
    if (PyErr_ExceptionMatches(PyExc_TypeError)) {
      PyErr_Clear();
      throw py::type_error(name + ": got " + py::repr(value).cast<std::string>() + ", allowed: a number");
    }
    throw py::error_already_set();
  }
  return result;
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

/// What `call` returns, as a new reference.
template <class Call>
PyObject* result_of(Call&& call) {
  using Result = decltype(call());
  if constexpr (std::is_void_v<Result>) {
    call();
    Py_RETURN_NONE;
  } else if constexpr (std::is_base_of_v<py::object, std::decay_t<Result>>) {
    py::object result = call();
    return result.release().ptr();
  } else {
    return py::cast(call()).release().ptr();
  }
}

/// The parameters in a method's doc, without self.
struct Parameters {
  std::vector<std::string> names;
  std::size_t required = 0, by_place_only = 0;

  explicit Parameters(const std::string& doc) {
    const std::size_t end = doc.find(")\n--");
    for (std::size_t at = doc.find('(') + 1; at < end;) {
      const std::size_t next = std::min(doc.find(", ", at), end);
      const std::string parameter = doc.substr(at, next - at);
      at = next + 2;
      if (parameter == "/") {
        by_place_only = names.size();
      } else if (parameter != "$self") {
        names.push_back(parameter.substr(0, parameter.find('=')));
        required += names.back() == parameter;
      }
    }
  }

  /// `arguments` in the order of the names, by place and by name; null for those that were not given.
  template <std::size_t Count>
  std::array<PyObject*, Count> in_order(PyObject* const* arguments, std::size_t count, PyObject* keywords) const {
    std::array<PyObject*, Count> ordered{};
    const auto refuse = [](const std::string& what) { throw py::type_error(what); };
    if (count > Count) {
      refuse("takes at most " + std::to_string(Count) + " arguments (" + std::to_string(count) + " given)");
    }
    std::copy(arguments, arguments + count, ordered.begin());
    const py::ssize_t named = keywords ? PyTuple_GET_SIZE(keywords) : 0;
    for (py::ssize_t k = 0; k < named; ++k) {
      const auto name = py::handle(PyTuple_GET_ITEM(keywords, k)).cast<std::string>();
      std::size_t place = by_place_only;
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
        refuse("missing required argument: '" + names[place] + "'");
      }
    }
    return ordered;
  }
};

/// The types of a function that is a method: what comes first, and the others.
template <class Function>
struct Form;
template <class Result, class Self, class... Arguments>
struct Form<Result (*)(Self, Arguments...)> {
  using type = void(Self, Arguments...);
};
template <class Result, class Class, class... Arguments>
struct Form<Result (Class::*)(Arguments...)> {
  using type = void(Class&, Arguments...);
};
template <class Result, class Class, class... Arguments>
struct Form<Result (Class::*)(Arguments...) const> {
  using type = void(const Class&, Arguments...);
};

/// First the C++ object, or the Python object around it; then numbers only, by place, or Python objects only, None for
/// those that were not given.
template <class T, auto Function, class Types = typename Form<decltype(Function)>::type>
struct Method;

template <class T, auto Function, class Self, class... Arguments>
struct Method<T, Function, void(Self, Arguments...)> {
  static constexpr std::size_t size = sizeof...(Arguments);
  static constexpr bool numbers = size > 0 && (std::is_same_v<Arguments, double> && ...);
  static inline std::unique_ptr<const Parameters> parameters;

  template <class Values, std::size_t... Index>
  static PyObject* run(PyObject* self, T& object, const Values& values, std::index_sequence<Index...>) {
    return result_of([&]() -> decltype(auto) {
      if constexpr (std::is_same_v<Self, py::handle>) {
        return Function(py::handle(self), values[Index]...);
      } else {
        return std::invoke(Function, object, values[Index]...);
      }
    });
  }

  static PyObject* of_numbers(PyObject* self, PyObject* const* arguments, Py_ssize_t count) {
    if (count != static_cast<Py_ssize_t>(size)) {
      PyErr_Format(PyExc_TypeError, "takes exactly %zu numbers (%zd given)", size, count);
      return nullptr;
    }
    T* const object = object_of<T>(self);
    return !object ? nullptr : guarded([&] {
      std::array<double, size> values;
      for (std::size_t i = 0; i < size; ++i) {
        PyObject* const given = arguments[i];
        values[i] = PyFloat_CheckExact(given) ? PyFloat_AS_DOUBLE(given) : converted(given, parameters->names[i]);
      }
      return run(self, *object, values, std::make_index_sequence<size>());
    });
  }

  static PyObject* of_one(PyObject* self, PyObject* argument) {
    T* const object = object_of<T>(self);
    return !object ? nullptr : guarded([&] {
      return run(self, *object, std::array<py::handle, size>{argument}, std::make_index_sequence<size>());
    });
  }

  static PyObject* of_objects(PyObject* self, PyObject* const* arguments, Py_ssize_t count, PyObject* keywords) {
    T* const object = object_of<T>(self);
    return !object ? nullptr : guarded([&] {
      const auto given = static_cast<std::size_t>(PyVectorcall_NARGS(static_cast<std::size_t>(count)));
      const auto values = parameters->template in_order<size>(arguments, given, keywords);
      std::array<py::handle, size> handles;
      for (std::size_t i = 0; i < size; ++i) {
        handles[i] = values[i] ? values[i] : Py_None;
      }
      return run(self, *object, handles, std::make_index_sequence<size>());
    });
  }
};

inline void add(const py::object& type, const std::string& name, PyObject* descriptor) {
  if (!descriptor) {
    throw py::error_already_set();
  }
  py::setattr(type, name.c_str(), py::reinterpret_steal<py::object>(descriptor));
}

template <class F>
PyCFunction as_method(F function) {
  return reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(function));
}

/// A definition that lives as long as the process, as descriptors need it.
inline PyMethodDef& definition(const char* doc, PyCFunction function, int flags) {
  static std::deque<std::pair<std::string, PyMethodDef>> kept;
  auto& [name, method] = kept.emplace_back(std::string(doc, std::strchr(doc, '(')), PyMethodDef{});
  method = {name.c_str(), function, flags, doc};
  return method;
}

/// Put a method on the type, with the name, the parameters and the text of `doc`.
template <auto Function, class T>
void define(py::class_<T>& type, const char* doc) {
  using M = Method<T, Function>;
  PyMethodDef* method;
  M::parameters = std::make_unique<const Parameters>(doc);
  if constexpr (M::numbers) {
    method = &definition(doc, as_method(&M::of_numbers), METH_FASTCALL);
  } else {
    method = &definition(doc, as_method(&M::of_objects), METH_FASTCALL | METH_KEYWORDS);
    if constexpr (M::size == 1) {
      if (M::parameters->by_place_only == 1) {
        method->ml_meth = &M::of_one;
        method->ml_flags = METH_O;
      }
    }
  }
  add(type, method->ml_name, PyDescr_NewMethod(reinterpret_cast<PyTypeObject*>(type.ptr()), method));
}

template <class T, auto Get>
PyObject* got(PyObject* self, void*) {
  const T* const object = object_of<T>(self);
  return !object ? nullptr : guarded([&] { return result_of([&] { return std::invoke(Get, *object); }); });
}

/// Put a property on the type: Get is a member, or a function of the object.
template <auto Get, class T>
void property(py::class_<T>& type, const char* name, const char* doc) {
  static std::deque<PyGetSetDef> kept;
  auto& definition = kept.emplace_back(PyGetSetDef{name, &got<T, Get>, nullptr, doc, nullptr});
  add(type, name, PyDescr_NewGetSet(reinterpret_cast<PyTypeObject*>(type.ptr()), &definition));
}

}  // namespace methods

// How a prompt and a notebook show an object: palpate.display writes it, from what any caller can read.
namespace display {

enum class Kind { estimator, touch, tracker };

/// A function of palpate.display.text or of palpate.display.cards, applied to the object.
template <Kind kind>
py::object written(const char* module, py::handle self) {
  constexpr const char* names[] = {"estimator", "touch", "tracker"};
  return py::module_::import(module).attr(names[static_cast<int>(kind)])(self);
}
template <Kind kind>
py::object text(py::handle self) {
  return written<kind>("palpate.display.text", self);
}
template <Kind kind>
py::object html(py::handle self) {
  return written<kind>("palpate.display.cards", self);
}

template <Kind kind, class T>
void define(py::class_<T>& type) {
  methods::define<&text<kind>>(type, "__repr__($self, /)\n--\n\n");
  methods::define<&html<kind>>(type, "_repr_html_($self)\n--\n\n");
}

}  // namespace display
