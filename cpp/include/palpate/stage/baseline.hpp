// SPDX-License-Identifier: MIT
#pragma once

// The capacitance of a channel without contact, its drift, and its noise.

#include <palpate/square_root.hpp>
#include <palpate/stage/robust_line.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// The null stage: the values are already changes.
template <class Real>
struct NoBaseline {
  static constexpr bool timed = false;  ///< its first values are not those of a second
  /// @{
  /// As the function of Baseline of this name; level, noise and drift are 0.
  constexpr void collect(Real) noexcept {}
  constexpr void follow(Real) noexcept {}
  constexpr void mark() noexcept {}
  constexpr void rewind() noexcept {}
  constexpr void move(Real, Real) noexcept {}
  constexpr void reset() noexcept {}
  constexpr void keep() noexcept {}
  template <class Signed>
  constexpr void collected(Signed, Signed) noexcept {}
  constexpr bool empty() const noexcept { return false; }
  constexpr bool ready() const noexcept { return true; }
  constexpr bool disturbed() const noexcept { return false; }
  constexpr Real level() const noexcept { return Real(0); }
  constexpr Real expected() const noexcept { return Real(0); }
  constexpr Real noise() const noexcept { return Real(0); }
  constexpr Real variance() const noexcept { return Real(0); }
  constexpr Real age() const noexcept { return Real(0); }
  constexpr bool given() const noexcept { return false; }
  constexpr Real recovery() const noexcept { return Real(0); }
  /// @}
};

/// The state of a baseline between two values.
template <class Real, bool Drifts>
struct BaselineState {
  Real mean = 0, noise = 0, count = 0, squares = 0;

  template <class Visit>
  constexpr void visit(Visit&& visit_numbers) noexcept {
    visit_numbers(mean, noise, count, squares);
  }
};
template <class Real>
struct BaselineState<Real, true> : BaselineState<Real, false> {
  Real age = 0, fast = 0, slow = 0, last = 0;

  template <class Visit>
  constexpr void visit(Visit&& visit_numbers) noexcept {
    visit_numbers(this->mean, this->noise, this->count, this->squares, age, fast, slow, last);
  }
};

/// By the number n of the first values: the share of a new one in the exponential means, 1 / n; the memory of the running
/// mean, 2 n values; and 5 n values, after which the first slope is forgotten.
template <class Real, bool Timed>
struct BaselineMemory {
  static constexpr Real share = Real(1) / Real(32), longest = 64, proven = 160;
};
template <class Real>
struct BaselineMemory<Real, true> {
  Real share = Real(1) / Real(32), longest = 64, proven = 160;
};

/// The capacitance of a channel without contact, pF.
///
/// Level: first the mean of those of the first values that are near their median; up to a quarter of them may be spikes,
/// or of a touch that began too early. They are 32. Timed: they are those of a second, if these are fewer, and 5 at
/// least. Then a clipped running mean, during the time without contact. Every memory is a multiple of the first values,
/// so that it is as long in seconds; but the noise is known from 64 values.
///
/// Drift: two exponential means in series, fast and slow. Behind a value with a constant slope b they lag by b L and
/// 2 b L, L = (1 - share) / share; so 2 fast - slow does not lag (Brown 1963). It is what the gate expects as the next
/// value; and it is the level, too, if fast - slow is more than four of its standard deviations, sqrt(share) / 2 of the
/// noise. Without Drifts there is no such test, and the level is always the mean.
template <class Real, bool Drifts = true, bool Timed = false>
class Baseline : BaselineMemory<Real, Timed> {
  using Memory = BaselineMemory<Real, Timed>;
  using Memory::share, Memory::longest, Memory::proven;
  static constexpr int Size = 32, Fewest = 5;
  static constexpr Real clip = Real(3);  // limits the deviation of one value, standard deviations
  static constexpr Real memory = 64;     // of the noise, values

 public:
  static constexpr bool timed = Timed;  ///< its first values are those of a second

  /// Add one of the first values.
  constexpr void collect(Real value) noexcept {
    first_.add(filled_++, value);
    if (filled_ == Size) {
      establish(Size);
    }
  }

  /// Ticks from the first one to the last one: those of a second are enough.
  template <class Signed>
  constexpr void collected([[maybe_unused]] Signed ticks, [[maybe_unused]] Signed second) noexcept {
    if constexpr (Timed) {
      if (filled_ >= Fewest && !ready() && ticks >= second - second / filled_) {
        establish(filled_);
      }
    }
  }

  /// Add a later value without contact.
  constexpr void follow(Real value) noexcept {
    const Real limit = product(clip, now_.noise);
    const Real raw = value - expected();
    const Real off = raw > limit ? limit : raw < -limit ? -limit : raw;
    const Real taken = expected() + off;
    now_.count += now_.count < (Drifts ? 160 : memory) ? Real(1) : Real(0);
    const Real part = 1 / (now_.count < longest ? now_.count : longest), rest = 1 - part;
    if constexpr (Drifts) {
      now_.fast += product(taken - now_.fast, share);
      now_.slow += product(now_.fast - now_.slow, share);
      now_.age = product(rest, now_.age + 1);
    }
    now_.mean += product(taken - now_.mean, part);
    now_.squares = product(product(rest, rest), now_.squares) + product(part, part);
    const Real of_noise = Timed ? 1 / (now_.count < memory ? now_.count : memory) : part;
    const Real seen = now_.noise + product(product(Real(1.2533141), magnitude(off)) - now_.noise, of_noise);
    now_.noise = seen > first_.value(noise_floor) ? seen : first_.value(noise_floor);
    if constexpr (Drifts) {
      const bool quiet = 100 * magnitude(value - now_.last) < now_.noise && now_.noise > 4 * first_.value(noise_floor);
      quiet_ = static_cast<std::uint8_t>(quiet ? quiet_ + (quiet_ < Size) : 0);
      now_.last = value;
    }
    judge_drift();
  }

