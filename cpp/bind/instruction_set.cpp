// SPDX-License-Identifier: MIT
// The choice of the banks' loops.

#include <cstdlib>
#include <stdexcept>
#include <string>

#include "bank_loops.hpp"

namespace {

bool is_here(const InstructionSet& set) {
#if defined(PALPATE_X86_LOOPS)
  if (&set == &avx512_loops) {
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
  }
  if (&set == &avx2_loops) {
    return __builtin_cpu_supports("avx2");
  }
#endif
  return &set == &baseline_loops;
}

const InstructionSet& chosen() {
  const char* const set_to = std::getenv("PALPATE_SIMD");
  const std::string given = set_to == nullptr ? "" : set_to;
  std::string names;
  for (const InstructionSet* set : {
#if defined(PALPATE_X86_LOOPS)
           &avx512_loops, &avx2_loops,
#endif
           &baseline_loops}) {
    if (is_here(*set)) {
      if (given.empty() || given == set->name) {
        return *set;
      }
      names += (names.empty() ? "" : ", ") + std::string(set->name);
    }
  }
  throw std::invalid_argument("environment variable PALPATE_SIMD: got '" + given + "', allowed: " + names);
}

}  // namespace

const InstructionSet& instruction_set() {
  static const InstructionSet& set = chosen();
  return set;
}
