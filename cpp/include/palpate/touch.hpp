// SPDX-License-Identifier: MIT
#pragma once

// The result of a touch, and the state after a reading.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <palpate/stage/fit.hpp>
#include <palpate/stage/revision.hpp>

namespace palpate {

struct Counts {
  std::size_t start = 0;  // index of the first reading of the touch, from 0
  std::uint32_t samples = 0, alarms = 0, saturated = 0, refused = 0;
};

/// The result of a touch: ratio and standard_error are the best that is known; first_ratio is the one at its end.
template <class Real>
struct Touch : Counts {
  Real ratio = 0, covariance = 0;
  Real standard_error = std::numeric_limits<Real>::quiet_NaN();
  Real first_ratio = 0;
  Real first_standard_error = std::numeric_limits<Real>::quiet_NaN();
  bool full = false;  // it has the wanted length
  Revision revision = Revision::none;
  Real shift = 0;  // of the ratio, by the revision, share; where it is not corrected, what it would have been
  Fitted<Real> fitted{};
};

/// The state after a reading.
template <class Real>
struct Report {
  Real ratio;
  bool alarm, contact;
  bool finished;         // touch() is new
  bool revised = false;  // touch() is revised
};

}  // namespace palpate