  /// Save the present state; only if ready().
  constexpr void mark() noexcept {
    int i = noise_floor;
    now_.visit([&](auto&... numbers) { ((first_.value(++i) = numbers), ...); });
  }
  /// Go back to the marked state: a touch has begun after it.
  constexpr void rewind() noexcept {
    int i = noise_floor;
    now_.visit([&](auto&... numbers) { ((numbers = first_.value(++i)), ...); });
    judge_drift();
  }

  /// Collect again; the level stays until the values are there.
  constexpr void reset() noexcept { filled_ = quiet_ = 0; }
  /// Stop collecting, and keep the level from before reset().
  constexpr void keep() noexcept {
    filled_ = Size;
    first_.value(noise_floor) = first_.least(now_.mean);
    mark();
  }
  /// The level is a new one, the mean of the last `count` values; only if ready().
  constexpr void move(Real level, Real count) noexcept {
    now_.mean = level;
    now_.count = count < longest ? count : longest;
    now_.squares = 1 / now_.count;
    if constexpr (Drifts) {
      now_.age = (now_.count - 1) / 2;
      now_.fast = now_.slow = now_.last = level;
      drifts_ = false;
    }
    quiet_ = 0;
    mark();
  }
  /// Whether the user knows it, so that it has no other level.
  constexpr bool given() const noexcept { return false; }
  /// Whether it has none of the first values.
  constexpr bool empty() const noexcept { return filled_ == 0; }
  /// Whether it has all of them.
  constexpr bool ready() const noexcept { return filled_ == Size; }
  /// Whether the first values were no baseline, as in a touch: the noise is 100 times the differences of as many later
  /// ones.
  constexpr bool disturbed() const noexcept { return 2 * quiet_ >= static_cast<int>(longest); }
  /// Capacitance without contact, for the changes of a touch that begins now.
  constexpr Real level() const noexcept { return drifts() ? expected() : now_.mean; }
  /// The next value, if the present drift continues.
  constexpr Real expected() const noexcept {
    if constexpr (Drifts) {
      return 2 * now_.fast - now_.slow;
    } else {
      return now_.mean;
    }
  }
  /// Change of the level from the earlier half of the first values to the later one; of fewer than 32, whose medians know
  /// it worse, less by the root of their share.
  constexpr Real recovery() const noexcept {
    const Real size = longest / 2, part = size / Size;
    return product(product(size / 2, (now_.fast - now_.slow) / (size - 1)), square_root(part));
  }
  /// Standard deviation of one value.
  constexpr Real noise() const noexcept { return now_.noise; }
  /// Variance of the level: that of the noise times the sum of the squared weights of the values; 5 / 4 share for
  /// 2 fast - slow.
  constexpr Real variance() const noexcept {
    return product(product(now_.noise, now_.noise), drifts() ? Real(1.25) * share : now_.squares);
  }
  /// Mean age of the values of the level, in values.
  constexpr Real age() const noexcept { return drifts() ? Real(0) : now_.age; }

 private:
  constexpr bool drifts() const noexcept { return Drifts && drifts_; }

  constexpr void establish(int size) noexcept {
    const auto found = first_.summary(clip, size);
    const Real lag = static_cast<Real>(size - 1);
    filled_ = Size;
    if constexpr (Timed) {
      const Real first = static_cast<Real>(size);
      static_cast<Memory&>(*this) = {1 / first, 2 * first, 5 * first};
    }
    now_.noise = found.noise;
    now_.count = found.count;
    now_.mean = found.mean;
    now_.squares = 1 / found.count;
    if constexpr (Drifts) {
      now_.age = lag / 2;
      now_.fast = found.mean + product(found.slope, lag / 2) - product(found.slope, lag);
      now_.slow = now_.fast - product(found.slope, lag);
      drifts_ = false;
    }
    first_.value(noise_floor) = found.floor;
    mark();
  }

  constexpr void judge_drift() noexcept {
    if constexpr (Drifts) {
      const Real trend = now_.fast - now_.slow;
      drifts_ = !(now_.count < proven) && product(trend, trend) > product(4 * share, product(now_.noise, now_.noise));
    }
  }

  // The values are needed only while collecting; after that the same memory has the noise floor, and the numbers of the
  // marked state.
  static constexpr int noise_floor = 0;
  RobustLine<Real, Size, Drifts, Timed> first_;
  BaselineState<Real, Drifts> now_;
  std::uint8_t filled_ = 0, quiet_ = 0;
  bool drifts_ = false;
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
