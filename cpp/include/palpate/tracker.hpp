// SPDX-License-Identifier: MIT
#pragma once

// Tracker: all stages of a scene, from two readings to the result of a touch. The scenes themselves: scenes.hpp.

#include <palpate/estimator/adaptive_window.hpp>
#include <palpate/estimator/handover.hpp>
#include <palpate/judge/judge.hpp>
#include <palpate/stage/contact_detector.hpp>
#include <palpate/stage/front.hpp>
#include <palpate/stage/levels.hpp>
#include <palpate/stage/screen.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// Settings of a Tracker.
template <class Estimator>
struct TrackerSettings {
  using Real = typename Estimator::real_type;  ///< float or double
  Real seconds = Real(0);                      ///< length of a touch; 0: no limit, a touch ends by its release
  std::uint32_t samples = 250;                 ///< length of a touch; 0: no limit
  Real confirmed = Real(0);                    ///< with a judge: seconds that a change needs to be the result; 0: none
  Real initial_ratio = Real(1);                ///< of the estimator at the begin of a touch
  Real initial_covariance = Estimator::default_covariance;  ///< the same, 1/pF^2
  Real full_scale = std::numeric_limits<Real>::infinity();  ///< readings from this size on are saturated
  Real averaged = Real(0.025);  ///< with a matched pair: a fast converter's readings become means over these seconds
  bool falling = false;         ///< a press makes both channels fall, as mutual capacitances do

  /// As FixedForgetting::visit_fields.
  static constexpr auto visit_fields = [](auto& s, auto&& visit) noexcept {
    visit("initial_ratio", s.initial_ratio, is_finite(s.initial_ratio), "a finite number");
    visit("initial_covariance", s.initial_covariance, s.initial_covariance > 0, "0 < initial_covariance");
    visit("seconds", s.seconds, s.seconds >= 0, "0 <= seconds");
    visit("samples", s.samples, true, "0 <= samples");
    visit("full_scale", s.full_scale, s.full_scale > 0, "0 < full_scale, pF");
    visit("confirmed", s.confirmed, s.confirmed >= 0, "0 <= confirmed");
    visit("averaged", s.averaged, 0 <= s.averaged && s.averaged <= 1, "0 <= averaged <= 1");
    visit("falling", s.falling, true, "true or false");
  };
};

