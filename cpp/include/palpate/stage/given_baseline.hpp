// SPDX-License-Identifier: MIT
#pragma once

// A baseline that the user knows, in place of a measured one: readings that are changes already, or tared.

#include <palpate/stage/baseline.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// A Baseline that may be given: then its level stays, its error is none, and only the noise is measured, where it is not
/// given, too. A touch may run from the first value on, so the noise comes from second differences, which a slow press does
/// not move (the tremor of a hand does): for a standard deviation s of the values,
/// E |v(k) - 2 v(k-1) + v(k-2)| = sqrt(6) sqrt(2 / pi) s = 1.954 s.
template <class Real>
class GivenBaseline : public Baseline<Real, true, true> {
  using Measured = Baseline<Real, true, true>;
  static constexpr int enough = 8;   // values for a noise
  static constexpr int memory = 64;  // of it, values

 public:
  /// The level, pF, from now on, and the standard deviation of a value; 0: it is measured.
  constexpr void give(Real level, Real noise = 0) noexcept {
    *this = {};
    given_ = true;
    level_ = level;
    noise_ = noise;
    count_ = noise > 0 ? memory : 0;
    measures_ = count_ == 0;
  }

  /// @{
  /// As the function of Baseline of this name.
  constexpr void collect(Real value) noexcept { given_ ? learn(value) : Measured::collect(value); }
  constexpr void follow(Real value) noexcept { given_ ? learn(value) : Measured::follow(value); }
  constexpr bool given() const noexcept { return given_; }
  constexpr bool ready() const noexcept { return given_ ? count_ >= enough : Measured::ready(); }
  constexpr bool disturbed() const noexcept { return !given_ && Measured::disturbed(); }
  constexpr Real level() const noexcept { return given_ ? level_ : Measured::level(); }
  constexpr Real expected() const noexcept { return given_ ? level_ : Measured::expected(); }
  constexpr Real noise() const noexcept { return given_ ? noise_ : Measured::noise(); }
  constexpr Real variance() const noexcept { return given_ ? Real(0) : Measured::variance(); }
  /// @}

 private:
  constexpr void learn(Real value) noexcept {
    if (!measures_) {
      return;
    }
    const Real bend = product(Real(0.5117), magnitude((value - last_) - (last_ - before_)));
    before_ = last_;
    last_ = value;
    count_ += count_ < memory;
    if (count_ > 2) {
      const Real limit = count_ > enough ? 3 * noise_ : bend, least = RobustLine<Real, 2>::least(value);
      noise_ += ((bend < limit ? bend : limit) - noise_) / static_cast<Real>(count_ - 2);
      noise_ = noise_ > least ? noise_ : least;
    }
  }

  Real level_ = 0, noise_ = 0, last_ = 0, before_ = 0;
  int count_ = 0;
  bool given_ = false, measures_ = true;
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
