// SPDX-License-Identifier: MIT
#include <pybind11/numpy.h>

#include "estimator.hpp"
#include "methods.hpp"

namespace {

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;

Array process(Estimator& estimator, const Array& output, const Array& regressor) {
  Array ratio(output.size());
  estimator.process(output.data(), regressor.data(), ratio.mutable_data(), static_cast<std::size_t>(output.size()));
  return ratio;
}

#ifdef OWN_METHODS
py::object block(Estimator& estimator, py::handle output, py::handle regressor) {
  return process(estimator, Array::ensure(output), Array::ensure(regressor));
}
#endif

}  // namespace

PYBIND11_MODULE(MODULE, module) {
  py::class_<Estimator> type(module, "Estimator");
  type.def(py::init<>());
#ifdef OWN_METHODS
  methods::define<&Estimator::update>(type, "update($self, output, regressor, /)\n--\n\nOne sample.");
  methods::define<&block>(type, "process($self, output, regressor)\n--\n\nA block.");
  methods::property<&Estimator::ratio>(type, "ratio", "The ratio.");
#else
  type.def("update", &Estimator::update, py::arg("output"), py::arg("regressor"), py::pos_only());
  type.def("process", &process, py::arg("output"), py::arg("regressor"));
  type.def_property_readonly("ratio", &Estimator::ratio);
#endif
}
