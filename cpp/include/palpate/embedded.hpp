// SPDX-License-Identifier: MIT
#pragma once

// The estimators and scenes for small processors.

#include <palpate/estimator/adaptive_window.hpp>
#include <palpate/scenes.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {
/// The estimators and scenes for small processors: every setting is a compile-time constant. The results have the same
/// bits as with settings in objects.
namespace embedded {

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

/// As palpate::AdaptiveWindow, for any two signals. A level more doubles the longest window, which has some 8 * 2^levels samples, and
/// takes 28 numbers.
template <class Real, int levels = 10>
using AdaptiveWindow =
    palpate::AdaptiveWindow<Real, Constant<defaults<AdaptiveWindowSettings<Real>>>, DyadicWindows<Real, levels>>;

/// All that the scene handheld has on a computer, with the same bits: flags, level ratio, revision.
template <class Real, class Time = Microseconds>
using FullHandheld = Handheld<Real, Time, AsConstants>;

/// Lean scene "paper": no test for a drift of the baseline, or for one that was measured in contact.
template <class Real, class Time = Microseconds>
struct LeanPaper : Paper<Real, Time, AsConstants> {
  using baseline = Baseline<Real, false>;                                           ///< of a channel without contact
  using contact = Contact<Real, Constant<defaults<ContactSettings<Real>>>, false>;  ///< begin and end of a touch
  using estimator = embedded::AdaptiveRls<Real>;                                    ///< of the ratio
};

/// Lean scene "handheld": a ratio with its standard error, without flags and revision; 250 samples.
template <class Real, class Time = Microseconds>
struct LeanHandheld : LeanPaper<Real, Time> {
  using align = Align<Real, Time>;             ///< from two readings to a pair
  using estimator = embedded::Handover<Real>;  ///< of the ratio
};

/// Lean scene "sliding": as LeanHandheld, a touch ends only by its release.
template <class Real, class Time = Microseconds>
struct LeanSliding : LeanHandheld<Real, Time> {
  using contact = Contact<Real, Constant<sliding_contact<Real>>, false>;  ///< begin and end of a touch
  template <class Estimator>
  using settings_for = Constant<unlimited<Estimator>>;  ///< of all
};

/// The tracker of FullHandheld.
template <class Real, class Time = Microseconds>
using FullHandheldTracker = Tracker<FullHandheld<Real, Time>>;
/// The tracker of LeanHandheld.
template <class Real, class Time = Microseconds>
using HandheldTracker = Tracker<LeanHandheld<Real, Time>>;
/// The tracker of LeanPaper.
template <class Real, class Time = Microseconds>
using PaperTracker = Tracker<LeanPaper<Real, Time>>;
/// The tracker of LeanSliding.
template <class Real, class Time = Microseconds>
using SlidingTracker = Tracker<LeanSliding<Real, Time>>;

}  // namespace embedded
}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
