// SPDX-License-Identifier: MIT
#pragma once

// The numbers of a core's state, out and in. visit_state is noexcept: nothing in here may throw while it runs.

#include <palpate/arithmetic.hpp>
#include <vector>

template <class Core>
std::vector<typename Core::real_type> numbers_of(Core core) {
  using Real = typename Core::real_type;
  std::size_t count = 0;
  core.visit_state([&](const Real&) { ++count; });
  std::vector<Real> numbers(count);
  Real* place = numbers.data();
  core.visit_state([&](const Real& value) { *place++ = value; });
  return numbers;
}

/// False where they are no state that a core could be in.
template <class Core>
bool set_numbers(Core& core, const typename Core::real_type* numbers) {
  using Real = typename Core::real_type;
  bool finite = true;
  core.visit_state([&](Real& value) {
    value = *numbers++;
    finite = finite && palpate::is_finite(value);
  });
  return finite && core.information() > 0 && core.statistic() >= 0;
}
