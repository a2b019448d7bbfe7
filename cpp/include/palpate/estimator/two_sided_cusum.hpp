// SPDX-License-Identifier: MIT
#pragma once

// A change detector that estimates the time of the change, and keeps the sums of the samples since then.

#include <palpate/arithmetic.hpp>

namespace palpate {

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

  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    visit(information);
    visit(squares);
    visit(count);
  }
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

  // Selects, not a branch: the sign of noise cannot be predicted.
  constexpr void add(Real step, Real guard, const WeightedSample<Real>& s) noexcept {
    const Real sum = statistic + step;
    const bool keep = sum > 0;
    statistic = keep ? sum : Real(0);
    age = keep ? age + 1 : Real(0);
    const bool count = age > guard;
    weighted_output = count ? weighted_output + product(s.weight, s.output) : Real(0);
    sums.information = count ? sums.information + product(s.weight, s.regressor) : Real(0);
    sums.squares = count ? sums.squares + product(s.weight, s.weight) : Real(0);
    sums.count = count ? sums.count + 1 : Real(0);
  }

  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    visit(statistic);
    visit(age);
    visit(weighted_output);
    sums.visit_state(visit);
  }
};

/// Both CUSUM sides: one for a rise of the ratio, one for a fall.
template <class Real>
struct TwoSidedCusum {
  CusumSide<Real> up, down;

  constexpr void add(Real z, Real drift, Real guard, const WeightedSample<Real>& sample) noexcept {
    up.add(z - drift, guard, sample);
    down.add(-z - drift, guard, sample);
  }
  constexpr const CusumSide<Real>& larger() const noexcept { return up.statistic > down.statistic ? up : down; }
  constexpr Real statistic() const noexcept { return up.statistic > down.statistic ? up.statistic : down.statistic; }

  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    up.visit_state(visit);
    down.visit_state(visit);
  }
};

}  // namespace palpate
