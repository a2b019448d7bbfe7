// SPDX-License-Identifier: MIT
#pragma once

// The numbers of a core's state, out and in, and whether a thread is using it.

#include <limits>
#include <palpate/tracker.hpp>
#include <stdexcept>
#include <string>
#include <vector>

using palpate::knows_its_error;

/// NaN where it means nothing yet.
template <class Core>
auto standard_error_of(const Core& core) {
  return core.settled() ? core.standard_error() : std::numeric_limits<typename Core::real_type>::quiet_NaN();
}

// visit_state is noexcept: nothing may throw while it runs.
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

/// While a block is processed, and other threads may run.
class InUse {
 public:
  explicit InUse(bool& busy) : busy_(busy) { busy_ = true; }
  InUse(const InUse&) = delete;
  ~InUse() { busy_ = false; }

 private:
  bool& busy_;
};

inline void require_idle(bool busy, const char* what) {
  if (busy) {
    throw std::runtime_error(std::string("this ") + what +
                             " is processing a block in another thread: give each thread its own");
  }
}
