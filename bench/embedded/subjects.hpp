// SPDX-License-Identifier: MIT
#pragma once

// The subjects: scenes, estimators and stages in float, each with its state and a function for one reading.

#include <palpate/embedded.hpp>

#include "readings.hpp"

namespace subjects {

using namespace palpate;
using Ticks = std::uint32_t;

/// An estimator: takes the changes of both channels.
template <class Estimator>
struct Changes {
  using State = Estimator;
  static void take(State& state, float output, float regressor) { state.update(output, regressor); }
  template <class Function>
  static auto with(Function* function, State& state, const Reading& r) {
    return function(state, r.hard - Readings::idle_hard, r.soft - Readings::idle_soft);
  }
};
struct Fixed : Changes<embedded::FixedRls<float>> {};
struct FixedSafe : Changes<FixedRls<float>> {};
struct Paper : Changes<embedded::PaperRls<float>> {};
struct PaperSafe : Changes<embedded::AdaptiveRls<float>> {};
struct PaperRuntime : Changes<AdaptiveRls<float>> {};
struct HandoverEstimator : Changes<embedded::Handover<float>> {};

/// The gate and the window of samples before an estimator, for a loop that subtracts the baseline itself.
struct Gated {
  using State = embedded::GatedRls<float>;
  static bool take(State& state, float output, float regressor) { return state.feed(output, regressor).finished; }
  template <class Function>
  static auto with(Function* function, State& state, const Reading& r) {
    return function(state, r.hard - Readings::idle_hard, r.soft - Readings::idle_soft);
  }
};

/// A whole scene: takes both readings.
template <class Scene>
struct Whole {
  using State = Scene;
  static bool take(State& state, Ticks t_hard, Ticks t_soft, float hard, float soft) {
    return state.feed(t_hard, t_soft, hard, soft).finished;
  }
  template <class Function>
  static auto with(Function* function, State& state, const Reading& r) {
    return function(state, r.t_hard, r.t_soft, r.hard, r.soft);
  }
};
struct PaperScene : Whole<embedded::PaperTracker<float>> {};
struct Handheld : Whole<embedded::HandheldTracker<float>> {};
struct Sliding : Whole<embedded::SlidingTracker<float>> {};
struct HandheldRuntime : Whole<HandheldTracker<float, Ticks>> {};

struct AlignStage {
  using State = embedded::Align<float, Ticks>;
  static float take(State& state, Ticks t_hard, Ticks t_soft, float hard, float soft) {
    return state.feed(t_hard, t_soft, hard, soft).soft;
  }
  template <class Function>
  static auto with(Function* function, State& state, const Reading& r) {
    return function(state, r.t_hard, r.t_soft, r.hard, r.soft);
  }
};

struct BaselineStage {
  using State = embedded::Baseline<float>;
  static void take(State& state, float value) {
    if (state.ready()) {
      state.follow(value);
    } else {
      state.collect(value);
    }
  }
  template <class Function>
  static auto with(Function* function, State& state, const Reading& r) {
    return function(state, r.soft);
  }
};

struct ContactStage {
  using State = embedded::Contact<float>;
  static void take(State& state, float change, float noise) { state.update(change, noise); }
  template <class Function>
  static auto with(Function* function, State& state, const Reading& r) {
    return function(state, magnitude(r.soft - Readings::idle_soft), 2e-5f);
  }
};

/// For estimators without check: only finite samples.
template <class Subject>
bool accepts(const Reading& r) {
  return !(std::is_same_v<Subject, Fixed> || std::is_same_v<Subject, Paper>) ||
         (is_finite(r.hard) && is_finite(r.soft));
}

/// The function of a subject, compiled separately: subject.cpp.
template <class Subject, class Function = decltype(Subject::take)>
struct Entry;
template <class Subject, class Result, class... Values>
struct Entry<Subject, Result(Values...)> {
  using Function = Result(Values...);
  static Result feed(Values... values);
};

/// Calls visit(name, Subject()) for each subject.
template <class Visit>
void for_each(Visit visit) {
  visit("Fixed", Fixed());
  visit("FixedSafe", FixedSafe());
  visit("Paper", Paper());
  visit("PaperSafe", PaperSafe());
  visit("PaperRuntime", PaperRuntime());
  visit("Gated", Gated());
  visit("HandoverEstimator", HandoverEstimator());
  visit("AlignStage", AlignStage());
  visit("BaselineStage", BaselineStage());
  visit("ContactStage", ContactStage());
  visit("PaperScene", PaperScene());
  visit("Handheld", Handheld());
  visit("Sliding", Sliding());
  visit("HandheldRuntime", HandheldRuntime());
}

}  // namespace subjects
