// SPDX-License-Identifier: MIT
#pragma once

// Copies, pickles and comparison of whatever has settings() and state(), and restored(settings, state).

#include <string>

#include "constructors.hpp"
#include "settings.hpp"

/// (settings, state), and what a Python subclass keeps of its own.
template <class E>
py::tuple pickled(py::handle self) {
  const E& estimator = methods::reference<E>(self);
  return py::make_tuple(estimator.settings().dict(), estimator.state(), py::getattr(self, "__dict__", py::dict()));
}

/// What is made of a pickled state; ValueError where the state has not the form of one.
template <class Make>
auto of_pickled(py::handle state, Make make) {
  try {
    return make(state.cast<py::tuple>());
  } catch (const py::cast_error&) {
  } catch (const py::type_error&) {
  } catch (const py::error_already_set& error) {
    // Too short, a count that is negative.
    if (!error.matches(PyExc_LookupError) && !error.matches(PyExc_OverflowError)) {
      throw;
    }
  }
  throw py::value_error("pickled state: got " + py::repr(state).cast<std::string>() +
                        ", allowed: what this version pickles");
}

template <class E>
E unpickled(py::handle self, py::handle state) {
  return of_pickled(state, [&](const py::tuple& given) {
    const auto values = given[0].cast<py::dict>();
    const Settings defaults = E::Kind::defaults(), settings = defaults.with("settings", values);
    if (static_cast<py::ssize_t>(values.size()) != defaults.size()) {
      throw py::cast_error("a setting is missing");
    }
    E::Kind::check(settings);
    E estimator = E::restored(settings, given[1].cast<py::tuple>());
    if (const auto own = given[2].cast<py::dict>(); !own.empty()) {
      py::setattr(self, "__dict__", own);
    }
    return estimator;
  });
}

/// A copy of the same class, by way of its pickled state, whose last item is what a subclass keeps; memo given: deep, that
/// is copied, too.
template <auto State>
py::object copied(py::handle self, py::handle memo) {
  py::list state(State(self));
  const auto copy = py::module_::import("copy");
  const std::size_t last = state.size() - 1;
  state[last] = memo.is_none() ? copy.attr("copy")(state[last]) : copy.attr("deepcopy")(state[last], memo);
  const py::object type = py::type::of(self);
  py::object result = type.attr("__new__")(type);
  result.attr("__setstate__")(py::tuple(state));
  return result;
}
template <auto State>
py::object shallow_copy(py::handle self) {
  return copied<State>(self, py::none());
}

template <class E>
py::object is_equal(const E& self, py::handle other) {
  return py::isinstance<E>(other) ? py::object(py::bool_(self == methods::reference<E>(other)))
                                  : py::reinterpret_borrow<py::object>(Py_NotImplemented);
}

/// Pickling by __newobj__ for every protocol: the two oldest know no class whose objects __new__ has to make.
inline py::tuple reduced(py::handle self, py::handle /*protocol*/) {
  return py::make_tuple(py::module_::import("copyreg").attr("__newobj__"), py::make_tuple(py::type::of(self)),
                        self.attr("__getstate__")());
}

template <auto State, auto Make, class T>
void define_pickling(py::class_<T>& type) {
  methods::define<&is_equal<T>>(type, "__eq__($self, other, /)\n--\n\n");
  type.attr("__hash__") = py::none();
  methods::define<State>(type, "__getstate__($self, /)\n--\n\n");
  methods::define_restore<Make>(type);
  methods::define<&reduced>(type, "__reduce_ex__($self, protocol, /)\n--\n\n");
}

template <auto State, auto Make, class T>
void define_copies(py::class_<T>& type) {
  define_pickling<State, Make>(type);
  methods::define<&shallow_copy<State>>(type, "copy($self)\n--\n\nAn independent one in the same state.");
  methods::define<&shallow_copy<State>>(type, "__copy__($self)\n--\n\n");
  methods::define<&copied<State>>(type, "__deepcopy__($self, memo)\n--\n\n");
}
