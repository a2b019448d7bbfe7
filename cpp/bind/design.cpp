// SPDX-License-Identifier: MIT
// palpate.design, and the checks of what an estimator's CUSUM is for.

#include <cmath>
#include <cstdio>

#include "detector.hpp"

namespace {

py::tuple cusum(py::handle interval, py::handle smallest_shift, py::handle given_clip) {
  const design::Goal goal{to_real(interval, "false_alarm_interval"), to_real(smallest_shift, "smallest_shift")};
  const double clip = to_real(given_clip, "clip");
  check_goal(goal, clip, false);
  const design::Cusum found = design::cusum(goal.false_alarm_interval, goal.smallest_shift, clip);
  require_threshold(found.threshold, goal);
  return py::make_tuple(found.drift, found.threshold, found.false_alarm_interval, found.delay);
}

double run_length(py::handle drift, py::handle given_threshold, py::handle shift, py::handle clip) {
  const double threshold = to_real(given_threshold, "threshold");
  require(threshold >= 0 && threshold <= 1000, "threshold", threshold, "0 to 1000");
  return design::run_length(to_real(drift, "drift"), threshold, to_real(shift, "shift"), to_real(clip, "clip"));
}

/// As "%g" prints it.
std::string brief(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

}  // namespace

void check_goal(const design::Goal& goal, double clip, bool allows_no_alarm) {
  const double interval = goal.false_alarm_interval, shift = goal.smallest_shift;
  const bool has_alarms = interval >= design::shortest_interval && interval <= design::longest_interval;
  const char* const intervals = allows_no_alarm ? "10 to 1e12 samples, or inf for no alarm" : "10 to 1e12 samples";
  require(has_alarms || (allows_no_alarm && std::isinf(interval) && interval > 0), "false_alarm_interval", interval,
          intervals);
  require(clip >= design::least_clip && clip <= design::most_clip, "clip", clip,
          brief(design::least_clip) + " to " + brief(design::most_clip));
  const double largest = design::largest_shift * clip;
  require(shift > 0 && shift <= largest, "smallest_shift", shift,
          "0 < smallest_shift <= " + brief(design::largest_shift) + " clip (" + number(largest) + ")");
}

void require_threshold(double threshold, const design::Goal& goal) {
  require(!std::isnan(threshold), "smallest_shift", goal.smallest_shift,
          "a larger shift, or a shorter interval than " + brief(goal.false_alarm_interval) +
              " samples: threshold below " + brief(design::most_threshold));
}

void bind_design(py::module_& module) {
  module.def("cusum", &cusum, R"(cusum(false_alarm_interval, smallest_shift, clip, /)
--

Return drift, threshold, false_alarm_interval and delay: see `palpate.design.cusum`.)");
  module.def("run_length", &run_length, R"(run_length(drift, threshold, shift, clip, /)
--

Return a mean run length: see `palpate.design.run_length`.)");
}
