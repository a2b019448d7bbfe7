// SPDX-License-Identifier: MIT
#pragma once

// A touch as its readers see it: with its time, with what the scene promised, and with its flags by name.

#include <cstdint>
#include <palpate/touch.hpp>

namespace palpate::runs {

struct Result : Touch<double> {
  double start_s;
  double period_s;  // from pair to pair
  bool has_length;  // the scene ends a touch at a length
  double initial_covariance;
  bool knows_error;
  bool gap;  // it ended at a gap, or its baseline was measured after one, perhaps in contact

  double alarm_share() const noexcept { return samples > 0 ? static_cast<double>(alarms) / samples : 0.0; }
  bool revised() const noexcept { return revision != Revision::none; }
  double lag_ms() const noexcept { return 1000 * fitted.lag * period_s; }
  // A press raises both channels. Of the probe's ratios, 1 to 10, none is near these limits: then a channel is not wired,
  // or wired to fall.
  bool one_sided() const noexcept {
    constexpr double least = 0.02, most = 50;
    return (knows_error || has_length) && samples > 0 && !(ratio > least && ratio < most);
  }

  /// Calls visit(name) for each flag.
  template <class Visit>
  void visit_flags(Visit&& visit) const {
    const auto readings = static_cast<double>(samples) + refused + saturated;
    if (has_length && !full) visit("short");
    if (saturated > 0) visit("saturated");
    if (refused > 0.75 * readings) visit("refused");
    if (knows_error && standard_error != standard_error) visit("unsettled");
    if (!(covariance <= 0.1 * initial_covariance)) visit("unexcited");
    if (one_sided()) visit("one-sided");
    if (fitted.flags & misfit_offset) visit("offset");
    if (fitted.flags & misfit_drift) visit("drift");
    if (fitted.flags & misfit_lag) visit("lag");
    if (fitted.flags & misfit_curve) visit("curve");
    if (revision == Revision::creep) visit("creep");
    if (revision == Revision::baseline) visit("baseline");
    if (gap) visit("gap");
  }
};

}  // namespace palpate::runs
