// SPDX-License-Identifier: MIT
#pragma once

// The capacitance of a channel without contact, and its noise.

#include <cstdint>
#include <limits>
#include <palpate/arithmetic.hpp>
#include <palpate/settings.hpp>

namespace palpate {

/// The null stage: the values are already changes.
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

template <class Real>
struct BaselineSettings {
  Real clip = Real(3);            // limits the deviation of one value, standard deviations
  Real longest = Real(64);        // memory of the running mean, values
  Real least_noise = Real(1e-6);  // pF: lower limit, for data without visible noise

  template <class Visit>
  static constexpr void visit_fields(Visit&& visit) noexcept {
    visit("clip", &BaselineSettings::clip);
    visit("longest", &BaselineSettings::longest);
    visit("least_noise", &BaselineSettings::least_noise);
  }
};

/// Level: first the mean of those of the first Size values that are near their median; up to a quarter of them may be
/// spikes, or of a touch that began too early. Then a clipped running mean, during the time without contact.
template <class Real, int Size = 32, class Settings = Kept<BaselineSettings<Real>>>
class Baseline : public Settings {
  static_assert(Size >= 8 && Size < 256, "palpate::Baseline: Size must be from 8 to 255");

 public:
  using Settings::settings;

  /// Add one of the first Size values; they are kept sorted.
  constexpr void collect(Real value) noexcept {
    int i = filled_++;
    for (; i > 0 && values_[i - 1] > value; --i) {
      values_[i] = values_[i - 1];
    }
    values_[i] = value;
    if (filled_ == Size) {
      establish();
    }
  }

  /// Add a later value without contact.
  constexpr void follow(Real value) noexcept {
    now_.count += now_.count < settings.longest ? Real(1) : Real(0);
    const Real limit = product(settings.clip, now_.noise);
    const Real raw = value - now_.level;
    const Real off = raw > limit ? limit : raw < -limit ? -limit : raw;
    const Real share = 1 / now_.count;
    now_.level += product(off, share);
    now_.squares = product(product(1 - share, 1 - share), now_.squares) + product(share, share);
    set_noise(now_.noise + product(product(Real(1.2533141), magnitude(off)) - now_.noise, share), values_[noise_floor]);
  }

  /// Save the present state; rewind() goes back to it when a touch has begun after it.
  /// Only if ready().
  constexpr void mark() noexcept {
    values_[marked_level] = now_.level;
    values_[marked_noise] = now_.noise;
    values_[marked_count] = now_.count;
    values_[marked_squares] = now_.squares;
  }
  constexpr void rewind() noexcept {
    now_ = {values_[marked_level], values_[marked_noise], values_[marked_count], values_[marked_squares]};
  }

  constexpr void reset() noexcept { filled_ = 0; }
  /// Stop collecting, and keep the level from before reset().
  constexpr void keep() noexcept {
    filled_ = Size;
    values_[noise_floor] = settings.least_noise;
    mark();
  }
  constexpr bool ready() const noexcept { return filled_ == Size; }
  constexpr Real level() const noexcept { return now_.level; }
  /// Standard deviation of one value.
  constexpr Real noise() const noexcept { return now_.noise; }
  /// Variance of the level: that of the noise times the sum of the squared weights of the values.
  constexpr Real variance() const noexcept { return product(product(now_.noise, now_.noise), now_.squares); }

 private:
  constexpr void establish() noexcept {
    // A step between codes is 3.5 standard deviations of the rounding; half a step is a safe lower limit.
    Real step = std::numeric_limits<Real>::max();
    for (int i = 1; i < Size; ++i) {
      const Real difference = values_[i] - values_[i - 1];
      step = difference > 0 && difference < step ? difference : step;
    }
    const bool coded = step > 2 * settings.least_noise && step < std::numeric_limits<Real>::max();
    const Real floor = coded ? step / 2 : settings.least_noise;
    const Real median = values_[Size / 2 - 1] / 2 + values_[Size / 2] / 2;  // their sum may be too large
    // The quartiles of a normal distribution, each moved inwards by one value, differ by 1.25 standard deviations.
    set_noise((values_[3 * Size / 4 - 1] - values_[Size / 4]) / Real(1.25), floor);
    const Real limit = product(settings.clip, now_.noise);
    int begin = 0, end = Size;
    while (begin < end && magnitude(values_[begin] - median) > limit) {
      ++begin;
    }
    while (end > begin && magnitude(values_[end - 1] - median) > limit) {
      --end;
    }
    Real sum = 0;
    for (int i = begin; i < end; ++i) {
      sum += values_[i] - median;
    }
    now_.count = static_cast<Real>(end - begin);
    now_.level = median + sum / now_.count;
    now_.squares = 1 / now_.count;
    values_[noise_floor] = floor;
    mark();
  }

  constexpr void set_noise(Real noise, Real floor) noexcept { now_.noise = noise > floor ? noise : floor; }

  struct Moment {
    Real level = 0, noise = 0, count = 0, squares = 0;
  };

  // The sorted values are needed only while collecting; after that the same memory has these numbers.
  enum Place : int { marked_level, marked_noise, marked_count, marked_squares, noise_floor };
  Real values_[Size] = {};
  Moment now_;
  std::uint8_t filled_ = 0;
};

}  // namespace palpate
