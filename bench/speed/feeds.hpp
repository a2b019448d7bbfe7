// SPDX-License-Identifier: MIT
#pragma once

// A tracker in a long hold, from reading to reading.

#include <cstddef>

#include "series.hpp"

/// Work of one touch, chunk by chunk. A pass leaves the tracker as it was before the chunk, so that it can be repeated.
template <class Tracker>
class Feed {
 public:
  Feed(const HeldReadings& readings, std::size_t chunk, bool with_error)
      : readings_(readings), chunk_(chunk), with_error_(with_error), at_(2 * HeldReadings::idle) {
    begin();
  }

  void work() {
    Tracker tracker = tracker_;
    sink_ = pass(tracker, at_, at_ + chunk_, with_error_);
  }

  /// Go to the next chunk; the pass over it that is not timed reads the chunk before it again.
  void renew() {
    if (at_ + 2 * chunk_ > readings_.hard.size()) {
      begin();
      at_ = 2 * HeldReadings::idle;
    } else {
      pass(tracker_, at_, at_ + chunk_, false);
      at_ += chunk_;
    }
    double sum = 0;
    for (std::size_t i = at_; i < at_ + chunk_; ++i) {
      sum += static_cast<double>(readings_.t_hard[i] + readings_.t_soft[i]) + readings_.hard[i] + readings_.soft[i];
    }
    sink_ = sum;
  }

 private:
  __attribute__((noinline)) double pass(Tracker& tracker, std::size_t from, std::size_t to, bool with_error) const {
    const HeldReadings& in = readings_;
    Tracker local = tracker;
    double sum = 0;
    for (std::size_t i = from; i < to; ++i) {
      sum += local.feed(in.t_hard[i], in.t_soft[i], in.hard[i], in.soft[i]).ratio;
      if (with_error) {
        sum += local.standard_error();
      }
    }
    tracker = local;
    return sum;
  }

  void begin() {
    tracker_ = Tracker();
    tracker_.settings.samples = 0;  // one touch, whatever the scene's length
    tracker_.settings.seconds = 0;
    pass(tracker_, 0, 2 * HeldReadings::idle, false);
  }

  const HeldReadings& readings_;
  std::size_t chunk_;
  bool with_error_;
  std::size_t at_;
  Tracker tracker_;
  volatile double sink_ = 0;
};
