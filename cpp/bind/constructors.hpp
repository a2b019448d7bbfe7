// SPDX-License-Identifier: MIT
#pragma once

// Constructors that know their keywords, and say so: to inspect, and in the error for a wrong one.

#include "methods.hpp"

namespace methods {

/// Make the C++ object in `self`. A second __init__ changes nothing, as in pybind11.
template <class T, class Make>
void construct(py::handle self, Make&& make) {
  auto* const instance = reinterpret_cast<py::detail::instance*>(self.ptr());
  std::unique_ptr<T> object(new T(make()));
  auto place = instance->get_value_and_holder(py::detail::get_type_info(typeid(T)));
  if (!place.instance_registered()) {
    place.value_ptr() = object.release();
    place.type->init_instance(instance, nullptr);
  }
}

/// __setstate__: Make is T (*)(py::handle self, py::handle state).
template <class T, auto Make>
PyObject* restored(PyObject* self, PyObject* state) {
  return guarded([&] {
    construct<T>(self, [&] { return Make(self, state); });
    Py_RETURN_NONE;
  });
}

template <auto Make, class T>
void define_restore(py::class_<T>& type) {
  auto& method = definition("__setstate__($self, state, /)\n--\n\n", &restored<T, Make>, METH_O);
  add(type, method.ml_name, PyDescr_NewMethod(reinterpret_cast<PyTypeObject*>(type.ptr()), &method));
}

/// What a constructor was given: its one parameter that has a place, null where it was left out, and the others.
struct Given {
  const char* owner;
  py::object first;
  py::dict settings;
};

/// TypeError where settings were given to what has none.
inline void refuse_others(const Given& given, const std::string& allowed) {
  for (const auto& [name, value] : given.settings) {
    throw py::type_error(std::string(given.owner) + ": got an unexpected keyword '" + name.cast<std::string>() +
                         "', allowed: " + allowed);
  }
}

/// A whole number; the caller knows which.
inline py::ssize_t to_size(const char* name, const py::object& value) {
  const py::ssize_t size = PyNumber_AsSsize_t(value.ptr(), nullptr);  // beyond the type: its limits
  if (size == -1 && PyErr_Occurred()) {
    PyErr_Clear();
    throw py::type_error(std::string(name) + ": got " + py::repr(value).cast<std::string>() +
                         ", allowed: a whole number");
  }
  return size;
}

/// __init__: Make is T (*)(const Given&).
template <class T, auto Make>
struct Constructor {
  static inline std::string doc, first;  // first is empty where there is none

  static PyObject* call(PyObject*, PyObject* const* arguments, Py_ssize_t count, PyObject* keywords) {
    const auto* const type = py::detail::get_type_info(typeid(T))->type;
    const char* const owner = std::strrchr(type->tp_name, '.') + 1;
    const auto places = PyVectorcall_NARGS(static_cast<std::size_t>(count));
    if (places < 1 || !PyObject_TypeCheck(arguments[0], const_cast<PyTypeObject*>(type))) {
      PyErr_Format(PyExc_TypeError, "__init__() of %s: got something else as self, allowed: one of these", owner);
      return nullptr;
    }
    return guarded([&] {
      Given given{owner, {}, {}};
      for (py::ssize_t k = 0; keywords && k < PyTuple_GET_SIZE(keywords); ++k) {
        given.settings[PyTuple_GET_ITEM(keywords, k)] = py::handle(arguments[places + k]);
      }
      if (places - 1 > (first.empty() ? 0 : 1)) {
        throw py::type_error(std::string(owner) + ": got too many values without a name, allowed: " +
                             (first.empty() ? "names only" : first + "; the others by name"));
      }
      const bool named = !first.empty() && given.settings.contains(first);
      if (named && places == 2) {
        throw py::type_error(std::string(owner) + ": got " + first + " by place and by name, allowed: one of the two");
      }
      if (named) {
        given.first = given.settings.attr("pop")(first);
      } else if (places == 2) {
        given.first = py::reinterpret_borrow<py::object>(arguments[1]);
      }
      // cppcheck-suppress returnDanglingLifetime ; the object itself is returned
      construct<T>(arguments[0], [&] { return Make(given); });
      Py_RETURN_NONE;
    });
  }
};

/// A class with a constructor of these parameters, as "(streams, *, forgetting=0.995)".
///
/// The signature stands twice, as inspect asks for it: of a class whose __init__ is a built-in function it takes the
/// one in the class's doc, and newer ones that of the function.
template <auto Make>
auto define_class(py::module_& module, const std::string& name, const std::string& parameters, const char* doc) {
  using T = std::invoke_result_t<decltype(Make), const Given&>;
  using C = Constructor<T, Make>;
  py::class_<T> type(module, name.c_str(), (name + parameters + "\n--\n\n" + doc).c_str());
  type.attr("__module__") = "palpate";
  C::doc = "__init__($self, /, " + parameters.substr(1) + "\n--\n\n";
  C::first = parameters[1] == '*' ? "" : parameters.substr(1, parameters.find_first_of(",=)") - 1);
  auto& method = definition(C::doc.c_str(), as_method(&C::call), METH_FASTCALL | METH_KEYWORDS);
  const auto function = py::reinterpret_steal<py::object>(PyCFunction_New(&method, nullptr));
  add(type, "__init__", function ? PyInstanceMethod_New(function.ptr()) : nullptr);
  return type;
}

}  // namespace methods
