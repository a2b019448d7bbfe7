// SPDX-License-Identifier: MIT
#pragma once

// The scenes: which stages each one has.

#include <palpate/tracker.hpp>

namespace palpate {

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

/// Scene "fixed": for a loop that supplies changes without faults, as one endless touch. The smallest scene.
template <class Real, class Ticks = std::int64_t>
using FixedTracker = Tracker<Real, NoAlign<Real, Ticks>, NoBaseline<Real>, AlwaysContact<Real>, FixedRls<Real>,
                             NoFit<Real>, Kept<TrackerSettings<FixedRls<Real>>, unlimited<FixedRls<Real>>>>;
/// Scene "paper": the estimator of the paper, 250 samples from contact.
template <class Real, class Ticks = std::int64_t>
using PaperTracker = Tracker<Real, NoAlign<Real, Ticks>, Baseline<Real>, Contact<Real>, AdaptiveRls<Real>>;
/// Scene "handheld": a probe held in the hand.
template <class Real, class Ticks = std::int64_t>
using HandheldTracker =
    Tracker<Real, MatchedPair<Real, Ticks>, Baseline<Real>, Contact<Real>, Handover<Real>, Fit<Real>,
            Kept<TrackerSettings<Handover<Real>>, timed<Handover<Real>>>, LevelRatio<Real>>;
/// Scene "sliding": a probe that slides over tissue.
template <class Real, class Ticks = std::int64_t>
using SlidingTracker = Tracker<Real, MatchedPair<Real, Ticks>, Baseline<Real>,
                               Contact<Real, Kept<ContactSettings<Real>, sliding_contact<Real>>>, Handover<Real>,
                               Fit<Real>, Kept<TrackerSettings<Handover<Real>>, unlimited<Handover<Real>>>>;

}  // namespace palpate
