// SPDX-License-Identifier: MIT
#pragma once

// The scenes: which stages each one has. One of your own derives from one of them, and replaces a line:
//
//     struct Mine : palpate::Handheld<float, palpate::Microseconds> {
//       using contact = palpate::Contact<float, palpate::Constant<late>>;
//     };
//     palpate::Tracker<Mine> probe;

#include <palpate/stage/given_baseline.hpp>
#include <palpate/tracker.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// Settings with which a touch is as long as 250 pairs of the converter.
template <class Estimator, class Real = typename Estimator::real_type>
inline constexpr TrackerSettings<Estimator> timed{Real(6.5), 0, Real(0.6)};
/// Settings with which a touch ends only by its release.
template <class Estimator, class Real = typename Estimator::real_type>
inline constexpr TrackerSettings<Estimator> unlimited{Real(0), 0};
/// Contact settings for sliding. The height varies, so a release is below 0.3 of the highest value.
template <class Real>
inline constexpr ContactSettings<Real> sliding_contact = [] {
  ContactSettings<Real> settings;
  settings.release = Real(0.3);
  return settings;
}();

/// Settings are members of the objects, and may change.
struct InObjects {
  template <class Values, const Values& first = defaults<Values>>
  using keep = Kept<Values, first>;  ///< the settings `first`
};
/// Settings are compile-time constants.
struct AsConstants {
  template <class Values, const Values& first = defaults<Values>>
  using keep = Constant<first>;  ///< the settings `first`
};

/// Settings as `Settings`, one of these two, keeps them.
template <class Settings, class Values, const Values& first = defaults<Values>>
using KeptAs = typename Settings::template keep<Values, first>;

/// Scene "fixed": for a loop that supplies changes without faults, as one endless touch. The smallest scene.
template <class Real, class Time = Nanoseconds, class Settings = InObjects>
struct Fixed {
  static_assert(is_real<Real>,
                "palpate: a scene is of float or double; of a scene of your own, palpate::Tracker<Mine>");
  using real_type = Real;               ///< float or double
  using time_type = Time;               ///< Ticks with their unit
  using screen = NoScreen<Real, Time>;  ///< judges readings
  using align = NoAlign<Real, Time>;    ///< from two readings to a pair
  using baseline = NoBaseline<Real>;    ///< of a channel without contact
  using contact = AlwaysContact<Real>;  ///< begin and end of a touch
  using levels = NoLevels;              ///< jumps and steps
  using estimator = FixedRls<Real>;     ///< of the ratio
  template <class Estimator>
  using judge_for = NoJudge<Estimator>;  ///< flags, level ratio, revision
  template <class Estimator>
  using settings_for = KeptAs<Settings, TrackerSettings<Estimator>, unlimited<Estimator>>;  ///< of all
};

/// Scene "paper": the estimator of the paper, 250 samples from contact.
template <class Real, class Time = Nanoseconds, class Settings = InObjects>
struct Paper : Fixed<Real, Time, Settings> {
  using baseline = Baseline<Real>;                                         ///< of a channel without contact
  using contact = Contact<Real, KeptAs<Settings, ContactSettings<Real>>>;  ///< begin and end of a touch
  using estimator = AdaptiveRls<Real>;                                     ///< of the ratio
  template <class Estimator>
  using settings_for = KeptAs<Settings, TrackerSettings<Estimator>>;  ///< of all
};

/// Scene "handheld": a probe held in the hand.
template <class Real, class Time = Nanoseconds, class Settings = InObjects>
struct Handheld : Paper<Real, Time, Settings> {
  using screen = Screen<Real, Time>;      ///< judges readings
  using align = MatchedPair<Real, Time>;  ///< from two readings to a pair
  using baseline = GivenBaseline<Real>;   ///< of a channel without contact; give() where it is known
  using levels = Levels<Real, Time>;      ///< jumps and steps
  using estimator = Handover<Real, KeptAs<Settings, HandoverSettings<Real>>>;  ///< of the ratio
  /// flags, level ratio, revision
  template <class Estimator>
  using judge_for = Judge<Estimator, Time, LevelRatio<Real, KeptAs<Settings, LevelRatioSettings<Real>>>>;
  template <class Estimator>
  using settings_for = KeptAs<Settings, TrackerSettings<Estimator>, timed<Estimator>>;  ///< of all
};

/// Scene "sliding": a probe that slides over tissue.
template <class Real, class Time = Nanoseconds, class Settings = InObjects>
struct Sliding : Handheld<Real, Time, Settings> {
  /// of the ratio, which may move
  using estimator = AdaptiveWindow<Real, KeptAs<Settings, AdaptiveWindowSettings<Real>>>;
  /// begin and end of a touch
  using contact = Contact<Real, KeptAs<Settings, ContactSettings<Real>, sliding_contact<Real>>>;
  template <class Estimator>
  using judge_for = Judge<Estimator, Time, NoLevelRatio<Real>>;  ///< flags, level ratio, revision
  template <class Estimator>
  using settings_for = KeptAs<Settings, TrackerSettings<Estimator>, unlimited<Estimator>>;  ///< of all
};

/// The tracker of scene "fixed".
template <class Real, class Time = Nanoseconds>
using FixedTracker = Tracker<Fixed<Real, Time>>;
/// The tracker of scene "paper".
template <class Real, class Time = Nanoseconds>
using PaperTracker = Tracker<Paper<Real, Time>>;
/// The tracker of scene "handheld".
template <class Real, class Time = Nanoseconds>
using HandheldTracker = Tracker<Handheld<Real, Time>>;
/// The tracker of scene "sliding".
template <class Real, class Time = Nanoseconds>
using SlidingTracker = Tracker<Sliding<Real, Time>>;

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
