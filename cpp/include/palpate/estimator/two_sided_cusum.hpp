// SPDX-License-Identifier: MIT
#pragma once

// A change detector that estimates the time of the change, and keeps the sums of the samples since then.

#include <palpate/settings.hpp>

// Whether two numbers in one SIMD register are faster than one after the other: with the vector extensions of the compilers,
// so that nothing depends on the optimisation of a loop. 32-bit ARM has none: its registers take numbers below the smallest
// normal one for 0.
#if !defined(PALPATE_HAS_LANES)
#if (defined(__GNUC__) || defined(__clang__)) && (defined(__SSE2__) || defined(__aarch64__))
#define PALPATE_HAS_LANES 1
#else
#define PALPATE_HAS_LANES 0
#endif
#endif

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// A sample: its weight w, output y and regressor x.
template <class Real>
struct WeightedSample {
  Real weight, output, regressor;
};

/// Sums over the samples from which a ratio was computed.
template <class Real>
struct Sums {
  Real information = 0;  // of w x
  Real squares = 0;      // of w^2
  Real count = 0;        // of 1
};

/// One side of Page's CUSUM on a whitened innovation z in units of its scale, g' = max(0, g + z - drift), with the sums
/// since g was last 0: this is the maximum-likelihood estimate of the time of a change (Page 1954; Basseville and
/// Nikiforov 1993).
template <class Real>
struct CusumSide {
  Real statistic = 0;
  Real age = 0;              // samples since it was last 0
  Real weighted_output = 0;  // sum of w y
  Sums<Real> sums;           // of the samples after the first `guard` of them
};

/// The sums of one sample.
template <class Real>
constexpr CusumSide<Real> alone(const WeightedSample<Real>& s) noexcept {
  return {0, 1, product(s.weight, s.output), {product(s.weight, s.regressor), product(s.weight, s.weight), 1}};
}

/// Both CUSUM sides: one for a rise of the ratio, one for a fall.
template <class Real>
class TwoSidedCusum {
 public:
  using real_type = Real;  ///< float or double

  PALPATE_INLINE constexpr void add(Real z, Real drift, Real guard, const WeightedSample<Real>& sample) noexcept {
    const CusumSide<Real> one = alone(sample);
#if PALPATE_HAS_LANES
    if (!__builtin_is_constant_evaluated()) {
      add_to_both(Lanes{z - drift, -z - drift}, guard, one);
      return;
    }
#endif
    add_to(0, z - drift, guard, one);
    add_to(1, -z - drift, guard, one);
  }
  constexpr CusumSide<Real> larger() const noexcept {
    const int i = statistic_[0] > statistic_[1] ? 0 : 1;
    return {statistic_[i], age_[i], weighted_output_[i], {information_[i], squares_[i], count_[i]}};
  }
  constexpr Real statistic() const noexcept { return statistic_[0] > statistic_[1] ? statistic_[0] : statistic_[1]; }

  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    for (int i = 0; i < 2; ++i) {
      for (auto* numbers : {&statistic_, &age_, &weighted_output_, &information_, &squares_, &count_}) {
        visit((*numbers)[i]);
      }
    }
  }

 private:
  // The compilers make branches of the selects of one Real.
  PALPATE_INLINE constexpr void add_to(int i, Real step, Real guard, const CusumSide<Real>& one) noexcept {
    const Real sum = statistic_[i] + step;
    statistic_[i] = positive_part(sum);
    age_[i] = sum > 0 ? age_[i] + 1 : Real(0);
    if (age_[i] > guard) {
      weighted_output_[i] += one.weighted_output;
      information_[i] += one.sums.information;
      squares_[i] += one.sums.squares;
      count_[i] += 1;
    } else {
      weighted_output_[i] = information_[i] = squares_[i] = count_[i] = 0;
    }
  }

#if PALPATE_HAS_LANES
  typedef Real Lanes __attribute__((vector_size(2 * sizeof(Real))));
  using Mask = decltype(Lanes() > Lanes());

  // Half of the branches of add_to are predicted wrong: the sign of noise cannot be predicted.
  void add_to_both(Lanes step, Real guard, const CusumSide<Real>& one) noexcept {
    const Lanes sum = load(statistic_) + step;
    const Mask keep = sum > Lanes{};
    const Lanes age = where(keep, load(age_) + 1);
    const Mask counts = age > Lanes{guard, guard};
    store(where(keep, sum), statistic_);
    store(age, age_);
    store(where(counts, load(weighted_output_) + one.weighted_output), weighted_output_);
    store(where(counts, load(information_) + one.sums.information), information_);
    store(where(counts, load(squares_) + one.sums.squares), squares_);
    store(where(counts, load(count_) + 1), count_);
  }
  /// `value` in the lanes where the comparison `mask` holds, otherwise 0.
  static Lanes where(Mask mask, Lanes value) noexcept {
    return reinterpret_cast<Lanes>(mask & reinterpret_cast<Mask>(value));
  }
  static Lanes load(const Real (&from)[2]) noexcept {
    Lanes value;
    __builtin_memcpy(&value, from, sizeof value);
    return value;
  }
  static void store(Lanes value, Real (&to)[2]) noexcept { __builtin_memcpy(to, &value, sizeof value); }
#endif

  // Of a rise and of a fall. TwoSidedCusum() and {} make them 0; with a 0 behind each, microcontrollers get more code.
  alignas((PALPATE_HAS_LANES + 1) * sizeof(Real)) Real statistic_[2];
  Real age_[2], weighted_output_[2], information_[2], squares_[2], count_[2];
};

namespace detail {
template <class Detector, class Real = typename Detector::real_type>
using FindsChanges = decltype(Detector(), of<Detector>().add(Real(), Real(), Real(), WeightedSample<Real>()),
                              Real(of<const Detector>().statistic()), CusumSide<Real>(of<const Detector>().larger()));
}  // namespace detail

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
