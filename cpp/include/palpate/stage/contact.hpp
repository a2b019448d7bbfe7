// SPDX-License-Identifier: MIT
#pragma once

// Contact: the begin and the end of a touch.

#include <palpate/settings.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// The null stage: always in contact. The next touch begins at the end of the last one.
template <class Real>
struct AlwaysContact {
  using real_type = Real;                  ///< float or double
  static constexpr bool releases = false;  ///< a touch does not end by a release
  static constexpr bool recovers = false;  ///< a wrong baseline is not noticed
  /// @{
  /// As the function of Contact of this name.
  constexpr bool update(Real, Real, Real) noexcept { return true; }
  constexpr void reset() noexcept {}
  constexpr bool contact() const noexcept { return true; }
  constexpr bool idle() const noexcept { return false; }
  constexpr int age() const noexcept { return 1; }
  constexpr bool suspects() const noexcept { return false; }
  constexpr bool update_between(Real, Real) noexcept { return false; }
  constexpr bool fell() const noexcept { return false; }
  constexpr bool pressed() const noexcept { return false; }
  constexpr int pressed_again() const noexcept { return 0; }
  /// @}
};

/// Settings of Contact. The unit of the first four is the standard deviation of the idle noise.
template <class Real>
struct ContactSettings {
  Real slack = Real(1.5);       ///< of the CUSUMs
  Real quiet = Real(1.2);       ///< a touch starts after it; noise is above it three times in a row in 1 of 660 starts
  Real limit = Real(16);        ///< of the CUSUMs: contact
  Real clip = Real(6);          ///< limits one change
  Real release = Real(0.5);     ///< a touch ends below this share of its height
  Real idle_share = Real(0.1);  ///< the release is over below this share of it
  int confirm = 3;              ///< changes in a row for either, below 256
  /// Seconds after the end of a touch until the baseline is measured again, wherever the channels are.
  Real patience = Real(30);

  /// As FixedForgetting::visit_fields; every settings struct has it.
  static constexpr auto visit_fields = [](auto& s, auto&& visit) noexcept {
    visit("slack", s.slack, s.slack >= 0, "0 <= slack");
    visit("quiet", s.quiet, s.quiet >= 0, "0 <= quiet");
    visit("limit", s.limit, s.limit > 0, "0 < limit");
    visit("clip", s.clip, s.clip > s.slack, "slack < clip");
    visit("release", s.release, 0 < s.release && s.release < 1, "0 < release < 1");
    visit("idle_share", s.idle_share, 0 < s.idle_share && s.idle_share < 1, "0 < idle_share < 1");
    visit("confirm", s.confirm, 0 < s.confirm && s.confirm < 256, "0 < confirm < 256");
    visit("patience", s.patience, s.patience > 0, "0 < patience");
  };
};

/// What a gate keeps to notice that the baseline is wrong, or a press without a touch; nothing otherwise.
template <class Real, bool Recovers>
struct Recovery {
  Real fall = 0;
  std::uint16_t again = 0;
};
template <class Real>
struct Recovery<Real, false> {
  static constexpr Real fall = 0;
  static constexpr std::uint16_t again = 0;
};

/// Two one-sided CUSUMs (Page's test) of the change, in standard deviations of the idle noise:
///
///     g' = max(0, g + min(change / noise, clip) - slack),   contact when g >= limit
///
/// and the same for -change: the channels fell far below the baseline. So contact needs at least limit / (clip - slack)
/// = 4 values: one spike is not a contact. The start of a touch is the first value after the last one below quiet. The
/// end: below release times the height, confirm times in a row; the channel is idle again below idle_share times the
/// height. The height is the highest of all two in a row, so that one spike does not end a touch. Without Recovers a
/// wrong baseline is not noticed: there is no test for a fall, and `patience` has no end.
template <class Real, class Settings = Kept<ContactSettings<Real>>, bool Recovers = true>
class Contact : public Settings, Recovery<Real, Recovers> {
  using Extra = Recovery<Real, Recovers>;

 public:
  using Settings::settings;
  using real_type = Real;                     ///< float or double
  static constexpr bool releases = true;      ///< a touch ends by a release
  static constexpr bool recovers = Recovers;  ///< a wrong baseline is noticed

  /// Takes one change and its noise, in the same unit; and the seconds since a touch took samples. Returns contact().
  constexpr bool update(Real change, Real noise, Real waited = Real(0)) noexcept {
    const bool touching = state_ == State::idle ? approach(change, noise) : leave(change, noise, waited);
    last_ = change;
    return touching;
  }

