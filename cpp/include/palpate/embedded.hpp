// SPDX-License-Identifier: MIT
#pragma once

// The estimators and scenes for small processors.

#include <palpate/scenes.hpp>

/// The estimators and scenes for small processors: every setting is a compile-time constant. The results have the same
/// bits as with settings in objects.
namespace palpate::embedded {

/// The forgetting factors of the paper.
template <class Real>
using Forgetting = Constant<defaults<SwitchedForgetting<Real>>>;
/// The detector of the paper.
template <class Real>
using Detector = Cusum<Real, Constant<defaults<CusumSettings<Real>>>>;

/// The smallest estimator, with ratio and information only, without check and bound. For a loop whose samples are
/// finite, and whose regressor is never 0 for so long that the information decays to 0.
template <class Real>
using FixedRls = Rls<Real, Constant<defaults<FixedForgetting<Real>>>, NoDetector<Real>, Unbounded<Real>, Unchecked>;

/// The estimator of the paper as printed, without check and bound.
template <class Real>
using PaperRls = Rls<Real, Forgetting<Real>, Detector<Real>, Unbounded<Real>, Unchecked>;

/// As palpate::AdaptiveRls, with check and bound.
template <class Real>
using AdaptiveRls = Rls<Real, Forgetting<Real>, Detector<Real>, Constant<defaults<BoundedCovariance<Real>>>>;

/// As palpate::Handover, the estimator of the scene handheld.
template <class Real>
using Handover = palpate::Handover<Real, Constant<defaults<HandoverSettings<Real>>>>;

/// Lean stage: the level without a test for a drift.
template <class Real>
using Baseline = palpate::Baseline<Real, false>;
/// Lean stage: the gate without a test for a wrong baseline.
template <class Real, const auto& settings = defaults<ContactSettings<Real>>>
using Contact = palpate::Contact<Real, Constant<settings>, false>;

/// Stage of the full scenes: the gate, which notices a wrong baseline.
template <class Real, const auto& settings = defaults<ContactSettings<Real>>>
using FullContact = palpate::Contact<Real, Constant<settings>>;
/// Stage of the full scenes: the ratio over the swept depth.
template <class Real>
using LevelRatio = palpate::LevelRatio<Real, Constant<defaults<LevelRatioSettings<Real>>>>;

/// Lean scene "paper": no flags, no revision, no standard error. `settings` may be a constant of your own.
template <class Real, class Ticks = std::uint32_t, class Estimator = AdaptiveRls<Real>,
          const auto& settings = defaults<TrackerSettings<Estimator>>>
using PaperTracker =
    Tracker<Real, NoAlign<Real, Ticks>, Baseline<Real>, Contact<Real>, Estimator, NoFit<Real>, Constant<settings>>;
/// Lean scene "handheld": a ratio with its standard error, without flags and revision. `settings` may be a constant of
/// your own.
template <class Real, class Ticks = std::uint32_t, class Estimator = Handover<Real>,
          const auto& settings = defaults<TrackerSettings<Estimator>>, class AlignStage = Align<Real, Ticks>>
using HandheldTracker =
    Tracker<Real, AlignStage, Baseline<Real>, Contact<Real>, Estimator, NoFit<Real>, Constant<settings>>;
/// Lean scene "sliding": as embedded::HandheldTracker, a touch ends only by its release.
template <class Real, class Ticks = std::uint32_t, class Estimator = Handover<Real>>
using SlidingTracker = Tracker<Real, Align<Real, Ticks>, Baseline<Real>, Contact<Real, sliding_contact<Real>>,
                               Estimator, NoFit<Real>, Constant<unlimited<Estimator>>>;

/// All that the scene handheld has on a computer; its results have the same bits. `FitStage` NoFit<Real>: no flags, and
/// no revision.
template <class Real, class Ticks = std::uint32_t, class FitStage = Fit<Real>, class Estimator = Handover<Real>,
          const auto& settings = timed<Estimator>,
          class LevelStage = std::conditional_t<FitStage::fits, LevelRatio<Real>, NoLevelRatio<Real>>>
using FullHandheldTracker = Tracker<Real, MatchedPair<Real, Ticks>, palpate::Baseline<Real>, FullContact<Real>,
                                    Estimator, FitStage, Constant<settings>, LevelStage>;

}  // namespace palpate::embedded
