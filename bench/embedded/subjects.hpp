// SPDX-License-Identifier: MIT
#pragma once

// The subjects: scenes, estimators and stages in float, each with its state and a function for one reading.

#include <palpate/embedded.hpp>
#include <palpate/estimator/vector_rls.hpp>

#include "readings.hpp"

namespace subjects {

using namespace palpate;

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
struct WindowEstimator : Changes<embedded::AdaptiveWindow<float>> {};
template <const auto& settings, int Window>
struct Line : VectorRls<float, 1, true, Constant<settings>, Window> {
  void update(float output, float regressor) { Line::VectorRls::update(output, {regressor}); }
  float ratio() const { return this->coefficients()[0]; }
  float information() const { return this->coefficients()[1]; }
};
inline constexpr VectorSettings<float> vector_settings, short_memory = {0.995f, 0.75f, 12, 3, 0.9f};
struct SlopeAndIntercept : Changes<Line<vector_settings, 32>> {};
struct SlopeWindow16 : Changes<Line<vector_settings, 16>> {};
struct SlopeWindow8 : Changes<Line<vector_settings, 8>> {};
struct SlopeAlarmed : Changes<Line<short_memory, 32>> {};

/// A whole scene: takes both readings.
template <class Scene>
struct Whole {
  using State = Scene;
  static bool take(State& state, std::uint32_t t_hard, std::uint32_t t_soft, float hard, float soft) {
    const auto report = state.feed(Microseconds(t_hard), Microseconds(t_soft), hard, soft);
    return report.finished || report.revised;
  }
  template <class Function>
  static auto with(Function* function, State& state, const Reading& r) {
    return function(state, r.t_hard, r.t_soft, r.hard, r.soft);
  }
};
struct PaperScene : Whole<embedded::PaperTracker<float>> {};
struct Handheld : Whole<embedded::HandheldTracker<float>> {};
struct Matched : embedded::LeanHandheld<float> {
  using align = MatchedPair<float, Microseconds>;
};
struct Unjudged : embedded::FullHandheld<float> {
  template <class Estimator>
  using judge_for = NoJudge<Estimator>;
};
struct Tilted : embedded::FullHandheld<float> {
  template <class Estimator>
  using judge_for = Judge<Estimator, Microseconds, NoLevelRatio<float>>;
};
struct HandheldMatched : Whole<Tracker<Matched>> {};
struct HandheldUnfitted : Whole<Tracker<Unjudged>> {};
struct HandheldTilted : Whole<Tracker<Tilted>> {};
struct HandheldFull : Whole<embedded::FullHandheldTracker<float>> {};
struct Sliding : Whole<embedded::SlidingTracker<float>> {};
struct HandheldRuntime : Whole<HandheldTracker<float, Microseconds>> {};

template <class Stage>
struct Aligns {
  using State = Stage;
  static float take(State& state, std::uint32_t t_hard, std::uint32_t t_soft, float hard, float soft) {
    return state.feed(Microseconds(t_hard), Microseconds(t_soft), hard, soft).soft;
  }
  template <class Function>
  static auto with(Function* function, State& state, const Reading& r) {
    return function(state, r.t_hard, r.t_soft, r.hard, r.soft);
  }
};

struct AlignStage : Aligns<Align<float, Microseconds>> {};
struct MatchedPairStage : Aligns<MatchedPair<float, Microseconds>> {};

/// The sums of a pair; its result is taken at reading 367, the end of the first touch.
struct FitStage {
  struct State : ModelTest<float> {
    std::uint32_t count = 0;
    float drift = 0;
  };
  static float take(State& state, float output, float regressor) {
    state.add(output, regressor, state.count);
    if (++state.count == 368) {
      state.drift = state.result(1e-5f, 1e-5f, 2.5f).drift;
    }
    return state.drift;
  }
  template <class Function>
  static auto with(Function* function, State& state, const Reading& r) {
    return function(state, r.hard - Readings::idle_hard, r.soft - Readings::idle_soft);
  }
};

template <class Stage>
struct Follows {
  using State = Stage;
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

struct BaselineStage : Follows<Baseline<float, false>> {};
struct FullBaselineStage : Follows<Baseline<float>> {};

template <class Stage>
struct Gates {
  using State = Stage;
  static void take(State& state, float change, float noise) { state.update(change, noise); }
  template <class Function>
  static auto with(Function* function, State& state, const Reading& r) {
    return function(state, magnitude(r.soft - Readings::idle_soft), 2e-5f);
  }
};

struct ContactStage : Gates<embedded::LeanPaper<float>::contact> {};
struct FullContactStage : Gates<embedded::FullHandheld<float>::contact> {};

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
  visit("HandoverEstimator", HandoverEstimator());
  visit("WindowEstimator", WindowEstimator());
  visit("SlopeAndIntercept", SlopeAndIntercept());
  visit("AlignStage", AlignStage());
  visit("MatchedPairStage", MatchedPairStage());
  visit("BaselineStage", BaselineStage());
  visit("FullBaselineStage", FullBaselineStage());
  visit("ContactStage", ContactStage());
  visit("FullContactStage", FullContactStage());
  visit("FitStage", FitStage());
  visit("PaperScene", PaperScene());
  visit("Handheld", Handheld());
  visit("HandheldMatched", HandheldMatched());
  visit("HandheldUnfitted", HandheldUnfitted());
  visit("HandheldTilted", HandheldTilted());
  visit("HandheldFull", HandheldFull());
  visit("Sliding", Sliding());
  visit("HandheldRuntime", HandheldRuntime());
}

/// The same for other bounds of the hand-over of VectorRls: their costs alone are of interest.
template <class Visit>
void for_each_window(Visit visit) {
  visit("SlopeWindow16", SlopeWindow16());
  visit("SlopeWindow8", SlopeWindow8());
  visit("SlopeAlarmed", SlopeAlarmed());
}

}  // namespace subjects
