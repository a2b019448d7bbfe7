// SPDX-License-Identifier: MIT
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include "estimator.hpp"

namespace nb = nanobind;

namespace {

using Input = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Output = nb::ndarray<nb::numpy, double, nb::ndim<1>>;

Output process(Estimator& estimator, const Input& output, const Input& regressor) {
  auto* const ratio = new double[output.size()];
  const nb::capsule owner(ratio, [](void* kept) noexcept { delete[] static_cast<double*>(kept); });
  estimator.process(output.data(), regressor.data(), ratio, output.size());
  return Output(ratio, {output.size()}, owner);
}

#ifdef OWN_METHODS
// What cpp/bind/methods.hpp does, by nanobind's public functions.
PyObject* update(PyObject* self, PyObject* const* arguments, Py_ssize_t count) {
  if (count != 2) {
    PyErr_SetString(PyExc_TypeError, "takes exactly 2 numbers");
    return nullptr;
  }
  if (!nb::inst_ready(self)) {
    PyErr_SetString(PyExc_TypeError, "__init__() has not been called");
    return nullptr;
  }
  const double output = PyFloat_AsDouble(arguments[0]), regressor = PyFloat_AsDouble(arguments[1]);
  if ((output == -1.0 || regressor == -1.0) && PyErr_Occurred()) {
    return nullptr;
  }
  return PyFloat_FromDouble(nb::inst_ptr<Estimator>(self)->update(output, regressor));
}
PyMethodDef definition = {"update", reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(&update)), METH_FASTCALL,
                          "update($self, output, regressor, /)\n--\n\nOne sample."};
#endif

}  // namespace

NB_MODULE(MODULE, module) {
  nb::class_<Estimator> type(module, "Estimator");
  type.def(nb::init<>());
#ifdef OWN_METHODS
  auto* const python_type = reinterpret_cast<PyTypeObject*>(type.ptr());
  nb::setattr(type, "update", nb::steal(PyDescr_NewMethod(python_type, &definition)));
#else
  type.def("update", &Estimator::update, nb::arg(), nb::arg());
#endif
  type.def("process", &process, nb::arg("output"), nb::arg("regressor"));
  type.def_prop_ro("ratio", &Estimator::ratio);
}
