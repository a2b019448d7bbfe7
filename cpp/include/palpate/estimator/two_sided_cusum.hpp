// SPDX-License-Identifier: MIT
#pragma once

// A change detector that estimates the time of the change, and keeps the sums of the samples since then.

#include <palpate/pack.hpp>
#include <palpate/settings.hpp>

namespace palpate {

/// A sample: its weight w, output y and regressor x.
template <class Real>
struct WeightedSample {
  Real weight, output, regressor;
};

/// What a sample adds to sums: w y, w x, w^2.
template <class Value>
struct Terms {
  Value weighted_output, information, square;
};
template <class Real>
constexpr Terms<Real> terms_of(const WeightedSample<Real>& s) noexcept {
  return {product(s.weight, s.output), product(s.weight, s.regressor), product(s.weight, s.weight)};
}

/// Sums over the samples from which a ratio was computed.
template <class Value>
struct Sums {
  Value information = {};  // of w x
  Value squares = {};      // of w^2
  Value count = {};        // of 1

  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    visit(information);
    visit(squares);
    visit(count);
  }
};

/// One side of Page's CUSUM on a whitened innovation z in units of its scale, g' = max(0, g + z - drift), with the sums
/// since g was last 0: this is the maximum-likelihood estimate of the time of a change (Page 1954; Basseville and
/// Nikiforov 1993). `Value` is a Real, or a pack of them.
template <class Value>
struct CusumSide {
  Value statistic = {};
  Value age = {};              // samples since it was last 0
  Value weighted_output = {};  // sum of w y
  Sums<Value> sums;            // of the samples after the first `guard` of them

  // The compilers make branches of the selects of one Real.
  PALPATE_ONCE constexpr void add_with_branches(Value step, Value guard, const Terms<Value>& terms) noexcept {
    const Value sum = statistic + step;
    statistic = positive_part(sum);
    if (sum > 0) {
      age += 1;
    } else {
      age = 0;
    }
    if (age > guard) {
      weighted_output += terms.weighted_output;
      sums.information += terms.information;
      sums.squares += terms.square;
      sums.count += 1;
    } else {
      weighted_output = 0;
      sums = {};
    }
  }

  // The sign of noise cannot be predicted.
  constexpr void add_with_selects(Value step, Value guard, const Terms<Value>& terms) noexcept {
    const Value zero = {}, sum = statistic + step;
    const auto keep = sum > zero;
    statistic = select(keep, sum, zero);
    age = select(keep, age + 1, zero);
    const auto count = age > guard;
    weighted_output = select(count, weighted_output + terms.weighted_output, zero);
    sums.information = select(count, sums.information + terms.information, zero);
    sums.squares = select(count, sums.squares + terms.square, zero);
    sums.count = select(count, sums.count + 1, zero);
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
struct SidesInTurn {
  using real_type = Real;  ///< float or double
  CusumSide<Real> up, down;

  PALPATE_ONCE constexpr void add(Real z, Real drift, Real guard, const WeightedSample<Real>& sample) noexcept {
    const Terms<Real> terms = terms_of(sample);
    up.add_with_branches(z - drift, guard, terms);
    down.add_with_branches(-z - drift, guard, terms);
  }
  constexpr const CusumSide<Real>& larger() const noexcept { return up.statistic > down.statistic ? up : down; }
  constexpr Real statistic() const noexcept { return up.statistic > down.statistic ? up.statistic : down.statistic; }

  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    up.visit_state(visit);
    down.visit_state(visit);
  }
};

#if PALPATE_HAS_LANES

/// The same with both sides in one register. The compilers make branches of the selects of SidesInTurn, and half of them
/// are predicted wrong.
template <class Real>
class SidesInLanes {
 public:
  using real_type = Real;  ///< float or double
  constexpr void add(Real z, Real drift, Real guard, const WeightedSample<Real>& sample) noexcept {
    if (__builtin_is_constant_evaluated()) {
      auto turn = in_turn();
      turn.add(z, drift, guard, sample);
      for_each(turn.up, both_, [](Real from, Real* to) { to[0] = from; });
      for_each(turn.down, both_, [](Real from, Real* to) { to[1] = from; });
      return;
    }
    CusumSide<Lanes> now;
    for_each(now, both_, [](Lanes& to, const Real* from) { to = load<Lanes>(from); });
    const Terms<Real> one = terms_of(sample);
    now.add_with_selects(steps(z, drift), twice(guard),
                         {twice(one.weighted_output), twice(one.information), twice(one.square)});
    for_each(now, both_, [](Lanes from, Real* to) { store(from, to); });
  }
  constexpr CusumSide<Real> larger() const noexcept { return in_turn().larger(); }
  constexpr Real statistic() const noexcept {
    const auto& [rise, fall] = both_.statistic;
    return rise > fall ? rise : fall;
  }

  constexpr SidesInTurn<Real> in_turn() const noexcept {
    SidesInTurn<Real> turn;
    for_each(turn.up, both_, [](Real& to, const Real* from) { to = from[0]; });
    for_each(turn.down, both_, [](Real& to, const Real* from) { to = from[1]; });
    return turn;
  }

  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    for (int side = 0; side < 2; ++side) {
      for_each(both_, both_, [&](Real* value, const Real*) { visit(value[side]); });
    }
  }

 private:
  using Lanes = TwoLanes<Real>;
  static Lanes twice(Real value) noexcept { return Lanes{value, value}; }
  static Lanes steps(Real z, Real drift) noexcept { return Lanes{z - drift, -z - drift}; }

  template <class Left, class Right, class Work>
  static constexpr void for_each(Left& left, Right& right, Work work) noexcept {
    work(left.statistic, right.statistic);
    work(left.age, right.age);
    work(left.weighted_output, right.weighted_output);
    work(left.sums.information, right.sums.information);
    work(left.sums.squares, right.sums.squares);
    work(left.sums.count, right.sums.count);
  }

  alignas(2 * sizeof(Real)) CusumSide<Real[2]> both_;  // rise and fall
};

template <class Real>
using TwoSidedCusum = SidesInLanes<Real>;

#else

template <class Real>
using TwoSidedCusum = SidesInTurn<Real>;

#endif

namespace detail {
template <class Detector, class Real = typename Detector::real_type>
using FindsChanges = decltype(Detector(), of<Detector>().add(Real(), Real(), Real(), WeightedSample<Real>()),
                              Real(of<const Detector>().statistic()), CusumSide<Real>(of<const Detector>().larger()));
}  // namespace detail

}  // namespace palpate
