// SPDX-License-Identifier: MIT
#pragma once

#include <pybind11/pybind11.h>

namespace py = pybind11;

void bind_rls(py::module_& module);
void bind_adaptive_rls(py::module_& module);
void bind_handover_rls(py::module_& module);
void bind_tracker(py::module_& module);
void bind_bank(py::module_& module);
void bind_ring(py::module_& module);
