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
    const bool known = is_finite(value);
    push(value, known);
    if (PALPATE_UNLIKELY(!known)) {
      return;
    }
    if (PALPATE_LIKELY(seen_ > 0)) {
      change_to(value - last_);
    }
    last_ = value;
    seen_ += seen_ < 2;
  }
  /// There is no newest reading.
  constexpr void add_nothing() noexcept { push(0, false); }

  /// Whether the reading to be judged may be far off: it differs from those beside it by more than what was usual a moment
  /// ago, and by more than the changes allow. Without one before and one after it nobody can tell.
  PALPATE_INLINE constexpr bool suspects() noexcept {
    usual_ = product(usual_, fading);
    if (PALPATE_UNLIKELY(!(there_[0] && there_[1] && kept_count_ > 0))) {
      return false;
    }
    const Real apart = magnitude(next_[0] - kept_[1]) + magnitude(next_[0] - next_[1]);
    return PALPATE_UNLIKELY(apart > usual_) && is_unusual(apart);
  }

  constexpr Deviation deviation() const noexcept {
    Ordered<Real, 5> all;
    Ordered<Real, 3> moves;
    Real before = 0;
    const Real beside[] = {kept_[0], kept_[1], next_[1], next_[newest]};
    const bool known[] = {kept_count_ > 1, kept_count_ > 0, there_[1], there_[newest]};
    for (int i = 0; i < 4; ++i) {
      if (known[i]) {
        if (all.count() > 0) {
          moves.add(magnitude(beside[i] - before));
        }
        all.add(beside[i]);
        before = beside[i];
      }
    }
    if (!there_[0] || all.count() < 2) {
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
  /// Returns the reading that is judged; an outlier has no value, NaN.
  PALPATE_INLINE constexpr Real judged(bool outlier) noexcept {
    if (PALPATE_UNLIKELY(outlier || !there_[0])) {
      return not_a_number<Real>;
    }
    kept_[0] = kept_[1];
    kept_[1] = next_[0];
    kept_count_ += kept_count_ < 2;
    return next_[0];
  }
  /// The smallest change that was seen; 0: none was.
  constexpr Real code() const noexcept { return code_; }

 private:
  PALPATE_INLINE constexpr void push(Real value, bool known) noexcept {
    next_[0] = next_[1];
    next_[1] = next_[newest];
    next_[newest] = value;
    there_[0] = there_[1];
    there_[1] = there_[newest];
    there_[newest] = known;
  }
  PALPATE_INLINE constexpr void change_to(Real change) noexcept {
    const Real size = magnitude(change);
    if (PALPATE_UNLIKELY(size > 0 && !(size >= code_ && code_ > 0))) {
      code_ = size;
    }
    changes_.add(size);
    if (PALPATE_LIKELY(seen_ > 1)) {
      bends_.add(magnitude(change - change_));
    }
    change_ = change;
  }

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

  Real next_[newest + 1]{};        // the first one is to be judged
  bool there_[newest + 1]{};       // they have a value
  Real kept_[2]{};                 // the last two that were no outliers
  int kept_count_ = 0, seen_ = 0;  // at most 2: of those; of all with a value
  Real last_ = 0, change_ = 0, code_ = 0, usual_ = 0;
  LastNumbers<Real, 12> changes_;  // sizes
  LastNumbers<Real, 40> bends_;    // sizes of second differences
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
