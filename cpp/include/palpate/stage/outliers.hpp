// SPDX-License-Identifier: MIT
#pragma once

// Single false readings of a channel, as of a wire that fails now and then (after Hampel's identifier).

#include <palpate/arithmetic.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// The last numbers of a series.
template <class Real, int Size>
class LastNumbers {
 public:
  PALPATE_INLINE constexpr void add(Real number) noexcept {
    newest_ = newest_ + 1 < Size ? newest_ + 1 : 0;
    numbers_[newest_] = number;
    if (PALPATE_UNLIKELY(count_ < Size)) {
      count_ += 1;
    }
  }
  /// How many there are.
  constexpr int count() const noexcept { return count_; }
  /// Whether the 30 % quantile of them, which are all above 0, is below a limit.
  PALPATE_INLINE constexpr bool quantile_below(Real limit) const noexcept {
    std::ptrdiff_t below = count_ - Size;  // those that are not there are 0
    for (const Real number : numbers_) {
      below += number < limit;
    }
    return 10 * below > 3 * count_;
  }

 private:
  Real numbers_[Size]{};
  int newest_ = 0, count_ = 0;
};

/// Up to Size numbers, in order.
template <class Real, int Size>
class Ordered {
 public:
  constexpr void add(Real value) noexcept {
    int place = count_++;
    for (; place > 0 && values_[place - 1] > value; --place) {
      values_[place] = values_[place - 1];
    }
    values_[place] = value;
  }
  constexpr int count() const noexcept { return count_; }
  /// The middle one, or the mean of both; 0: there is none.
  constexpr Real median() const noexcept {
    return count_ > 0 ? values_[(count_ - 1) / 2] / 2 + values_[count_ / 2] / 2 : Real(0);
  }
  constexpr Real range() const noexcept { return count_ > 0 ? values_[count_ - 1] - values_[0] : Real(0); }

 private:
  Real values_[Size]{};
  int count_ = 0;
};

/// The readings of one channel. A reading is judged when the next two are known:
///
///     off = reading - median(the last two that were no outliers, itself, the next two)
///
/// is far if |off| is above each of
/// - 6 noises. The noise is the 30 % quantile of the last 40 second differences over 0.385 sqrt(6): it holds where half
///   of them are bad, that is a fifth of the readings. Of fewer than 40 more is asked for;
/// - 8 times the 30 % quantile of the last 12 differences: four times the peak of a tremor A sin(w k) above its
///   neighbours, 2 A sin(w / 2)^2, where the quantile is 0.9 A sin(w / 2);
/// - 0.7 of the median difference of its neighbours, which a tap has, too;
/// - 2.5 codes; a code is the smallest change that was seen.
template <class Real>
class OutlierTest {
  static constexpr Real of_noise = Real(0.1573), of_changes = Real(0.125);  // 0.385 sqrt(6) / 6, 1 / 8
  static constexpr Real of_moves = Real(0.7), of_codes = Real(2.5);
  static constexpr Real fading = Real(0.97);
  static constexpr int newest = 2;

 public:
  /// The reading to be judged against its neighbours.
  struct Deviation {
    Real off = 0;    ///< from the median
    Real range = 0;  ///< of the neighbours
    Real moves = 0;  ///< a limit: share of the median difference of the neighbours
  };

  /// Takes the newest reading; NaN: none.
  PALPATE_INLINE constexpr void add(Real value) noexcept {
    next_[0] = next_[1];
    next_[1] = next_[newest];
    next_[newest] = is_finite(value) ? value : none;
    if (const Real change = value - last_, size = magnitude(change); PALPATE_LIKELY(is_finite(change))) {
      if (PALPATE_UNLIKELY(size > 0 && !(size >= code_ && code_ > 0))) {
        code_ = size;
      }
      changes_.add(size);
      if (is_finite(change_)) {
        bends_.add(magnitude(change - change_));
      }
      change_ = change;
    }
    last_ = is_finite(value) ? value : last_;
  }

  /// Whether the reading to be judged may be far off: it differs from those beside it by more than what was usual a moment
  /// ago, and by more than the changes allow. Without one before and one after it nobody can tell.
  PALPATE_INLINE constexpr bool suspects() noexcept {
    const Real apart = magnitude(next_[0] - kept_[1]) + magnitude(next_[0] - next_[1]);
    usual_ = product(usual_, fading);
    if (PALPATE_LIKELY(!(apart > usual_))) {
      return false;
    }
    return is_unusual(apart);
  }

  constexpr Deviation deviation() const noexcept {
    Ordered<Real, 5> all;
    Ordered<Real, 3> moves;
    Real before = not_a_number<Real>;
    for (const Real other : {kept_[0], kept_[1], next_[1], next_[newest]}) {
      if (is_finite(other)) {
        all.add(other);
        if (is_finite(before)) {
          moves.add(magnitude(other - before));
        }
        before = other;
      }
    }
    if (!is_finite(next_[0]) || all.count() < 2) {
      return {};
    }
    const Real range = all.range();
    all.add(next_[0]);
    return {next_[0] - all.median(), range, product(of_moves, moves.median())};
  }

  /// Whether a size is above each limit.
  constexpr bool is_far(Real size, const Deviation& found) const noexcept {
    return size > found.moves && size > product(of_codes, code_) && is_above_changes(size) && is_above_noise(size);
  }

  /// The reading to be judged.
  constexpr Real due() const noexcept { return next_[0]; }
  /// Returns the reading that is judged, NaN for an outlier.
  PALPATE_INLINE constexpr Real judged(bool outlier) noexcept {
    const Real value = outlier ? not_a_number<Real> : next_[0];
    if (PALPATE_LIKELY(is_finite(value))) {
      kept_[0] = kept_[1];
      kept_[1] = value;
    }
    return value;
  }
  /// The smallest change that was seen; 0: none was.
  constexpr Real code() const noexcept { return code_; }

 private:
  static constexpr Real none = not_a_number<Real>;

  constexpr bool is_unusual(Real apart) noexcept {
    for (const Real size : {2 * apart, apart}) {
      if (!is_above_changes(size) || !is_above_noise(size)) {
        usual_ = size;
        return false;
      }
    }
    return true;
  }
  PALPATE_INLINE constexpr bool is_above_changes(Real size) const noexcept {
    return changes_.quantile_below(product(size, of_changes));
  }
  constexpr bool is_above_noise(Real size) const noexcept {
    const auto many = static_cast<Real>(bends_.count());
    return bends_.quantile_below(product(size, product(of_noise, many / (many + 6))));
  }

  Real next_[newest + 1] = {none, none, none};  // the first one is to be judged
  Real kept_[2] = {none, none};                 // the last two that were no outliers
  Real last_ = none, change_ = none, code_ = 0, usual_ = 0;
  LastNumbers<Real, 12> changes_;  // sizes
  LastNumbers<Real, 40> bends_;    // sizes of second differences
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
