// SPDX-License-Identifier: MIT
#pragma once

// The loops of the banks, compiled once for every instruction set that a wheel may meet: see CMakeLists.txt. Nothing
// but plain data crosses, as each set has its own copy of the core in a namespace of its own.

#include <array>
#include <cstddef>
#include <cstdint>

template <class Real>
struct CusumNumbers {
  Real drift, threshold, clear_level;
};

template <class Real>
struct BankBlock {
  const Real* output = nullptr;
  const Real* regressor = nullptr;
  Real* ratios = nullptr;
  std::uint64_t* rejected = nullptr;
  std::size_t streams = 0, frames = 0;
};

template <class Real>
struct BankTask {
  Real steady, alarmed;  // a fixed forgetting factor is `steady`
  CusumNumbers<Real> cusum;
  Real min_information;
  Real* ratio = nullptr;
  Real* information = nullptr;
  Real* signed_statistic = nullptr;
  BankBlock<Real> block = {};
};

template <class Real>
struct HandoverTask {
  std::array<Real, 7> settings;  // in the order of HandoverSettings::visit_fields
  Real* numbers;
  BankBlock<Real> block;
};

template <class Real>
struct BankLoops {
  void (*fixed)(const BankTask<Real>&);
  void (*adaptive)(const BankTask<Real>&);
  void (*handover)(const HandoverTask<Real>&);
};

struct InstructionSet {
  const char* name;
  BankLoops<double> loops;
  BankLoops<float> loops32;
};

extern const InstructionSet baseline_loops;
#if defined(PALPATE_X86_LOOPS)
extern const InstructionSet avx2_loops;
extern const InstructionSet avx512_loops;
#endif

/// The widest one that this processor has, or the one that the environment variable PALPATE_SIMD names; throws
/// std::invalid_argument if that is not one of them.
const InstructionSet& instruction_set();

template <class Real>
const BankLoops<Real>& bank_loops() {
  if constexpr (sizeof(Real) == sizeof(double)) {
    return instruction_set().loops;
  } else {
    return instruction_set().loops32;
  }
}
