// SPDX-License-Identifier: MIT
#pragma once

// Many streams, each with an estimator of its own.

#include <cstddef>
#include <cstdint>
#include <palpate/settings.hpp>

namespace palpate {

/// `Streams` independent estimators in one object: the bits of as many single ones.
template <class Estimator, std::size_t Streams>
class Bank {
  static_assert(Streams > 0, "palpate::Bank: Streams must be 1 or more");

 public:
  using real_type = typename Estimator::real_type;  ///< float or double
  using Real = real_type;                           ///< the same

  /// All streams as `estimator`.
  constexpr explicit Bank(const Estimator& estimator = Estimator()) noexcept {
    for (Estimator& each : estimators_) {
      each = estimator;
    }
  }

  /// One sample of each stream; `results`, if not null, receives the new ratios, or of VectorRls the coefficients, stream by
  /// stream as the regressors. It may be output or regressor itself where as many numbers are in each.
  constexpr void update(const Real* output, const Real* regressor, Real* results = nullptr) noexcept {
    for (std::size_t i = 0; i < Streams; ++i) {
      if constexpr (detail::has<HasCoefficients, Estimator>) {
        Real values[Estimator::regressors] = {};
        for (Real& value : values) {
          value = *regressor++;
        }
        rejected_[i] += !estimators_[i].update(output[i], values).accepted;
        for (int k = 0; results != nullptr && k < Estimator::size; ++k) {
          *results++ = estimators_[i].coefficients()[k];
        }
      } else {
        rejected_[i] += !estimators_[i].update(output[i], regressor[i]).accepted;
        if (results != nullptr) {
          results[i] = estimators_[i].ratio();
        }
      }
    }
  }

  /// Number of streams.
  static constexpr std::size_t size() noexcept { return Streams; }
  /// The estimator of a stream, 0 to Streams - 1.
  constexpr const Estimator& operator[](std::size_t stream) const noexcept { return estimators_[stream]; }
  /// Number of refused samples of a stream.
  constexpr std::uint64_t rejected(std::size_t stream) const noexcept { return rejected_[stream]; }

 private:
  template <class Any>
  using HasCoefficients = decltype(detail::of<Any>().coefficients());

  Estimator estimators_[Streams];
  std::uint64_t rejected_[Streams] = {};
};

}  // namespace palpate
