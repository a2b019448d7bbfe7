// SPDX-License-Identifier: MIT
#include "module.hpp"

#include <palpate/version.hpp>

PYBIND11_MODULE(_core, module) {
  module.doc() = "The compiled core of palpate.";
  module.attr("__version__") = PALPATE_VERSION;
  py::options options;
  options.disable_function_signatures();  // each doc begins with its own
  bind_estimators(module);
  bind_design(module);
  bind_vectors(module);
  bind_tracker(module);
  bind_ring(module);
  bind_banks(module);
  bind_rows(module);
}
