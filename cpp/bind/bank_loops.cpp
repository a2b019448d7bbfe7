// SPDX-License-Identifier: MIT
// Compiled as it is, and again with -mavx2 -Dpalpate=palpate_avx2 -DPALPATE_LOOPS=avx2_loops.

#include "bank_loops.hpp"

#include <palpate/bank.hpp>

#if !defined(PALPATE_LOOPS)
#define PALPATE_LOOPS baseline_loops
#endif
#if defined(__AVX2__)
#define PALPATE_SIMD "avx2"
#else
#define PALPATE_SIMD "baseline"
#endif

namespace {

template <class Core, class Real>
void run(const Core& core, const BankTask<Real>& task) {
  palpate::Lanes<Core>(core).process({task.ratio, task.information, task.signed_statistic, task.rejected}, task.output,
                                     task.regressor, task.ratios, task.streams, task.frames);
}

template <class Real>
void fixed(const BankTask<Real>& task) {
  run(palpate::FixedRls<Real>({task.steady}, {}, {task.min_information}), task);
}

template <class Real>
void adaptive(const BankTask<Real>& task) {
  const auto [drift, threshold, clear_level] = task.cusum;
  run(palpate::AdaptiveRls<Real>({task.steady, task.alarmed}, {drift, threshold, clear_level}, {task.min_information}),
      task);
}

}  // namespace

extern const InstructionSet PALPATE_LOOPS{
    PALPATE_SIMD, {fixed<double>, adaptive<double>}, {fixed<float>, adaptive<float>}};
