// SPDX-License-Identifier: MIT
#pragma once

// The result of a touch, and the state after a reading.

#include <palpate/judge/model_test.hpp>
#include <palpate/judge/revision.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// Numbers of readings and samples of a touch.
struct Counts {
  std::size_t start = 0;        ///< index of the first reading of the touch, from 0
  std::uint32_t samples = 0;    ///< that the estimator took
  std::uint32_t alarms = 0;     ///< samples with an alarm of the detector
  std::uint32_t saturated = 0;  ///< readings from full_scale on, which are not used
  std::uint32_t refused = 0;    ///< other readings without a sample: no value, no pair, or refused by the estimator
};

/// The result of a touch: ratio and standard_error are the best that is known; first_ratio is the one at its end. All are
/// NaN if there is no sample; a standard error, too, if the estimator has none.
template <class Real>
struct Touch : Counts {
  Real ratio = 0;                                  ///< of the changes, hard to soft
  Real covariance = 0;                             ///< of the estimator, unscaled, 1/pF^2
  Real standard_error = not_a_number<Real>;        ///< of the ratio
  Real first_ratio = 0;                            ///< before a revision
  Real first_standard_error = not_a_number<Real>;  ///< before a revision
  std::uint32_t outliers = 0;                      ///< readings left out as such, of the channel with more of them
  bool full = false;                               ///< it has the wanted length
  Revision revision = Revision::none;              ///< what the baseline after the touch says
  Real shift = 0;  ///< of the ratio, by the revision, share; where it is not corrected, what it would have been
  Misfits<Real> misfits{};          ///< what contradicts the model, and its flags
  Estimate<Real> level{};           ///< the ratio over the swept depth, which a tilt does not change
  Real depth = not_a_number<Real>;  ///< change of the soft channel where the press had settled
  Real rise = not_a_number<Real>;   ///< seconds from the contact to the moment when it had settled
  // With the flag misfit_changed one of them is known:
  Estimate<Real> before{};  ///< the ratio before a change that was confirmed: `ratio` is the one after it
  Estimate<Real> after{};   ///< the ratio after a change that was not, from few samples: `ratio` is the one before it
};

/// The state after a reading.
template <class Real>
struct Report {
  Real ratio;            ///< of the running touch, or of the last one
  bool alarm;            ///< the detector has an alarm
  bool contact;          ///< the probe touches something
  bool finished;         ///< touch() is new
  bool revised = false;  ///< touch() is revised
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
