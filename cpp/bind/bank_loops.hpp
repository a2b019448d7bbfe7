// SPDX-License-Identifier: MIT
#pragma once

// The loops of the banks, compiled once for every instruction set that a wheel may meet: see CMakeLists.txt. Nothing
// but plain data crosses, as each set has its own copy of the core in a namespace of its own.

#include <cstddef>
#include <cstdint>

template <class Real>
struct CusumNumbers {
  Real drift, threshold, clear_level;
};

template <class Real>
struct BankTask {
  Real steady, alarmed;  // a fixed forgetting factor is `steady`
  CusumNumbers<Real> cusum;
  Real min_information;
  Real* ratio = nullptr;
  Real* information = nullptr;
  Real* signed_statistic = nullptr;
  std::uint64_t* rejected = nullptr;
  const Real* output = nullptr;
  const Real* regressor = nullptr;
  Real* ratios = nullptr;
  std::size_t streams = 0, frames = 0;
};

template <class Real>
struct BankLoops {
  void (*fixed)(const BankTask<Real>&);
  void (*adaptive)(const BankTask<Real>&);
};

struct InstructionSet {
  const char* name;
  BankLoops<double> loops;
  BankLoops<float> loops32;
};

extern const InstructionSet baseline_loops;
#if defined(PALPATE_AVX2_LOOPS)
extern const InstructionSet avx2_loops;
#endif

/// That of this processor.
inline const InstructionSet& instruction_set() {
#if defined(PALPATE_AVX2_LOOPS)
  static const bool has_avx2 = __builtin_cpu_supports("avx2");
  return has_avx2 ? avx2_loops : baseline_loops;
#else
  return baseline_loops;
#endif
}

template <class Real>
const BankLoops<Real>& bank_loops() {
  if constexpr (sizeof(Real) == sizeof(double)) {
    return instruction_set().loops;
  } else {
    return instruction_set().loops32;
  }
}
