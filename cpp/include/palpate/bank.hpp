// SPDX-License-Identifier: MIT
#pragma once

// Many streams, each with an estimator of its own.

#include <cstddef>
#include <cstdint>
#include <palpate/arithmetic.hpp>

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

  /// One sample of each stream; `ratios`, if not null, receives the new ratios. It may be output or regressor itself.
  constexpr void update(const Real* output, const Real* regressor, Real* ratios = nullptr) noexcept {
    for (std::size_t i = 0; i < Streams; ++i) {
      const auto step = estimators_[i].update(output[i], regressor[i]);
      rejected_[i] += !step.accepted;
      if (ratios != nullptr) {
        ratios[i] = estimators_[i].ratio();
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
  Estimator estimators_[Streams];
  std::uint64_t rejected_[Streams] = {};
};

}  // namespace palpate
