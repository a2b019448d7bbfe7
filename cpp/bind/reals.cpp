// SPDX-License-Identifier: MIT
// Where the standard library can neither read nor write doubles, Python does. The callers may have released the GIL.
#include "../rows/number.hpp"

#ifdef PALPATE_EXACT_ELSEWHERE
#include "module.hpp"

namespace palpate::rows {

bool nearest(const char* begin, const char* end, double& value) noexcept {
  const std::string text(begin, end);
  const py::gil_scoped_acquire held;
  value = PyOS_string_to_double(text.c_str(), nullptr, nullptr);
  PyErr_Clear();  // -1 where it was set
  return value > 0 && value <= DBL_MAX;
}

char* format_finite(char* to, double value) noexcept {
  const py::gil_scoped_acquire held;
  char* const text = PyOS_double_to_string(value, 'r', 0, Py_DTSF_ADD_DOT_0, nullptr);
  char* const end = append(to, text, static_cast<int>(std::strlen(text)));
  PyMem_Free(text);
  return end;
}

}  // namespace palpate::rows
#endif
