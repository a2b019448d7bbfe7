// SPDX-License-Identifier: MIT
#pragma once

// Sums of blocks of samples, and what the differences between blocks show of the noise.

#include <palpate/arithmetic.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// The sums of some samples, about a ratio that is held.
template <class Real>
struct Block {
  Real moment = 0;       ///< sum of w (y - held x)
  Real information = 0;  ///< sum of w x

  /// The ratio of these samples, less the one that is held.
  constexpr Real offset() const noexcept { return moment / information; }
  /// The samples of both.
  constexpr Block operator+(const Block& other) const noexcept {
    return {moment + other.moment, information + other.information};
  }
  /// The same samples about a ratio that is larger by `shift`.
  constexpr Block shifted(Real shift) const noexcept { return {moment - product(shift, information), information}; }
};

/// The difference between the ratios of two blocks.
template <class Real>
struct Contrast {
  Real noise = 0;   ///< its square over 1 / R1 + 1 / R2: the variance of a ratio, times its information
  Real weight = 0;  ///< 1 / (1 / R1 + 1 / R2), with the information R of each
};

/// The contrast of two blocks, of which the first has this offset; without weight if one has no information.
template <class Real>
constexpr Contrast<Real> contrast(const Block<Real>& a, Real offset, const Block<Real>& b) noexcept {
  if (PALPATE_UNLIKELY(!(a.information > 0 && b.information > 0))) {
    return {};
  }
  const Real weight = product(a.information / (a.information + b.information), b.information);
  const Real difference = offset - b.offset();
  return {product(product(difference, weight), difference), weight};
}
/// The contrast of two blocks.
template <class Real>
constexpr Contrast<Real> contrast(const Block<Real>& a, const Block<Real>& b) noexcept {
  return contrast(a, a.offset(), b);
}

/// The weighted mean of contrasts: the noise of blocks of one size.
template <class Real>
class NoiseOfBlocks {
 public:
  /// Variance of a ratio, times its information.
  constexpr Real noise() const noexcept { return noise_; }
  /// As many contrasts of equal weight have an equally certain mean.
  constexpr Real count() const noexcept { return count_; }

  /// Add a contrast. A memory of `most` of them: the older ones count less.
  constexpr void add(const Contrast<Real>& one, Real most) noexcept {
    if (PALPATE_UNLIKELY(!(one.weight > 0))) {
      return;
    }
    if (count_ >= most) {
      forget(1 - 1 / most);
    }
    weight_ += one.weight;
    const Real share = one.weight / weight_, rest = 1 - share;
    noise_ = normal_or_0(noise_ + product(share, one.noise - noise_));
    count_ = count_ > 0 ? count_ / (product(rest, rest) + product(product(share, share), count_)) : Real(1);
  }
  /// What was learned counts as if it were few contrasts.
  constexpr void shorten(Real few) noexcept {
    if (count_ > few) {
      forget(few / count_);
    }
  }

  /// As Rls::visit_state.
  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    visit(noise_), visit(weight_), visit(count_);
  }

 private:
  constexpr void forget(Real share) noexcept {
    weight_ *= share;
    count_ *= share;
  }

  Real noise_ = 0, weight_ = 0, count_ = 0;
};

/// A noise, and the degrees of freedom that are behind it.
template <class Real>
struct PooledNoise {
  Real sum = 0;                 ///< of noise times its count
  Real degrees_of_freedom = 0;  ///< sum of the counts

  /// Variance of a ratio, times its information.
  constexpr Real noise() const noexcept { return sum / degrees_of_freedom; }
  /// Add the noise of another level.
  constexpr PooledNoise operator+(const NoiseOfBlocks<Real>& level) const noexcept {
    return {sum + product(level.noise(), level.count()), degrees_of_freedom + level.count()};
  }
  /// Whether the level's noise is the same, within 1.5 standard deviations of what so few contrasts show.
  constexpr bool agrees(const NoiseOfBlocks<Real>& level) const noexcept {
    const Real difference = level.noise() / noise() - 1;
    const Real variance = 2 / degrees_of_freedom + 2 / level.count();
    return !(product(difference, difference) > product(Real(2.25), variance));  // both without noise: they agree
  }
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
