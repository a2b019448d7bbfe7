// SPDX-License-Identifier: MIT
#pragma once

// The capacitance of a channel without contact, its drift, and its noise.

#include <cstdint>
#include <limits>
#include <palpate/arithmetic.hpp>
#include <palpate/settings.hpp>
#include <palpate/stage/halves.hpp>

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
  constexpr Real expected() const noexcept { return Real(0); }
  constexpr Real noise() const noexcept { return Real(0); }
  constexpr Real variance() const noexcept { return Real(0); }
  constexpr Real age() const noexcept { return Real(0); }
  constexpr Real slope() const noexcept { return Real(0); }
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
///
/// Drift: two exponential means in series, fast and slow. Behind a value with a constant slope b they lag by b L and
/// 2 b L, L = (1 - share) / share; so 2 fast - slow does not lag (Brown 1963). It is what the gate expects as the next
/// value; and it is the level, too, if fast - slow is more than four of its standard deviations, sqrt(share) / 2 of the
/// noise.
template <class Real, int Size = 32, class Settings = Kept<BaselineSettings<Real>>>
class Baseline : public Settings {
  static_assert(Size >= 16 && Size < 256 && Size % 4 == 0,
                "palpate::Baseline: Size must be a multiple of 4, 16 to 252");
  static constexpr Real share = Real(1) / Real(Size);
  static constexpr Real lag = Real(Size - 1);
  static constexpr Real proven = Real(5 * Size);  // values after which the first slope is forgotten

 public:
  using Settings::settings;

  /// Add one of the first Size values.
  constexpr void collect(Real value) noexcept {
    halves_.add(filled_++, value);
    if (filled_ == Size) {
      establish();
    }
  }

  /// Add a later value without contact.
  constexpr void follow(Real value) noexcept {
    const Real limit = product(settings.clip, now_.noise);
    const Real raw = value - expected();
    const Real off = raw > limit ? limit : raw < -limit ? -limit : raw;
    const Real taken = expected() + off;
    now_.fast += product(taken - now_.fast, share);
    now_.slow += product(now_.fast - now_.slow, share);
    now_.count += now_.count < proven ? Real(1) : Real(0);
    const Real part = 1 / (now_.count < settings.longest ? now_.count : settings.longest), rest = 1 - part;
    now_.mean += product(taken - now_.mean, part);
    now_.squares = product(product(rest, rest), now_.squares) + product(part, part);
    now_.age = product(rest, now_.age + 1);
    set_noise(now_.noise + product(product(Real(1.2533141), magnitude(off)) - now_.noise, part),
              halves_.value(noise_floor));
    if (!(now_.count < proven)) {
      const Real trend = now_.fast - now_.slow;
      now_.drifts = product(trend, trend) > product(4 * share, product(now_.noise, now_.noise));
    }
  }

  /// Save the present state; rewind() goes back to it when a touch has begun after it.
  /// Only if ready().
  constexpr void mark() noexcept {
    const Moment& m = now_;
    const Real all[] = {m.mean, m.noise, m.count, m.squares, m.age, m.fast, m.slow, m.drifts ? Real(1) : Real(0)};
    for (int i = 0; i < numbers; ++i) {
      halves_.value(marked + i) = all[i];
    }
  }
  constexpr void rewind() noexcept {
    const auto at = [this](int i) { return halves_.value(marked + i); };
    now_ = {at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7) > 0};
  }

  constexpr void reset() noexcept { filled_ = 0; }
  /// Stop collecting, and keep the level from before reset().
  constexpr void keep() noexcept {
    filled_ = Size;
    halves_.value(noise_floor) = settings.least_noise;
    mark();
  }
  constexpr bool ready() const noexcept { return filled_ == Size; }
  /// Capacitance without contact, for the changes of a touch that begins now.
  constexpr Real level() const noexcept { return now_.drifts ? expected() : now_.mean; }
  /// The next value, if the present drift continues.
  constexpr Real expected() const noexcept { return 2 * now_.fast - now_.slow; }
  /// Change of the level from value to value.
  constexpr Real slope() const noexcept { return (now_.fast - now_.slow) / lag; }
  /// Standard deviation of one value.
  constexpr Real noise() const noexcept { return now_.noise; }
  /// Variance of the level: that of the noise times the sum of the squared weights of the values; 5 / 4 share for
  /// 2 fast - slow.
  constexpr Real variance() const noexcept {
    return product(product(now_.noise, now_.noise), now_.drifts ? Real(1.25) * share : now_.squares);
  }
  /// Mean age of the values of the level, in values.
  constexpr Real age() const noexcept { return now_.drifts ? Real(0) : now_.age; }

 private:
  constexpr void establish() noexcept {
    const auto found = halves_.summary(settings.clip, settings.least_noise);
    now_.noise = found.noise;
    now_.count = found.count;
    now_.mean = found.mean;
    now_.squares = 1 / found.count;
    now_.age = Real(Size - 1) / 2;
    now_.drifts = false;
    const Real last = found.mean + product(found.slope, Real(Size - 1) / 2);
    now_.fast = last - product(found.slope, lag);
    now_.slow = now_.fast - product(found.slope, lag);
    halves_.value(noise_floor) = found.floor;
    mark();
  }

  constexpr void set_noise(Real noise, Real floor) noexcept { now_.noise = noise > floor ? noise : floor; }

  struct Moment {
    Real mean = 0, noise = 0, count = 0, squares = 0, age = 0, fast = 0, slow = 0;
    bool drifts = false;
  };

  // The values are needed only while collecting; after that the same memory has these numbers.
  static constexpr int noise_floor = 0, marked = 1, numbers = 8;
  Halves<Real, Size> halves_;
  Moment now_;
  std::uint8_t filled_ = 0;
};

}  // namespace palpate
