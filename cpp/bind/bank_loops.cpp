// SPDX-License-Identifier: MIT
// Compiled as it is, and again with -mavx2 -Dpalpate=palpate_avx2 -DPALPATE_LOOPS=avx2_loops, and so for AVX-512.

#include "bank_loops.hpp"

#include <palpate/handover_bank.hpp>

#if !defined(PALPATE_LOOPS)
#define PALPATE_LOOPS baseline_loops
#endif
#if defined(__AVX512DQ__)
#define PALPATE_SIMD "avx512"
#elif defined(__AVX2__)
#define PALPATE_SIMD "avx2"
#else
#define PALPATE_SIMD "baseline"
#endif

namespace {

template <class Core, class Real>
void run(const Core& core, const BankTask<Real>& task) {
  const auto& [output, regressor, ratios, rejected, streams, frames] = task.block;
  palpate::Lanes<Core>(core).process({task.ratio, task.information, task.signed_statistic, rejected}, output, regressor,
                                     ratios, streams, frames);
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

template <class Real>
void handover(const HandoverTask<Real>& task) {
  using Settings = palpate::HandoverSettings<Real>;
  Settings settings;
  std::size_t k = 0;
  Settings::visit_fields([&](const char*, auto member) { settings.*member = task.settings[k++]; });
  const auto& [output, regressor, ratios, rejected, streams, frames] = task.block;
  palpate::Lanes<palpate::Handover<Real>>(palpate::Handover<Real>({settings}))
      .process({task.numbers, rejected}, output, regressor, ratios, streams, frames);
}

}  // namespace

extern const InstructionSet PALPATE_LOOPS{PALPATE_SIMD,
                                          {fixed<double>, adaptive<double>, handover<double>},
                                          {fixed<float>, adaptive<float>, handover<float>}};