namespace detail {
template <class Stage>
using MeasuresLevel =
    decltype(of<Stage>().collect(0), of<Stage>().follow(0), of<Stage>().mark(), of<Stage>().rewind(),
             of<Stage>().reset(), of<Stage>().keep(), of<Stage>().collected(0, 1), bool(of<Stage>().empty()),
             bool(Stage::timed), bool(of<Stage>().ready()), bool(of<Stage>().disturbed()), of<Stage>().level(),
             of<Stage>().expected(), of<Stage>().noise(), of<Stage>().variance());
template <class Stage>
using Touches = decltype(of<typename Stage::real_type>(), Stage::releases, Stage::recovers, of<Stage>().update(0, 0, 0),
                         of<Stage>().reset(), bool(of<Stage>().contact()), bool(of<Stage>().idle()), of<Stage>().age(),
                         bool(of<Stage>().suspects()), of<Stage>().update_between(0, 0), bool(of<Stage>().fell()),
                         bool(of<Stage>().pressed()));
template <class Estimator, class Real = typename Estimator::real_type>
using Estimates =
    decltype(Real(Estimator::default_covariance), of<Estimator>().reset(Real(), Real()),
             bool(of<Estimator>().update(Real(), Real()).accepted), bool(of<Estimator>().update(Real(), Real()).alarm),
             Real(of<Estimator>().ratio()), Real(of<Estimator>().covariance()));
template <class Stage, class Time = typename Stage::time_type>
using Screens = decltype(bool(Stage::screens), of<const Stage>().due_time(Time()), int(of<const Stage>().waiting()));
template <class Estimator>
using Judgeable = decltype(of<const Estimator>().mean_regressor(), of<const Estimator>().count(),
                           of<const Estimator>().mean_square());

template <class Scene>
using IsScene =
    std::void_t<typename Scene::real_type, typename Scene::time_type, typename Scene::screen, typename Scene::align,
                typename Scene::baseline, typename Scene::contact, typename Scene::levels, typename Scene::estimator>;
template <class Stage, class Time = typename Stage::time_type>
using RealOfPair = std::decay_t<decltype(of<Stage>().feed(Time(), Time(), 0, 0, true).hard)>;
template <class Stage>
using RealOfLevel = std::decay_t<decltype(of<Stage>().level())>;
template <class Stage>
using RealOf = typename Stage::real_type;
template <class Stage>
using TimeOf = typename Stage::time_type;

// Whether a type of a stage is the wanted one. A stage without it has another sentence.
template <template <class...> class Of, class Stage, class Wanted>
constexpr bool agrees() noexcept {
  if constexpr (has<Of, Stage>) {
    return std::is_same_v<Of<Stage>, Wanted>;
  } else {
    return true;
  }
}

/// First of all: what a scene is, and what each part of it needs to be named at all.
template <class Scene>
struct SceneIs {
  static_assert(has<IsScene, Scene>,
                "palpate::Tracker: a scene is a struct with the members of palpate::Fixed: derive from a scene, and "
                "replace what differs");
  static_assert(is_ticks<typename Scene::time_type>,
                "palpate::Tracker: the times of a scene are palpate::Ticks, as palpate::Microseconds");
  static_assert(has<Estimates, typename Scene::estimator>,
                "palpate::Tracker: an estimator needs real_type, default_covariance, update(output, regressor), which "
                "returns a Step, reset(ratio, covariance), ratio() and covariance()");
};

/// What a Tracker needs of its scene: each sentence names what is missing.
template <class Scene>
struct SceneChecks : SceneIs<Scene> {
  using Real = typename Scene::real_type;
  using Time = typename Scene::time_type;
  using Screen = typename Scene::screen;
  using Align = typename Scene::align;
  using Baseline = typename Scene::baseline;
  using Contact = typename Scene::contact;
  using Estimator = typename Scene::estimator;
  using Judge = typename Scene::template judge_for<Estimator>;
  static_assert(has<Screens, Screen>, "palpate::Tracker: a screen needs the members of NoScreen");
  static_assert(agrees<TimeOf, Align, Time>() && agrees<TimeOf, Screen, Time>(),
                "palpate::Tracker: the screen or the align stage has another time_type than the scene");
  static_assert(has<Aligns, Align>, "palpate::Tracker: an align stage needs the members of NoAlign, with `time_type`");
  static_assert(has<MeasuresLevel, Baseline>, "palpate::Tracker: a baseline needs the functions of NoBaseline");
  static_assert(has<Touches, Contact>, "palpate::Tracker: a contact needs the members of AlwaysContact");
  static_assert(agrees<RealOfPair, Align, Real>() && agrees<RealOf, Screen, Real>() &&
                    agrees<RealOfLevel, Baseline, Real>() && agrees<RealOf, Contact, Real>() &&
                    agrees<RealOf, Estimator, Real>(),
                "palpate::Tracker: a stage or the estimator has another Real than the scene");
  static_assert(!Judge::judges || has<Matches, Align>,
                "palpate::Tracker: a Judge needs an align stage whose pairs have `matched`, and its pace(), as "
                "MatchedPair; else use NoJudge");
  static_assert(
      !Judge::judges || (knows_its_error<Estimator> && has<Judgeable, Estimator>),
      "palpate::Tracker: a Judge needs an estimator with the standard error of Handover or of AdaptiveWindow, "
      "mean_regressor(), mean_square() and count(); else use NoJudge");
};

/// The parts of a Tracker, after their checks.
template <class Scene>
struct Parts : SceneChecks<Scene> {
  using Settings = typename Scene::template settings_for<typename Scene::estimator>;
  using Detector = ContactDetector<typename Scene::real_type, typename Scene::time_type, typename Scene::baseline,
                                   typename Scene::contact>;
  using Front = palpate::Front<typename Scene::real_type, typename Scene::align>;
  using Judging = KeptJudgements<typename Scene::real_type, typename Scene::time_type,
                                 Scene::screen::screens || Scene::levels::watches>;
};
}  // namespace detail

