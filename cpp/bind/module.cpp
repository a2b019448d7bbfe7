// SPDX-License-Identifier: MIT
#include <palpate/version.hpp>

#include "bind.hpp"

PYBIND11_MODULE(_core, module) {
  module.doc() = "The compiled core of palpate.";
  module.attr("__version__") = PALPATE_VERSION;
  bind_rls(module);
  bind_adaptive_rls(module);
  bind_handover_rls(module);
  bind_tracker(module);
  bind_bank(module);
  bind_ring(module);
}
