// SPDX-License-Identifier: MIT
#pragma once

// What all bound classes share. A doc begins with the signature, for inspect and help: "name(self, /, a, b=None)\n--\n\n...".

#include <array>
#include <atomic>
#include <cstddef>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>

#include "labels.hpp"

/// str(value), of Python.
inline std::string text_of(py::handle value) { return py::str(value).cast<std::string>(); }

/// As Python prints it, or the beginning of that.
inline std::string shown(py::handle value) {
  return text_of(py::module_::import("palpate.messages").attr("quoted")(value));
}

template <class Error, class Got>
[[noreturn]] void refuse(const std::string& name, Got got, const std::string& allowed) {
  throw Error(name + ": got " + text_of(py::detail::object_or_cast(got)) + ", allowed: " + allowed);
}

/// What float(value) gives. An integer beyond a double is a value out of range.
inline double to_real(py::handle value, const char* name, const char* allowed = "a number") {
  const double result = PyFloat_AsDouble(value.ptr());
  if (result == -1.0 && PyErr_Occurred()) {
    const py::error_already_set error;
    if (error.matches(PyExc_OverflowError)) {
      refuse<value_error>(name, "an integer beyond the range of a float", "real numbers");
    }
    if (error.matches(PyExc_TypeError)) {
      refuse<type_error>(name, shown(value), allowed);
    }
    throw error;
  }
  return result;
}

/// The same, without a call for a float. The value stays: its __float__ may take it from its list.
inline double real_of(PyObject* value, const char* name) {
  return PyFloat_CheckExact(value) ? PyFloat_AS_DOUBLE(value)
                                   : to_real(py::reinterpret_borrow<py::object>(value), name);
}

inline py::ssize_t to_size(py::handle value, const char* name) {
  const py::ssize_t size = PyNumber_AsSsize_t(value.ptr(), nullptr);  // beyond the type: its limits
  if (size == -1 && PyErr_Occurred()) {
    PyErr_Clear();
    refuse<type_error>(name, shown(value), "a whole number");
  }
  return size;
}

/// The end of the docs of what takes numbers.
constexpr auto raises = R"(
Raises
------
TypeError, ValueError
    Arguments of another number, type or shape, or out of range; columns of data frames with different indices. The
    message names what is allowed.
RuntimeError
    The object is in use by another thread.
)";

constexpr auto reset_doc = "reset(self, /)\n--\n\nForget all samples; the settings stay.";

inline void* refuse_bare(std::size_t) { throw type_error("self: got one whose __init__() has not been called"); }

// Methods and properties that are called for each sample are descriptors of the interpreter: pybind11's dispatcher takes
// 60 to 100 ns a call, ten times the estimator's own work.

template <class T>
class Class : public py::class_<T> {
 public:
  using py::class_<T>::class_;
  using py::class_<T>::def;

  /// A method, whose arguments must have one index where they have one.
  template <class Function, class... Extra>
  Class& def(const char* name, Function&& function, const Extra&... extra) {
    py::class_<T>::def(name, std::forward<Function>(function), extra..., SameIndex());
    return *this;
  }

  /// A property: get(object), or a member function without arguments.
  template <class Get>
  Class& property(const char* name, Get get, const std::string& doc) {
    struct Property {
      Get get;
      std::string doc;
      PyGetSetDef definition;
    };
    const auto read = [](PyObject* self, void* kept) { return returned(static_cast<Property*>(kept)->get, self); };
    auto* const kept = new Property{get, doc, {}};  // for as long as the class
    kept->definition = {name, read, nullptr, kept->doc.c_str(), kept};
    return add(name, PyDescr_NewGetSet(type(), &kept->definition));
  }

  /// A method without keywords: Function(object, values, their number). Its doc says "$self": inspect leaves it out of what
  /// is bound.
  template <auto Function>
  Class& fast(const char* name, const char* doc) {
    static PyMethodDef definition;
    static const std::string text = std::string(doc) + raises;
    auto* const untyped = reinterpret_cast<void (*)()>(&called<Function>);
    definition = {name, reinterpret_cast<PyCFunction>(untyped), METH_FASTCALL, text.c_str()};
    return add(name, PyDescr_NewMethod(type(), &definition));
  }

 private:
  static T& object_of(PyObject* self) {
    auto* const instance = reinterpret_cast<py::detail::instance*>(self);
    void* const value = instance->simple_layout
                            ? instance->simple_value_holder[0]  // else a Python class with several bound bases
                            : instance->get_value_and_holder(py::detail::get_type_info(typeid(T))).value_ptr();
    if (!value) {
      refuse_bare(sizeof(T));
    }
    return *static_cast<T*>(value);
  }

