// SPDX-License-Identifier: MIT
#pragma once

// The capacitance of a channel without contact, and its noise.

#include <palpate/arithmetic.hpp>

namespace palpate {

/// The null stage: the values are changes already.
template <class Real>
struct NoBaseline {
  constexpr void collect(Real) noexcept {}
  constexpr void follow(Real) noexcept {}
  constexpr void mark() noexcept {}
  constexpr void rewind() noexcept {}
  constexpr void reset() noexcept {}
  constexpr void keep() noexcept {}
  constexpr bool ready() const noexcept { return true; }
  constexpr Real level() const noexcept { return Real(0); }
  constexpr Real noise() const noexcept { return Real(0); }
  constexpr Real variance() const noexcept { return Real(0); }
};

/// From the first Size values, the mean of those that lie near their median: up to a quarter of them may belong to a
/// touch that began too early, or be spikes. Then a clipped running mean, for the time without contact.
template <class Real, int Size = 32>
class Baseline {
 public:
  Real clip = Real(3);            // standard deviations by which one value counts at most
  Real longest = Real(64);        // memory of the running mean, values
  Real least_noise = Real(1e-6);  // pF: data that do not tremble still have codes

  /// One of the first Size values, kept sorted.
  constexpr void collect(Real value) noexcept {
    int i = filled_++;
    for (; i > 0 && sorted_[i - 1] > value; --i) {
      sorted_[i] = sorted_[i - 1];
    }
    sorted_[i] = value;
    if (filled_ == Size) {
      establish();
    }
  }

  /// A later value without contact.
  constexpr void follow(Real value) noexcept {
    now_.count += now_.count < longest ? Real(1) : Real(0);
    const Real limit = product(clip, now_.noise);
    const Real raw = value - now_.level;
    const Real off = raw > limit ? limit : raw < -limit ? -limit : raw;
    const Real share = 1 / now_.count;
    now_.level += product(off, share);
    now_.squares = product(product(1 - share, 1 - share), now_.squares) + product(share, share);
    set_noise(now_.noise + product(product(Real(1.2533141), magnitude(off)) - now_.noise, share));
  }

  /// Remember this moment, and go back to it: when it turns out that a touch had begun after it.
  constexpr void mark() noexcept { marked_ = now_; }
  constexpr void rewind() noexcept { now_ = marked_; }

  constexpr void reset() noexcept { filled_ = 0; }
  /// Stop collecting: the level from before reset() stands.
  constexpr void keep() noexcept { filled_ = Size; }
  constexpr bool ready() const noexcept { return filled_ == Size; }
  constexpr Real level() const noexcept { return now_.level; }
  /// Standard deviation of one value.
  constexpr Real noise() const noexcept { return now_.noise; }
  /// Variance of the level itself: the noise's, times the sum of the squared weights of the values.
  constexpr Real variance() const noexcept { return product(product(now_.noise, now_.noise), now_.squares); }

 private:
  constexpr void establish() noexcept {
    // A code is 3.5 standard deviations of its rounding wide; half of it is on the safe side.
    floor_ = least_noise;
    for (int i = 1; i < Size; ++i) {
      const Real step = (sorted_[i] - sorted_[i - 1]) / 2;
      floor_ = step > 0 && (step < floor_ || floor_ == least_noise) ? step : floor_;
    }
    floor_ = floor_ > least_noise ? floor_ : least_noise;
    const Real median = (sorted_[Size / 2 - 1] + sorted_[Size / 2]) / 2;
    // The quartiles of a normal distribution, each one value towards the middle, are 1.25 standard deviations apart.
    set_noise((sorted_[3 * Size / 4 - 1] - sorted_[Size / 4]) / Real(1.25));
    const Real limit = product(clip, now_.noise);
    Real sum = 0;
    now_.count = 0;
    for (int i = 0; i < Size; ++i) {
      if (magnitude(sorted_[i] - median) <= limit) {
        sum += sorted_[i] - median;
        now_.count += 1;
      }
    }
    now_.level = median + sum / now_.count;
    now_.squares = 1 / now_.count;
    mark();
  }

  constexpr void set_noise(Real noise) noexcept { now_.noise = noise > floor_ ? noise : floor_; }

  struct Moment {
    Real level = 0, noise = 0, count = 0, squares = 0;
  };

  Real sorted_[Size] = {};
  int filled_ = 0;
  Real floor_ = 0;
  Moment now_, marked_;
};

}  // namespace palpate
