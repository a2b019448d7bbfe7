// SPDX-License-Identifier: MIT
#pragma once

// Copies, pickles and comparison of whatever has settings() and state(), and restored(settings, state).

#include <string>
#include <utility>

#include "settings.hpp"

/// (settings, state), and what a Python subclass keeps of its own.
template <class E>
py::tuple pickled(const py::object& self) {
  const auto& estimator = self.cast<const E&>();
  const py::object own = py::getattr(self, "__dict__", py::dict());
  return py::make_tuple(to_dict(estimator.settings()), estimator.state(), own);
}

/// What is made of a pickled state; ValueError where the state has not the form of one.
template <class Make>
auto of_pickled(const py::tuple& pickled, Make make) {
  try {
    return make(pickled);
  } catch (const py::cast_error&) {
  } catch (const py::error_already_set& error) {
    // Too short, a parameter that is missing, a count that is negative.
    if (!error.matches(PyExc_LookupError) && !error.matches(PyExc_OverflowError)) {
      throw;
    }
  }
  throw py::value_error("pickled state: got " + py::repr(pickled).cast<std::string>() +
                        ", allowed: what this version pickles");
}

template <class E>
std::pair<E, py::dict> unpickled(const py::tuple& pickled) {
  return of_pickled(pickled, [](const py::tuple& given) -> std::pair<E, py::dict> {
    const auto settings = from_dict<typename E::Settings>(given[0].cast<py::dict>());
    settings.check();
    return {E::restored(settings, given[1].cast<py::tuple>()), given[2].cast<py::dict>()};
  });
}

/// A copy of the same class, by way of its pickled state; deep: what a subclass keeps is copied, too.
template <class E>
py::object copied(const py::object& self, const py::object& memo) {
  py::tuple state = pickled<E>(self);
  const auto copy = py::module_::import("copy");
  const py::object own = memo.is_none() ? copy.attr("copy")(state[2]) : copy.attr("deepcopy")(state[2], memo);
  const py::object type = py::type::of(self);
  py::object result = type.attr("__new__")(type);
  result.attr("__setstate__")(py::make_tuple(state[0], state[1], own));
  return result;
}

/// Pickling by __newobj__ for every protocol: the two oldest know no class whose objects __new__ has to make.
template <class T>
void bind_reduce(py::class_<T>& type) {
  type.def(
      "__reduce_ex__",
      [](const py::object& self, int) {
        return py::make_tuple(py::module_::import("copyreg").attr("__newobj__"), py::make_tuple(py::type::of(self)),
                              self.attr("__getstate__")());
      },
      py::arg("protocol"), py::pos_only());
}

template <class E>
void bind_pickling(py::class_<E>& type) {
  type.def(
          "copy", [](const py::object& self) { return copied<E>(self, py::none()); },
          "An independent one in the same state.")
      .def("__copy__", [](const py::object& self) { return copied<E>(self, py::none()); })
      .def("__deepcopy__", &copied<E>, py::arg("memo"))
      .def(
          "__eq__", [](const E& self, const E& other) { return self == other; }, py::is_operator())
      .def(py::pickle(&pickled<E>, &unpickled<E>));
  bind_reduce(type);
}
