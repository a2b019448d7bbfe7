// SPDX-License-Identifier: MIT
// Prints the bits of VectorRls on the way through a change, spikes, a collinear stretch and refused samples.

#include <cinttypes>
#include <cstdio>
#include <initializer_list>
#include <limits>
#include <palpate/palpate.hpp>

#include "alike.hpp"

namespace {

template <class Real, int Regressors, bool Intercept = false>
void print(const char* name, Real alarmed = 0, Real min_information = 0) {
  constexpr int Size = Regressors + Intercept;
  palpate::Kept<palpate::VectorSettings<Real>> kept;
  kept.settings.alarmed = alarmed;
  if (min_information > 0) {
    kept.settings.min_information = min_information;
  }
  palpate::VectorRls<Real, Regressors, Intercept> estimator(kept);
  Hash hash;
  std::uint32_t state = 12345;
  const auto next = [&state] {
    state = state * 1664525u + 1013904223u;
    return static_cast<Real>(static_cast<std::int32_t>(state >> 16) - 32768) / Real(16384);
  };
  unsigned alarms = 0, refused = 0;
  for (int k = 0; k < 400; ++k) {
    Real values[Regressors] = {}, output = next() / 128 + (k % 97 == 90 ? Real(2) : Real(0));
    for (int i = 0; i < Regressors; ++i) {
      values[i] = k > 150 && k < 180 ? values[0] + Real(1) : next();
      output += values[i] * static_cast<Real>(k < 250 ? i + 1 : 2 * i - 1);
    }
    output += Intercept ? Real(3) : Real(0);
    output = k == 99 ? std::numeric_limits<Real>::infinity() : output;
    const auto step = estimator.update(output, values);
    alarms += step.alarm;
    refused += !step.accepted;
    Real errors[Size] = {}, column[Size] = {};
    hash.add(step.accepted ? step.innovation : Real(0));
    hash.add(estimator.statistic());
    hash.add(estimator.standard_errors(errors));
    const auto predicted = estimator.predict(values);
    hash.add(predicted.value);
    hash.add(predicted.standard_error > 0 ? predicted.standard_error : Real(0));
    estimator.covariance(Size - 1, column);
    for (int i = 0; i < Size; ++i) {
      hash.add(estimator.coefficients()[i]);
      hash.add(errors[i] > 0 ? errors[i] : Real(0));  // the bits of a NaN are the processor's own
      hash.add(column[i]);
    }
  }
  std::printf("%s %u %u %016" PRIx64 "\n", name, alarms, refused, hash.value);
}

template <class Real>
void all() {
  print<Real, 1>("VectorRls 1");
  print<Real, 2>("VectorRls 2");
  print<Real, 1, true>("VectorRls 1, intercept");
  print<Real, 3>("VectorRls 3, alarmed", Real(0.9));
  print<Real, 3, true>("VectorRls 3, intercept, bounded", Real(0), Real(0.5));
  print<Real, 8>("VectorRls 8");
}

}  // namespace

int main() {
  all<float>();
  all<double>();
  return 0;
}
