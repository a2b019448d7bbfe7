// SPDX-License-Identifier: MIT
#pragma once

// Python's estimators take an interval between false alarms and a smallest shift. From these follow the drift and the threshold
// of the core.

#include <cstring>
#include <limits>
#include <palpate/design.hpp>
#include <palpate/settings.hpp>
#include <type_traits>

#include "settings.hpp"

namespace design = palpate::design;

/// ValueError for a number outside of its range. An infinite interval means no alarm; an estimator allows it.
void check_goal(const design::Goal& goal, double clip, bool allows_no_alarm);

/// ValueError for a goal whose threshold would be too large.
void require_threshold(double threshold, const design::Goal& goal);

/// A struct of settings of the core, without those of its detectors.
template <class Values>
struct WithoutCusum : Values {
  static constexpr auto visit_fields = [](auto& s, auto&& visit) noexcept {
    Values::visit_fields(s, [&visit](const char* name, auto& value, bool allowed, const char* text) {
      if (std::strcmp(name, "drift") != 0 && std::strcmp(name, "threshold") != 0 && std::strcmp(name, "cut") != 0) {
        visit(name, value, allowed, text);
      }
    });
  };
};

inline Settings goal_settings() {
  const design::Goal goal;
  Settings settings;
  settings.add("false_alarm_interval", goal.false_alarm_interval);
  settings.add("smallest_shift", goal.smallest_shift);
  return settings;
}
inline design::Goal goal_of(const Settings& s) { return {s["false_alarm_interval"], s["smallest_shift"]}; }
inline void check_goal(const Settings& s) { check_goal(goal_of(s), s["clip"], true); }

/// The struct of the core with these settings, and its detectors. The last one is kept: an estimator that is reset, or one of
/// many that are unpickled, has the same.
template <class Values>
Values with_cusum(const Settings& s, double share) {
  const design::Goal goal = goal_of(s);
  const Values values = s.values<WithoutCusum<Values>>();
  thread_local design::Goal last_goal;
  thread_local Values last;
  const bool is_last = goal.false_alarm_interval == last_goal.false_alarm_interval &&
                       goal.smallest_shift == last_goal.smallest_shift && values.clip == last.clip;
  if (!is_last) {
    last = design::with_cusum(values, goal, share);
    last_goal = goal;
  }
  Values result = values;
  result.drift = last.drift;
  result.threshold = last.threshold;
  if constexpr (design::has_windows<Values>) {
    result.cut = last.cut;
  }
  require_threshold(static_cast<double>(result.threshold), goal);
  return result;
}

template <class Type>
using HasThreshold = decltype(std::declval<const Type&>().settings.threshold);

/// Above it the statistic of an estimator is an alarm; infinite without a detector.
template <class Core>
double threshold_of(const Core& core) {
  if constexpr (palpate::detail::has<HasThreshold, Core>) {
    return static_cast<double>(core.settings.threshold);
  } else if constexpr (palpate::detail::has<HasThreshold, std::decay_t<decltype(core.detector())>>) {
    return static_cast<double>(core.detector().settings.threshold);
  } else {
    return std::numeric_limits<double>::infinity();
  }
}
