// SPDX-License-Identifier: MIT
#pragma once

// Times that a computer gave to readings when they arrived, a few milliseconds early or late.

#include <palpate/stage/align.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// The times of a converter whose readings are evenly spaced, from the times of their arrival: a line through the last
/// `memory` of them by least squares, as a recursion (Kalata 1984):
///
///     e = time - forecast,  a = 2 (2 n - 1) / (n (n + 1)),  b = 6 / (n (n + 1))
///     t' = forecast + a e,  P' = P + b e
///
/// A gap of whole periods is lost readings; after anything else the line begins again.
template <class Real, class Time>
class SteadyStamps {
 public:
  static constexpr int memory = 64;  ///< readings

  /// The time of a reading, from the time of its arrival.
  constexpr Time smooth(Time time) noexcept {
    const auto since = static_cast<Real>(time.since(base_));
    if (count_ < 2) {
      return begin(time, since);
    }
    const Real periods = (since - line_) / period_;
    const auto whole = static_cast<int>(periods > 0 && periods < 1000 ? periods + Real(0.5) : Real(0));
    const Real error = since - line_ - product(static_cast<Real>(whole), period_);
    if (whole < 1 || !(magnitude(since) < furthest) || (count_ >= 8 && magnitude(error) > period_ / 3)) {
      count_ = 0;
      return begin(time, Real(0));
    }
    count_ += count_ < memory;
    const Real n = static_cast<Real>(count_), scale = 2 / product(n, n + 1);
    line_ = since - error + product(product(scale, 2 * n - 1), error);
    period_ += product(3 * scale, error);
    const auto whole_ticks = static_cast<typename Time::Signed>(line_);
    base_ = base_.later(whole_ticks);
    line_ -= static_cast<Real>(whole_ticks);
    return base_;
  }

 private:
  // So that the line stays in the range of the ticks.
  static constexpr Real furthest = static_cast<Real>(std::numeric_limits<typename Time::Signed>::max()) / 4;

  constexpr Time begin(Time time, Real since) noexcept {
    period_ = since;
    line_ = 0;
    base_ = time;
    count_ = count_ == 1 && !(since > 0) ? 1 : count_ + 1;
    return time;
  }

  Time base_;
  Real line_ = 0, period_ = 0;  // ticks after base
  int count_ = 0;
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