/// All stages of a scene, in order: give it readings with feed(), read touch() when a report says that it is new.
/// The stages and the estimator are public members; `settings` are TrackerSettings. A scene is a struct as Handheld.
template <class Scene>
class Tracker : public detail::Parts<Scene>::Settings,
                public detail::Parts<Scene>::Detector,
                public detail::Parts<Scene>::Front,
                detail::Parts<Scene>::Judge,
                Scene::levels,
                Scene::screen,
                detail::Parts<Scene>::Judging {
  using Settings = typename detail::Parts<Scene>::Settings;
  using Judge = typename detail::Parts<Scene>::Judge;
  using Detector = typename detail::Parts<Scene>::Detector;
  using Front = typename detail::Parts<Scene>::Front;
  using Screen = typename Scene::screen;
  using detail::Parts<Scene>::Judging::judgements_;
  using Pair = typename Front::Pair;
  using Levels = typename Scene::levels;

 public:
  using scene_type = Scene;                          ///< with the types of the stages
  using real_type = typename Scene::real_type;       ///< float or double
  using time_type = typename Scene::time_type;       ///< Ticks with their unit
  using estimator_type = typename Scene::estimator;  ///< of the ratio
  using Real = real_type;                            ///< the same
  using Time = time_type;                            ///< the same
  static constexpr bool levels = Judge::levels;      ///< it has a level ratio
  using Detector::gate, Detector::hard_baseline, Detector::soft_baseline;
  using Front::align;
  using Settings::settings;

  estimator_type estimator;  ///< of the ratio of the running touch, or of the last one

  /// Takes a reading of each channel: their times, and the capacitances in pF, NaN: no value. A reading that is infinite
  /// or saturated counts as no value. With `falling`, all that is inside has the other sign: levels and changes.
  ///
  /// With a screen a reading is judged when the next two are known, so what it returns is about the one before those two.
  constexpr Report<Real> feed(Time hard_time, Time soft_time, Real hard, Real soft) noexcept {
    if constexpr (Scene::contact::releases) {
      hard = settings.falling ? -hard : hard;
      soft = settings.falling ? -soft : soft;
    }
    if constexpr (Screen::screens) {
      judgements_.clear();
      if (PALPATE_UNLIKELY(!Screen::add(hard_time, soft_time, hard, soft))) {
        return {estimator.ratio(), false, gate.contact(), false};
      }
      return take_due(false);
    } else {
      return take(Reading{hard_time, soft_time, hard, soft});
    }
  }

  /// No reading follows for now. Takes one of those that still wait, as feed() does; call it while waiting() is above 0.
  /// finish() and tare() do so, too.
  constexpr Report<Real> flush() noexcept {
    if constexpr (Screen::screens) {
      judgements_.clear();
      if (Screen::flush()) {
        return take_due(true);
      }
    }
    return {estimator.ratio(), false, gate.contact(), false};
  }

  /// Times have a unit: numbers alone are an error.
  template <class Hard, class Soft>
  constexpr Report<Real> feed(Hard, Soft, Real, Real) noexcept {
    static_assert(!std::is_same_v<Hard, Hard>,
                  "palpate::Tracker: times have the unit of the scene, as in feed(palpate::Microseconds(t_hard), "
                  "palpate::Microseconds(t_soft), hard, soft)");
    return {};
  }

  /// End a touch that is still running, for example at the end of a recording. False: there is no such touch. Where a touch
  /// begins without a contact, flush() first: of the readings that wait, one may end a touch, and the next one begin another.
  constexpr bool finish() noexcept {
    bool ended = false;
    while (Screen::waiting() > 0) {
      ended = flush().finished || ended;
    }
    return end_touch() || ended;
  }

  /// Measure the baseline again, without contact. Needed after a jump of the baseline upwards, which looks like a touch
  /// without end; a baseline that was measured in contact is noticed by itself.
  constexpr void tare() noexcept {
    finish();
    align.reset();
    Front::decimator.reset();
    Detector::tare();
    Judge::tared();
  }

  /// The last touch; read it before the next one begins.
  constexpr Touch<Real> touch() const noexcept {
    const Real nan = not_a_number<Real>;
    const bool any = counts_.samples > 0;
    Touch<Real> result{counts_};
    result.ratio = result.first_ratio = any ? estimator.ratio() : nan;
    result.covariance = any ? estimator.covariance() : nan;
    result.standard_error = result.first_standard_error = standard_error_;
    result.full = full_;
    Screen::complete(result);
    Judge::complete(result, estimator);
    return result;
  }
  /// What is judged of the last reading that feed() or flush() took, beside the touch.
  constexpr const auto& judgements() const noexcept { return judgements_; }
  using Levels::forget;
  using Screen::due_time, Screen::waiting;
  /// Settings of the level ratio.
  constexpr auto& level_settings() noexcept { return Judge::level_settings(); }
  /// The same, of a constant tracker.
  constexpr const auto& level_settings() const noexcept { return Judge::level_settings(); }
  /// Whether a touch is taking samples.
  constexpr bool open() const noexcept { return open_; }
  /// Index of the first pair of the running touch, or of the last one.
  constexpr std::size_t started() const noexcept { return Front::decimator.first(counts_.start); }
  /// Number of all readings so far.
  constexpr std::size_t readings() const noexcept { return readings_; }
  /// Number of all pairs: of readings, or of means.
  constexpr std::size_t pairs() const noexcept { return Front::decimator.pairs(readings_); }

  /// Covariance of the initial ratio. The default means unknown for a noise of a probe in pF, from 1e-5 on; with less noise,
  /// as of signals in another unit, it follows from the noise.
  constexpr Real initial_covariance() const noexcept {
    const Real most = estimator_type::default_covariance;
    const Real square = product(soft_baseline.noise(), soft_baseline.noise());
    const bool unknown = Judge::judges && settings.initial_covariance == most;
    return unknown && product(square, most) < 1 ? 16 / square : settings.initial_covariance;
  }

  /// Ratio of the running touch, or of the last one; NaN until it has a sample. The estimator has its initial ratio then.
  constexpr Real ratio() const noexcept { return counts_.samples > 0 ? estimator.ratio() : not_a_number<Real>; }
  /// Standard error of the running touch; NaN until the first sample.
  constexpr Real standard_error() const noexcept { return errors().of(estimator); }

 private:
  using Reading = palpate::ScreenedReading<Real, Time>;
  using Ranged = RangedReading<Real>;

  /// Returns whether there is one.
  constexpr bool end_touch() noexcept {
    if (!running_) {
      return false;
    }
    running_ = open_ = false;
    standard_error_ = Judge::ended(estimator, errors());
    return true;
  }

  PALPATE_INLINE constexpr Report<Real> take_due(bool last) noexcept {
    const Reading reading = Screen::take(settings.full_scale, last, judgements_);
    Screen::count(reading, open_);
    return take(reading);
  }

  PALPATE_INLINE constexpr Report<Real> take(const Reading& reading) noexcept {
    const Time hard_time = reading.hard_time, soft_time = reading.soft_time;
    Judge::read(reading.hard, reading.soft, hard_time == soft_time, open_);
    const Ranged read = ranged(reading.hard, reading.soft, reading.at_end);
    const auto frame = Front::take(hard_time, soft_time, read, near(), settings.averaged);
    if (PALPATE_UNLIKELY(frame.size == 0)) {  // of a mean that is not complete
      readings_ += 1;
      return {estimator.ratio(), false, gate.contact(), false};
    }
    const Event event = detect(frame.time, frame.hard, frame.soft, read.whole);
    const bool revised = watch(frame.time, frame.hard, frame.soft, event);
    const Pair pair = Front::pair(frame, hard_time, soft_time, read, open_ || falls());
    bool alarm = false, ended = true;
    if (open_) {
      alarm = sample(pair, frame.time, read.saturated);
      ended = ends(frame.time);
    } else {
      Judge::rested(frame.hard, frame.soft, gate.suspects());
      wait(pair, frame.time);
    }
    readings_ += 1;
    Front::decimator.next();
    const bool finished = ended && end_touch();
    return {estimator.ratio(), alarm, gate.contact(), finished, revised};
  }

  PALPATE_INLINE constexpr Ranged ranged(Real hard, Real soft, bool at_end) const noexcept {
    if (PALPATE_LIKELY(in_range(hard) && in_range(soft) && !at_end)) {
      return {hard, soft, true, false};
    }
    const bool saturated = at_end || too_large(hard) || too_large(soft);
    if (Front::decimator.fast() && !(is_finite(hard) && is_finite(soft))) {
      return {not_a_number<Real>, not_a_number<Real>, false, saturated};  // one value is no mean
    }
    return {hard, soft, false, saturated};
  }

  constexpr bool too_large(Real value) const noexcept { return is_finite(value) && !in_range(value); }
  PALPATE_INLINE constexpr bool in_range(Real value) const noexcept { return magnitude(value) < settings.full_scale; }
  /// Whether a touch is running, or may begin.
  PALPATE_INLINE constexpr bool near() const noexcept {
    return Front::decimates && (!gate.idle() || gate.suspects() || !Detector::ready());
  }
  /// Whether the touch has ended, and the probe is not yet lifted.
  constexpr bool falls() const noexcept { return levels && !open_ && counts_.samples > 0 && !gate.idle(); }

  PALPATE_INLINE constexpr RatioError<estimator_type, typename Scene::baseline, Judge> errors() const noexcept {
    return {hard_baseline, soft_baseline, *this, Front::decimator.size(), counts_.samples, Front::pace()};
  }

  PALPATE_INLINE constexpr Event detect(Time time, Real hard, Real soft, bool whole) noexcept {
    if (PALPATE_LIKELY(whole) || (is_finite(hard) && is_finite(soft))) {
      return Detector::take(time, hard, soft, running_,
                            Judge::codes.coarser(hard_baseline.noise(), soft_baseline.noise()));
    }
    const Real nan = not_a_number<Real>;
    return Detector::take_one(time, too_large(hard) ? nan : hard, too_large(soft) ? nan : soft);
  }

  /// Returns whether the last touch is revised.
  constexpr bool follow(Event event, [[maybe_unused]] Time time) noexcept {
    if (PALPATE_UNLIKELY(event != Event::none)) {
      if (event == Event::begun) {
        start(time);
      } else if (event == Event::measured) {
        return Judge::measured(estimator, errors(), pairs(), standard_error_);
      } else {
        open_ = false;
      }
      if (event == Event::idle) {
        Judge::released(hard_baseline, soft_baseline, started());
      }
    }
    return false;
  }

  constexpr void start(Time time) noexcept {
    running_ = open_ = true;
    full_ = false;
    estimator.reset(settings.initial_ratio, initial_covariance());
    counts_ = Counts();
    Screen::begun();
    const auto age = static_cast<std::size_t>(gate.age());
    const std::size_t size = Front::decimator.size();
    Front::decimator.begin(age);
    counts_.start = readings_ + 1 > age * size ? readings_ + 1 - age * size : 0;
    Judge::begun(time, pairs());
  }

  /// Returns whether the last touch is revised.
  PALPATE_INLINE constexpr bool watch(Time time, Real hard, Real soft, Event event) noexcept {
    bool revised = follow(event, time);
    if constexpr (Levels::watches) {
      if (PALPATE_LIKELY(is_finite(hard - soft) && !hard_baseline.given())) {
        const auto change = Levels::take(time, hard, soft, event == Event::begun, *this, Judge::codes, judgements_);
        revised = (PALPATE_UNLIKELY(change != LevelChange::none) && change_level(change)) || revised;
      }
    }
    return revised;
  }

  constexpr bool change_level(LevelChange change) noexcept {
    const bool ended = !running_;
    if (change == LevelChange::saturated) {
      counts_.saturated += 1;
      return ended;
    }
    open_ = false;
    Judge::moved();
    if (running_ && (change == LevelChange::dropped || change == LevelChange::returned)) {  // the jump back began it
      running_ = false;
      counts_ = Counts();
    } else if (change != LevelChange::moved) {
      const bool jumped = change == LevelChange::jumped || change == LevelChange::dropped;
      return Judge::level_changed(jumped ? misfit_jumped : change == LevelChange::stepped ? misfit_step : 0) && ended;
    }
    return false;
  }

  /// Returns whether there is an alarm.
  PALPATE_INLINE constexpr bool sample(const Pair& pair, Time time, bool saturated) noexcept {
    counts_.saturated += saturated;
    if (pair.valid) {
      return estimate(pair, time);
    }
    counts_.refused += !saturated;
    return false;
  }

  PALPATE_INLINE constexpr void wait(const Pair& pair, Time time) noexcept {
    before_ = time;
    if (falls() && pair.valid) {
      const Real hard = pair.hard - hard_baseline.level(), soft = pair.soft - soft_baseline.level();
      Judge::falling(judged(pair, hard, soft, time));
    }
  }

  PALPATE_INLINE constexpr bool estimate(const Pair& pair, Time time) noexcept {
    const Real hard = pair.hard - hard_baseline.level(), soft = pair.soft - soft_baseline.level();
    const auto before = Judge::before(estimator);
    const auto step = estimator.update(hard, soft);
    if (PALPATE_UNLIKELY(!step.accepted)) {
      counts_.refused += 1;
      return step.alarm;
    }
    counts_.samples += 1;
    counts_.alarms += step.alarm;
    if constexpr (Judge::judges) {
      Judge::sampled(step, before, judged(pair, hard, soft, time), estimator, errors(), settings.confirmed);
    }
    return step.alarm;
  }

  PALPATE_INLINE constexpr JudgedSample<Real, Time> judged(const Pair& pair, Real hard, Real soft,
                                                           Time time) const noexcept {
    if constexpr (Judge::judges) {
      return {hard, soft, pair.matched, time, pairs()};
    } else {
      return {hard, soft, false, time, pairs()};
    }
  }

  // Where an age is wanted, a touch that reaches its length before it is not full.
  constexpr bool ends(Time time) noexcept {
    const bool length = (settings.samples > 0 && counts_.samples >= settings.samples) ||
                        (settings.seconds > 0 && !(time.template seconds_since<Real>(before_) < settings.seconds));
    full_ = length;
    if constexpr (levels) {
      if (PALPATE_UNLIKELY(level_settings().age > 0)) {
        full_ = Judge::aged(time);
      }
    }
    if constexpr (!Scene::contact::releases) {
      before_ = length ? time : before_;  // the next touch begins at once
    }
    return length || full_;
  }

  std::size_t readings_ = 0;
  Time before_;           // of the reading before the contact was found
  bool open_ = false;     // the touch takes samples
  bool running_ = false;  // a touch has begun, and its result is not yet reported
  bool full_ = false;     // the touch has the wanted length
  Counts counts_;
  Real standard_error_ = not_a_number<Real>;
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
