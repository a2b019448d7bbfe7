// SPDX-License-Identifier: MIT
#pragma once

#include <pybind11/pybind11.h>

namespace py = pybind11;
using py::type_error, py::value_error;

void bind_estimators(py::module_& module);
void bind_design(py::module_& module);
void bind_vectors(py::module_& module);
void bind_banks(py::module_& module);
void bind_tracker(py::module_& module);
void bind_ring(py::module_& module);
void bind_rows(py::module_& module);
