// SPDX-License-Identifier: MIT
#pragma once

// Where a touch begins and ends.

#include <cstdint>
#include <palpate/arithmetic.hpp>
#include <palpate/constant.hpp>

namespace palpate {

/// The null stage: always in contact.
template <class Real>
struct AlwaysContact {
  constexpr bool update(Real, Real) noexcept { return true; }
  constexpr void reset() noexcept {}
  constexpr bool contact() const noexcept { return true; }
  constexpr bool idle() const noexcept { return false; }
  constexpr int age() const noexcept { return 1; }
  constexpr bool suspects() const noexcept { return false; }
  constexpr bool presses_again(Real) noexcept { return false; }
};

template <class Real>
struct ContactSettings {
  Real slack = Real(1.5);  // the mean size of noise is 0.8
  Real quiet = Real(1.2);  // noise exceeds it four times in a row once in 360 starts
  Real limit = Real(16);
  Real clip = Real(6);
  Real release = Real(0.5);
  Real idle_share = Real(0.1);
  int confirm = 3;  // below 256

  /// As FixedForgetting::visit_fields, in every settings struct.
  template <class Visit>
  static constexpr void visit_fields(Visit&& visit) noexcept {
    visit("slack", &ContactSettings::slack);
    visit("quiet", &ContactSettings::quiet);
    visit("limit", &ContactSettings::limit);
    visit("clip", &ContactSettings::clip);
    visit("release", &ContactSettings::release);
    visit("idle_share", &ContactSettings::idle_share);
    visit("confirm", &ContactSettings::confirm);
  }
};

/// A Page test on the size of the change, in standard deviations of the idle noise: contact when the sum of what
/// exceeds slack reaches limit. A value counts clip at most, so contact takes limit / (clip - slack) values, 4: no
/// spike is one. The start is dated back to the first value after the last quiet one. The end: below release of the
/// highest value, confirm times in a row; the channel is idle again below idle_share of it.
/// Without Dates it leaves out the start.
template <class Real, class Settings = Kept<ContactSettings<Real>>, bool Dates = true>
class Contact : public Settings {
 public:
  using Settings::settings;

  /// One change (magnitude, any unit) and the noise of the same. Returns contact().
  constexpr bool update(Real change, Real noise) noexcept {
    if (state_ == State::idle) {
      return approach(change / noise);
    }
    const bool touching = contact();
    peak_ = touching && change > peak_ ? change : peak_;
    const Real share = touching ? settings.release : settings.idle_share;
    const Real noise_limit = product(settings.slack + 1, noise);  // a touch of a few noises has no tenth
    const Real least = product(share, peak_) > noise_limit ? product(share, peak_) : noise_limit;
    if (count_below(change < least) != settings.confirm) {
      return touching;
    }
    state_ = static_cast<State>(static_cast<int>(state_) - 1);
    below_ = 0;
    sum_ = 0;
    if (Dates) {
      age_ = 0;
    }
    return false;
  }

  constexpr void reset() noexcept {
    state_ = State::idle;
    sum_ = peak_ = 0;
    below_ = 0;
    age_ = 0;
  }

  constexpr bool contact() const noexcept { return state_ == State::contact; }
  constexpr bool idle() const noexcept { return state_ == State::idle; }

  /// While the baseline is measured anew after a touch: whether a change from the old one is the next touch already, of
  /// twice idle_share of the last one's height at least. Then the state is contact.
  constexpr bool presses_again(Real change) noexcept {
    if (count_below(change > 2 * product(settings.idle_share, peak_) && peak_ > 0) > settings.confirm) {
      state_ = State::contact;
      peak_ = change;
      age_ = below_;
      below_ = 0;
    }
    return contact();
  }

  /// Whether a touch may have begun.
  constexpr bool suspects() const noexcept { return sum_ > 0 || age_ > 0; }
  /// While idle: values since the last quiet one; in contact: what that was when contact was found.
  constexpr int age() const noexcept { return age_; }

 private:
  enum class State : std::uint8_t { idle, released, contact };

  constexpr bool approach(Real size) noexcept {
    sum_ += (size < settings.clip ? size : settings.clip) - settings.slack;
    sum_ = sum_ > 0 ? sum_ : Real(0);
    if (Dates) {  // noise does not exceed quiet 65536 times in a row
      age_ = static_cast<std::uint16_t>(size < settings.quiet ? 0 : age_ + 1);
    }
    if (sum_ >= settings.limit) {
      state_ = State::contact;
      peak_ = 0;
      below_ = 0;
    }
    return contact();
  }

  constexpr int count_below(bool below) noexcept {
    const int count = below ? below_ + 1 : 0;
    below_ = static_cast<std::uint8_t>(count);
    return count;
  }

  Real sum_ = 0, peak_ = 0;
  std::uint16_t age_ = 0;
  std::uint8_t below_ = 0;
  State state_ = State::idle;
};

}  // namespace palpate