  template <auto Function>
  static PyObject* called(PyObject* self, PyObject* const* given, Py_ssize_t count) {
    return returned(Function, self, given, count);
  }

  /// The result as an object of Python; null after an exception, which Python then has.
  template <class Function, class... Arguments>
  static PyObject* returned(const Function& function, PyObject* self, Arguments... arguments) {
    try {
      auto result = std::invoke(function, object_of(self), arguments...);
      using Caster = py::detail::make_caster<decltype(result)>;
      return Caster::cast(std::move(result), py::return_value_policy::move, {}).ptr();
    } catch (...) {
      py::detail::try_translate_exceptions();
      return nullptr;
    }
  }

  PyTypeObject* type() const { return reinterpret_cast<PyTypeObject*>(this->ptr()); }
  Class& add(const char* name, PyObject* descriptor) {
    this->attr(name) = py::reinterpret_steal<py::object>(descriptor);
    return *this;
  }
};

// Functions, not lambdas in a template: pybind11 is instantiated once for all classes.
inline py::object reduced(const py::object& self, int protocol) {  // at 0 and 1 pybind11 ends the process
  return py::module_::import("builtins").attr("object").attr("__reduce_ex__")(self, protocol < 2 ? 2 : protocol);
}
inline py::object copied(const py::object& self) { return py::module_::import("copy").attr("copy")(self); }
inline auto written_by(const char* module, const char* function) {
  return [=](const py::object& self) { return py::module_::import(module).attr(function)(self); };
}

/// How a prompt and a notebook show an object: palpate.display writes it, from what any caller can read.
template <class T>
void define_display(Class<T>& type, const char* line, const char* card) {
  type.def("__repr__", written_by("palpate.display.text", line), "__repr__(self, /)\n--\n\n")
      .def("_repr_html_", written_by("palpate.display.cards", card), "_repr_html_(self, /)\n--\n\n");
}

/// A class with a constructor of these parameters, as "(*, forgetting=0.995)".
///
/// The signature stands twice, as inspect asks for it: of a class whose __init__ is a built-in function it takes the
/// one in the class's doc, and newer ones the one of the function.
template <class T, class Make, class... Extra>
Class<T> define_class(py::module_& module, const char* name, const std::string& parameters, const char* doc, Make make,
                      const Extra&... extra) {
  Class<T> type(module, name, (name + parameters + "\n--\n\n" + doc).c_str());
  type.attr("__module__") = "palpate";
  // Called for an object without __init__: pybind11 would take memory as it is.
  py::detail::get_type_info(typeid(T))->operator_new = &refuse_bare;
  type.def(py::init(make), ("__init__(self, /, " + parameters.substr(1) + "\n--\n\n").c_str(), extra...);
  type.def("__reduce_ex__", &reduced);
  return type;
}

/// Comparison, a method copy(), and pickling by pickled() and restored(); what a subclass in Python has comes along.
template <class T>
void define_copies(Class<T>& type) {
  const auto equal = [](const T& left, const T& right) { return left == right; };
  const auto pickled = [](const py::object& self) -> py::tuple {
    return self.cast<const T&>().pickled() + py::make_tuple(py::getattr(self, "__dict__", py::dict()));
  };
  const auto restored = [](const py::tuple& state) {
    return std::pair(T::restored(state), py::dict(state[state.size() - 1]));
  };
  type.def("__eq__", equal, py::is_operator(), "__eq__(self, other, /)\n--\n\n")
      .def("copy", &copied, "copy(self, /)\n--\n\nAn independent one in the same state.")
      .def(py::pickle(pickled, restored));
}

/// The numbers by place that such a method is called with.
template <std::size_t size>
std::array<double, size> numbers_of(PyObject* const* given, Py_ssize_t count,
                                    const std::array<const char*, size>& names) {
  if (count != static_cast<Py_ssize_t>(size)) {
    throw type_error("takes exactly " + std::to_string(size) + " numbers (" + std::to_string(count) + " given)");
  }
  std::array<double, size> values;
  for (std::size_t i = 0; i < size; ++i) {
    values[i] = real_of(given[i], names[i]);
  }
  return values;
}

/// Locked while a block is in an object and other threads may run: they are refused. A copy of the object is not locked.
class Busy {
 public:
  explicit Busy(const char* kind) : kind_(kind) {}
  Busy(const Busy& other) : Busy(other.kind_) {}

  void require_idle() const { require(!locked_); }
  void lock() { require(!locked_.exchange(true)); }
  void unlock() { locked_ = false; }

 private:
  void require(bool idle) const {
    if (!idle) {
      throw std::runtime_error(std::string("this ") + kind_ +
                               " is processing a block in another thread: give each thread its own");
    }
  }

  const char* kind_;
  std::atomic<bool> locked_{false};
};