  /// Takes one change from the old baseline, while a new one is measured after a touch. Returns contact(): the next
  /// touch has begun if more than `confirm` changes in a row are above 2 * idle_share times the height of the last one,
  /// and above the noise.
  constexpr bool update_between(Real change, Real noise) noexcept {
    const Real least = 2 * product(settings.idle_share, peak_), noise_limit = product(settings.clip, noise);
    const bool high = peak_ > 0 && change > (least > noise_limit ? least : noise_limit);
    if (count_in_a_row(high) > settings.confirm) {
      age_ = in_a_row_;
      enter(change);
    }
    last_ = change;
    return contact();
  }

  /// Idle again, at once.
  constexpr void reset() noexcept {
    calm_down(State::idle);
    peak_ = 0;
  }

  /// Whether the last change of update_between() may be of a touch.
  constexpr bool pressed() const noexcept { return in_a_row_ > 0; }
  /// Whether a touch is running.
  constexpr bool contact() const noexcept { return state_ == State::contact; }
  /// Whether the release of the last touch is over, too.
  constexpr bool idle() const noexcept { return state_ == State::idle; }

  /// Whether a touch may have begun.
  constexpr bool suspects() const noexcept { return sum_ > 0 || age_ > 0; }
  /// Whether the idle channels fell far below the baseline: it was measured in contact, or it jumped. Three times the
  /// limit, at least 11 values: a burst of noise is no fall, and a touch that begins meanwhile would be lost. Also whether
  /// a contact has lasted for `patience` since a touch took samples.
  constexpr bool fell() const noexcept { return Extra::fall >= 3 * settings.limit; }
  /// How often the probe was pressed again while the release was not over, so that no touch began; modulo 65536.
  constexpr int pressed_again() const noexcept { return Extra::again; }
  /// While idle: number of values since the last one below quiet; in contact: this number when the contact was found.
  constexpr int age() const noexcept { return age_; }

 private:
  enum class State : std::uint8_t { contact, released, idle };

  constexpr bool approach(Real change, Real noise) noexcept {
    // 0 / 0, no change and no noise, is NaN, which is not above 0: the sum starts again from 0.
    const Real size = change / noise;
    sum_ = next(sum_, size);
    if constexpr (Recovers) {
      Extra::fall = next(Extra::fall, -size);
    }
    // Noise is never above quiet 65536 times in a row.
    age_ = static_cast<std::uint16_t>(size >= settings.quiet ? age_ + 1 : 0);
    if (sum_ >= settings.limit) {
      enter(change);
    }
    return contact();
  }

  constexpr Real next(Real sum, Real size) const noexcept {
    return positive_part(sum + ((size > settings.clip ? settings.clip : size) - settings.slack));
  }

  constexpr bool leave(Real change, Real noise, [[maybe_unused]] Real waited) noexcept {
    const bool touching = contact();
    peak_ = touching && twice(change) > peak_ ? twice(change) : peak_;
    const Real least = product(touching ? settings.release : settings.idle_share, peak_);
    const Real noise_limit = product(settings.slack + 1, noise);  // a tenth of a very light touch is below the noise
    const bool low = change < (least > noise_limit ? least : noise_limit);
    if constexpr (Recovers) {
      if (PALPATE_UNLIKELY(waited >= settings.patience)) {  // the baseline jumped, or a press lasts: fell() says so
        reset();
        Extra::fall = 3 * settings.limit;
        return false;
      }
      if (!touching) {
        age_ = static_cast<std::uint16_t>(change > product(settings.release, peak_) ? age_ + 1 : 0);
        Extra::again = static_cast<std::uint16_t>(Extra::again + (age_ == settings.confirm));
      }
    }
    if (count_in_a_row(low) != settings.confirm) {
      return touching;
    }
    calm_down(touching ? State::released : State::idle);
    return false;
  }

  // The height of one change and the last one: one that is far out does not set the end of a touch.
  constexpr Real twice(Real change) const noexcept { return change < last_ ? change : last_; }

  constexpr void enter(Real change) noexcept {
    state_ = State::contact;
    peak_ = twice(change);
    in_a_row_ = 0;
  }

  constexpr void calm_down(State to) noexcept {
    state_ = to;
    sum_ = 0;
    in_a_row_ = 0;
    if constexpr (Recovers) {
      Extra::fall = 0;
    }
    age_ = 0;
  }

  constexpr int count_in_a_row(bool yes) noexcept {
    const int count = yes ? in_a_row_ + 1 : 0;
    in_a_row_ = static_cast<std::uint8_t>(count);
    return count;
  }

  Real sum_ = 0, peak_ = 0, last_ = 0;
  std::uint16_t age_ = 0;
  std::uint8_t in_a_row_ = 0;
  State state_ = State::idle;
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
