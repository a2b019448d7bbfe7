// SPDX-License-Identifier: MIT
#pragma once

// Tracker: all stages from two readings to the result of a touch. The scenes, which stages each one has: scenes.hpp.

#include <palpate/estimator/handover.hpp>
#include <palpate/stage/evidence.hpp>
#include <palpate/stage/idle.hpp>
#include <palpate/stage/matched_pair.hpp>
#include <palpate/stage/means.hpp>

namespace palpate {

/// What was counted in a touch.
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
  bool full = false;                               ///< it has the wanted length
  Revision revision = Revision::none;              ///< what the baseline after the touch says
  Real shift = 0;          ///< of the ratio, by the revision, share; where it is not corrected, what it would have been
  Fitted<Real> fitted{};   ///< what contradicts the model, and its flags
  Levelled<Real> level{};  ///< the ratio over the swept depth, which a tilt does not change
  // With the flag misfit_changed one of them is known:
  Levelled<Real> before{};  ///< the ratio before a change that was confirmed: `ratio` is the one after it
  Levelled<Real> after{};   ///< the ratio after a change that was not, from few samples: `ratio` is the one before it
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

namespace detail {
template <class Stage, class Ticks = typename Stage::ticks_type>
using Aligns = decltype(of<Stage>().reset(), float(of<Stage>().feed(Ticks(), Ticks(), 0, 0, true).hard),
                        float(of<Stage>().feed(Ticks(), Ticks(), 0, 0, true).soft),
                        bool(of<Stage>().feed(Ticks(), Ticks(), 0, 0, true).valid));
template <class Stage, class Ticks = typename Stage::ticks_type>
using Matches = decltype(bool(of<Stage>().feed(Ticks(), Ticks(), 0, 0, true).matched));
template <class Stage>
using Levels =
    decltype(of<Stage>().collect(0), of<Stage>().follow(0), of<Stage>().mark(), of<Stage>().rewind(),
             of<Stage>().reset(), of<Stage>().keep(), bool(of<Stage>().ready()), bool(of<Stage>().disturbed()),
             of<Stage>().level(), of<Stage>().expected(), of<Stage>().noise(), of<Stage>().variance());
template <class Stage>
using Touches = decltype(Stage::releases, Stage::recovers, of<Stage>().update(0, 0, 0), of<Stage>().reset(),
                         bool(of<Stage>().contact()), bool(of<Stage>().idle()), of<Stage>().age(),
                         bool(of<Stage>().suspects()), of<Stage>().update_between(0, 0), bool(of<Stage>().fell()));
template <class Estimator, class Real = typename Estimator::real_type>
using Estimates =
    decltype(Real(Estimator::default_covariance), of<Estimator>().reset(Real(), Real()),
             bool(of<Estimator>().update(Real(), Real()).accepted), bool(of<Estimator>().update(Real(), Real()).alarm),
             Real(of<Estimator>().ratio()), Real(of<Estimator>().covariance()));
template <class Estimator, class Real = typename Estimator::real_type>
using Scatters = decltype(Real(of<Estimator>().long_run_variance()), Real(of<Estimator>().leverage()),
                          Real(of<Estimator>().innovation_variance()), Real(of<Estimator>().count()),
                          Real(of<Estimator>().information()), bool(of<Estimator>().settled()));
template <class Estimator>
using GoesBack = decltype(of<Estimator>().restore(typename Estimator::Estimate(of<const Estimator>().estimate())),
                          of<const Estimator>().mean_regressor());
}  // namespace detail

/// Whether an estimator has a standard error: the members of Handover of which one is made.
template <class Estimator>
inline constexpr bool knows_its_error = detail::has<detail::Scatters, const Estimator>;

/// Settings of a Tracker.
template <class Estimator>
struct TrackerSettings {
  using Real = typename Estimator::real_type;  ///< float or double
  Real seconds = Real(0);                      ///< length of a touch; 0: no limit, a touch ends by its release
  std::uint32_t samples = 250;                 ///< length of a touch; 0: no limit
  Real confirmed = Real(0);                    ///< with a fit: seconds that a hand-over needs to be the result; 0: none
  Real initial_ratio = Real(1);                ///< of the estimator at the begin of a touch
  Real initial_covariance = Estimator::default_covariance;  ///< the same, 1/pF^2
  Real full_scale = std::numeric_limits<Real>::infinity();  ///< readings from this size on are saturated
  Real averaged =
      Real(0.025);  ///< with a matched pair: readings of a fast converter become means over these seconds; 0: none

  /// As FixedForgetting::visit_fields.
  static constexpr auto visit_fields = [](auto& s, auto&& visit) noexcept {
    visit("initial_ratio", s.initial_ratio, is_finite(s.initial_ratio), "a finite number");
    visit("initial_covariance", s.initial_covariance, s.initial_covariance > 0, "0 < initial_covariance");
    visit("seconds", s.seconds, s.seconds >= 0, "0 <= seconds");
    visit("samples", s.samples, true, "0 <= samples");
    visit("full_scale", s.full_scale, s.full_scale > 0, "0 < full_scale, pF");
    visit("confirmed", s.confirmed, s.confirmed >= 0, "0 <= confirmed");
    visit("averaged", s.averaged, 0 <= s.averaged && s.averaged <= 1, "0 <= averaged <= 1");
  };
};

/// All stages of a scene, in order: give it readings with feed(), read touch() when a report says that it is new.
/// The stages and the estimator are public members; `settings` are TrackerSettings. scenes.hpp has the usual ones.
template <class Real, class AlignStage, class BaselineStage, class ContactStage, class Estimator,
          class FitStage = NoFit<Real>, class Settings = Kept<TrackerSettings<Estimator>>,
          class LevelStage = NoLevelRatio<Real>>
class Tracker : public Settings,
                public Idle<Real, typename AlignStage::ticks_type, BaselineStage, ContactStage>,
                Fitting<Real, typename AlignStage::ticks_type, Estimator, FitStage, LevelStage> {
  using Channels = Idle<Real, typename AlignStage::ticks_type, BaselineStage, ContactStage>;
  using Extra = Fitting<Real, typename AlignStage::ticks_type, Estimator, FitStage, LevelStage>;
  static constexpr bool fits = FitStage::fits;
  static constexpr bool averages = detail::has<detail::Matches, AlignStage>;
  using Pair = decltype(detail::of<AlignStage>().feed({}, {}, 0, 0, true));
  static_assert(detail::has<detail::Aligns, AlignStage>,
                "palpate::Tracker: an AlignStage needs the members of NoAlign");
  static_assert(detail::has<detail::Levels, BaselineStage>,
                "palpate::Tracker: a BaselineStage needs the functions of NoBaseline");
  static_assert(detail::has<detail::Touches, ContactStage>,
                "palpate::Tracker: a ContactStage needs the members of AlwaysContact");
  static_assert(detail::has<detail::Estimates, Estimator>,
                "palpate::Tracker: an Estimator needs real_type, default_covariance, update(output, regressor), which "
                "returns a Step, reset(ratio, covariance), ratio() and covariance()");
  static_assert(
      !fits || averages,
      "palpate::Tracker: a Fit needs an AlignStage whose pairs have `matched`, as MatchedPair; else use NoFit");
  static_assert(!fits || (knows_its_error<Estimator> && detail::has<detail::GoesBack, Estimator>),
                "palpate::Tracker: a Fit needs an Estimator with the standard error of Handover, mean_regressor(), "
                "Estimate, estimate() and restore(estimate); else use NoFit");
  static_assert(fits || !LevelStage::levels, "palpate::Tracker: a LevelRatio needs a Fit; else use NoLevelRatio");

 public:
  using real_type = Real;                             ///< float or double
  static constexpr bool levels = LevelStage::levels;  ///< it has a level ratio
  using Channels::gate, Channels::hard_baseline, Channels::soft_baseline;
  using Settings::settings;
  using ticks_type = typename AlignStage::ticks_type;  ///< of the times: an integer of 32 or 64 bits

  AlignStage align;     ///< brings both channels to the same times
  Estimator estimator;  ///< of the ratio of the running touch, or of the last one

  /// Takes a reading of each channel: their times, which may wrap, in nanoseconds for 64-bit ticks, otherwise in
  /// microseconds; the capacitances in pF, NaN: no value. A reading that is infinite or saturated counts as no value.
  constexpr Report<Real> feed(ticks_type hard_time, ticks_type soft_time, Real hard, Real soft) noexcept {
    const Real nan = not_a_number<Real>;
    bool high = false, large = false, both = true, quick = false;
    if constexpr (fits) {
      Extra::hard_step.add(hard, open_);
      Extra::soft_step.add(soft, open_);
      Extra::together = hard_time == soft_time;
    }
    if (PALPATE_UNLIKELY(!(in_range(hard) && in_range(soft)))) {  // one is missing, infinite or saturated
      high = too_large(hard), large = too_large(soft), both = is_finite(hard) && is_finite(soft);
      if (!both && means_.fast()) {
        hard = soft = nan;  // one reading is no mean
      }
    } else if constexpr (averages) {
      quick = means_.follow(hard_time, averaged());
    }
    const bool saturated = high || large;
    Real read_hard = hard, read_soft = soft;
    if (PALPATE_UNLIKELY(saturated)) {
      read_hard = read_soft = nan;
    }
    const bool near = !gate.idle() || gate.suspects() || !Channels::ready();  // to a touch
    Pair pair = averages ? align.feed(hard_time, soft_time, read_hard, read_soft, near) : Pair{};
    if constexpr (averages) {
      if (PALPATE_UNLIKELY(quick)) {
        const auto mean = means_.add(hard_time, hard, soft, pair, averaged());
        if (mean.size == 0) {
          readings_ += 1;
          return {estimator.ratio(), false, gate.contact(), false};
        }
        hard_time = mean.time, hard = mean.hard, soft = mean.soft;
        pair = mean.pair;
      }
    }
    const bool revised = follow(both ? Channels::take(hard_time, hard, soft, running_, one_code())
                                     : Channels::take_one(high ? nan : hard, large ? nan : soft),
                                hard_time);
    if (PALPATE_UNLIKELY(saturated)) {
      counts_.saturated += open_;
    }
    if constexpr (!averages) {
      pair = align.feed(hard_time, soft_time, read_hard, read_soft, open_ || falls());
    }
    bool alarm = false, ended = true;
    if (open_) {
      if (pair.valid) {
        alarm = estimate(pair, hard_time);
      } else {
        counts_.refused += !saturated;
      }
      ended = ends(hard_time);
    } else {
      before_ = hard_time;
      if (falls()) {
        add_level(pair, hard_time, false);
      }
    }
    readings_ += 1;
    means_.next();
    const bool finished = ended && finish();
    return {estimator.ratio(), alarm, gate.contact(), finished, revised};
  }

  /// Times are integers: what is not is an error.
  template <class Hard, class Soft, class = std::enable_if_t<std::is_floating_point_v<std::common_type_t<Hard, Soft>>>>
  constexpr Report<Real> feed(Hard, Soft, Real, Real) noexcept {
    static_assert(!std::is_same_v<Hard, Hard>,
                  "palpate::Tracker: times are integers, of nanoseconds in 64 bits or of microseconds in 32 bits");
    return {};
  }

  /// End a touch that is still running, for example at the end of a recording. False: there is no such touch.
  constexpr bool finish() noexcept {
    if (!running_) {
      return false;
    }
    running_ = open_ = false;
    if constexpr (fits) {
      Extra::lifted = Extra::unconfirmed.holds(estimator);
      bool changed = false;
      if (Extra::lifted) {
        const Real before = Extra::unconfirmed.estimator.ratio();
        changed = magnitude(estimator.ratio() / before - 1) > least_change;
        Extra::after = changed ? Levelled<Real>{estimator.ratio(), standard_error()} : Levelled<Real>();
        Extra::earlier = {};
        estimator = Extra::unconfirmed.estimator;
        Extra::evidence = Extra::unconfirmed.evidence;
      } else {
        if (Extra::unconfirmed.waits()) {
          note_change();
        }
        changed = differs_from(Extra::earlier);
      }
      const Real hard = hard_baseline.noise(), soft = soft_baseline.noise(), code = one_code();
      Extra::fitted =
          Extra::evidence.fit.result(hard > code ? hard : code, soft > code ? soft : code, estimator.ratio());
      if (!changed && Extra::fitted.flags == 0) {  // a ratio that comes and goes: its mean is another one
        Extra::earlier = Extra::evidence.fit.mean();
        changed = differs_from(Extra::earlier);
      }
      if (changed) {
        Extra::fitted.flags |= misfit_changed;
      } else {
        Extra::earlier = {};
      }
      Extra::first_error = error_of(shared_variance(), Extra::fitted.open + Extra::fitted.open_drift);
      standard_error_ = Extra::first_error;
      find_level(false);
    } else {
      standard_error_ = standard_error();
    }
    return true;
  }

  /// Measure the baseline again, without contact. Needed after a jump of the baseline upwards, which looks like a touch
  /// without end; a baseline that was measured in contact is noticed by itself.
  constexpr void tare() noexcept {
    finish();
    align.reset();
    Channels::tare();
    if constexpr (fits) {
      Extra::evidence.times.drop();
    }
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
    if constexpr (fits) {
      result.fitted = Extra::fitted;
      result.first_standard_error = Extra::first_error;
      result.revision = Extra::revision.kind;
      result.shift = Extra::revision.shift / estimator.ratio();
      if (Extra::revision.significant && magnitude(result.shift) > FitStage::least) {
        result.fitted.flags |= misfit_drift;
      }
      if (result.revision == Revision::drift) {
        result.ratio += Extra::revision.shift;
        if (result.fitted.flags == misfit_offset) {
          result.fitted.offset_ratio += Extra::revision.shift;
        }
      }
      result.before = Extra::earlier;
      result.after = Extra::after;
      result.level = Extra::levelled;
      // Where something else contradicts the model, that is the cause; an offset has a flag of its own.
      const bool otherwise = result.fitted.flags & (misfit_offset | misfit_drift | misfit_lag | misfit_curve);
      if (Extra::tilted && !otherwise) {
        result.fitted.flags |= misfit_tilt;
      }
    }
    return result;
  }
  /// Settings of the level ratio.
  constexpr auto& level_settings() noexcept { return Extra::evidence.level.settings; }
  /// The same, of a constant tracker.
  constexpr const auto& level_settings() const noexcept { return Extra::evidence.level.settings; }
  /// Whether a touch is taking samples.
  constexpr bool open() const noexcept { return open_; }
  /// Index of the first pair of the running touch, or of the last one.
  constexpr std::size_t started() const noexcept { return means_.first(counts_.start); }
  /// Number of all readings so far.
  constexpr std::size_t readings() const noexcept { return readings_; }
  /// Number of all pairs: of readings, or of means.
  constexpr std::size_t pairs() const noexcept { return means_.pairs(readings_); }

  /// Covariance of the initial ratio. The default means unknown for a noise of a probe in pF, from 1e-5 on; with less noise,
  /// as of signals in another unit, it follows from the noise.
  constexpr Real initial_covariance() const noexcept {
    const Real most = Estimator::default_covariance, square = product(soft_baseline.noise(), soft_baseline.noise());
    const bool unknown = fits && settings.initial_covariance == most;
    return unknown && product(square, most) < 1 ? 16 / square : settings.initial_covariance;
  }

  /// Standard error of the running touch, from the noise of the readings and of the estimator, and from the errors of
  /// the baselines, which are common to all samples of a touch; NaN until the first sample.
  constexpr Real standard_error() const noexcept {
    if constexpr (!knows_its_error<Estimator>) {
      return not_a_number<Real>;
    } else {
      return error_of(shared_variance(), Real(0));
    }
  }

 private:
  // The long-run variance of a sample is at least that of the noise of the readings, since the alignment does not
  // change a mean. While the innovations are too few to show how they are correlated, that plus 4 times what their
  // variance has above half of it. An error of a baseline changes the ratio by this error divided by the mean
  // regressor, sqrt(R / W), W being the count.
  constexpr Real error_of(Real shared, Real open) const noexcept {
    if (counts_.samples == 0) {
      return not_a_number<Real>;
    }
    const Real readings = of_ratio(product(hard_baseline.noise(), hard_baseline.noise()),
                                   product(soft_baseline.noise(), soft_baseline.noise())) +
                          rounding();
    const Real seen = estimator.settled()
                          ? estimator.long_run_variance()
                          : readings + 4 * positive_part(estimator.innovation_variance() - readings / 2);
    const Real own = product(seen > readings ? seen : readings, estimator.leverage());
    const Real square = own + product(shared, estimator.count()) / estimator.information() + open;
    return square > 0 && is_finite(square) ? square_root(square) : not_a_number<Real>;
  }

  static constexpr Real least_change = Real(0.005);  // share; smaller ones have no flag: gauges are bent, by .5 %/pF

  /// Whether the ratio is another one, by more than 4 errors of both.
  constexpr bool differs_from(const Levelled<Real>& other) const noexcept {
    if (!(other.standard_error >= 0)) {
      return false;
    }
    const Real apart = estimator.ratio() - other.ratio, own = standard_error();
    const Real square = product(own, own) + product(other.standard_error, other.standard_error);
    return product(apart, apart) > 16 * square && magnitude(apart / other.ratio) > least_change;
  }

  constexpr ticks_type averaged() const noexcept {
    return static_cast<ticks_type>(product(settings.averaged, Real(ticks_per_second<ticks_type>)));
  }
  constexpr bool in_range(Real value) const noexcept { return magnitude(value) < settings.full_scale; }
  constexpr bool too_large(Real value) const noexcept { return is_finite(value) && !in_range(value); }

  /// Variance of hard - ratio * soft.
  constexpr Real of_ratio(Real hard, Real soft) const noexcept {
    const Real ratio = estimator.ratio();
    return hard + product(product(ratio, ratio), soft);
  }
  constexpr Real shared_variance() const noexcept {
    return of_ratio(hard_baseline.variance(), soft_baseline.variance()) + rounding();
  }
  /// By codes that are coarser than the noise: step^2 / 12 of the readings, and the same of the baseline.
  constexpr Real rounding() const noexcept {
    if constexpr (fits) {
      const Real size = means_.size() > 1 ? square_root(static_cast<Real>(means_.size())) : Real(1);
      const Real hard = Extra::hard_step.coarse(product(size, hard_baseline.noise()));
      const Real soft = Extra::soft_step.coarse(product(size, soft_baseline.noise()));
      return of_ratio(product(hard, hard), product(soft, soft)) / 6;
    } else {
      return Real(0);
    }
  }
  /// A change by one code is no contact.
  constexpr auto one_code() const noexcept {
    if constexpr (fits) {
      const Real hard = Extra::hard_step.coarse(hard_baseline.noise());
      const Real soft = Extra::soft_step.coarse(soft_baseline.noise());
      return hard > soft ? hard : soft;
    } else {
      return 0;
    }
  }

  /// Returns whether the last touch is revised.
  constexpr bool follow(Event event, [[maybe_unused]] ticks_type time) noexcept {
    if (PALPATE_UNLIKELY(event != Event::none)) {
      if (event == Event::begun) {
        start(time);
      } else if (event == Event::measured) {
        return revise();
      } else {
        open_ = false;
      }
      if constexpr (fits) {
        if (event == Event::idle) {
          Extra::evidence.times.keep(hard_baseline, soft_baseline, started());
        }
      }
    }
    return false;
  }

  constexpr bool revise() noexcept {
    if constexpr (fits) {
      if (Extra::evidence.times.waits() && estimator.mean_regressor() != 0) {
        const Real size = square_root(estimator.information() / estimator.count());
        const Real mean = estimator.mean_regressor() > 0 ? size : -size;
        Extra::revision = Extra::evidence.times.result(hard_baseline, soft_baseline, pairs(), estimator.ratio(), mean);
        const bool moved = Extra::revision.significant;  // then it explains a drift
        const Real open = Extra::fitted.open + Extra::revision.open + (moved ? Real(0) : Extra::fitted.open_drift);
        standard_error_ = error_of(Extra::revision.variance + rounding(), open);
        find_level(true);
        return true;
      }
    }
    return false;
  }

  constexpr void start(ticks_type time) noexcept {
    running_ = open_ = true;
    full_ = false;
    estimator.reset(settings.initial_ratio, initial_covariance());
    counts_ = Counts();
    const auto age = static_cast<std::size_t>(gate.age());
    const std::size_t size = means_.size();
    means_.begin(age);
    counts_.start = readings_ + 1 > age * size ? readings_ + 1 - age * size : 0;
    if constexpr (fits) {
      Extra::evidence.fit.reset();
      Extra::unconfirmed.reset();
      Extra::earlier = Extra::after = Extra::levelled = {};
      Extra::tilted = Extra::lifted = Extra::drifts = false;
      Extra::begin = time;
      Extra::evidence.level.reset();
      Extra::evidence.times.begin(pairs());
      Extra::fitted = {};
      Extra::revision = {};
    }
  }

  template <class Aligned>
  PALPATE_ONCE constexpr bool estimate(const Aligned& pair, [[maybe_unused]] ticks_type time) noexcept {
    const Real hard = pair.hard - hard_baseline.level(), soft = pair.soft - soft_baseline.level();
    [[maybe_unused]] const auto before = Extra::estimate_of(estimator);
    const auto step = estimator.update(hard, soft);
    if (PALPATE_UNLIKELY(!step.accepted)) {
      counts_.refused += 1;
      return step.alarm;
    }
    counts_.samples += 1;
    if (PALPATE_UNLIKELY(step.alarm)) {
      counts_.alarms += 1;
      if constexpr (fits) {
        keep(before, time, true);
        Extra::evidence.level.restart();
        Extra::evidence.fit.restart(step.ratio / before.ratio - 1);
      }
    }
    if constexpr (fits) {
      if (PALPATE_UNLIKELY(step.drifts && !(Extra::drifts && Extra::unconfirmed.waits()))) {
        keep(before, time, false);
      }
      Extra::drifts = step.drifts;
      if (PALPATE_UNLIKELY(Extra::unconfirmed.follow(time, soft, settings.confirmed))) {
        note_change();
      }
      const bool counts = step.gain != 0;  // in the sums
      Extra::evidence.times.follow(pairs(), estimator.count(), step.alarm, counts);
      if (pair.matched && counts && !step.outlier) {
        Extra::evidence.fit.add(hard, soft, static_cast<std::uint32_t>(pairs()));
        add_level(pair, time, true);
      }
    }
    return step.alarm;
  }

  /// A change is confirmed: the ratio before it. Of several, the one that is farthest from the ratio now counts; that of
  /// a few samples is none.
  PALPATE_COLD constexpr void note_change() noexcept {
    if (!Extra::unconfirmed.estimator.settled()) {
      return;
    }
    const Estimator now = estimator;
    estimator = Extra::unconfirmed.estimator;
    const Levelled<Real> before{estimator.ratio(), standard_error()};
    estimator = now;
    const Real apart = magnitude(before.ratio - now.ratio());
    if (!(Extra::earlier.standard_error > 0) || apart > magnitude(Extra::earlier.ratio - now.ratio())) {
      Extra::earlier = before;
    }
  }

  /// At a hand-over, and where a drift begins: the estimate before it.
  template <class Estimate>
  PALPATE_COLD constexpr void keep(const Estimate& before, ticks_type time, bool alarm) noexcept {
    if (settings.confirmed > 0) {
      Extra::unconfirmed.keep(time, estimator, before, Extra::evidence, alarm);
    }
  }

  /// Whether the touch has ended, and the probe is not yet lifted: the fall belongs to the level ratio.
  constexpr bool falls() const noexcept { return levels && !open_ && counts_.samples > 0 && !gate.idle(); }

  template <class Aligned>
  PALPATE_ONCE constexpr void add_level([[maybe_unused]] const Aligned& pair, [[maybe_unused]] ticks_type time,
                                        [[maybe_unused]] bool held) noexcept {
    if constexpr (levels) {
      if (pair.valid && pair.matched) {
        Extra::evidence.level.add(pair.hard - hard_baseline.level(), pair.soft - soft_baseline.level(),
                                  seconds_between<Real>(time, Extra::begin), held);
      }
    }
  }

  // After a change that was not confirmed the fall has another ratio; codes that are too coarse show no line.
  constexpr void find_level([[maybe_unused]] bool revised) noexcept {
    if constexpr (levels) {
      const Real gain = Extra::together || means_.size() > 1 ? Real(1) : noise_gain<Real>;
      const Real noise = product(gain, product(soft_baseline.noise(), soft_baseline.noise()));
      Extra::levelled = Extra::evidence.level.result(estimator.ratio(), noise, revised && !Extra::lifted);
      if (rounding() > 0) {
        Extra::levelled = {};
      }
      const Real ratio = Extra::levelled.ratio;
      Extra::tilted = differs_from(Extra::levelled);
      Extra::fitted.tilt = ratio > 0 ? (estimator.ratio() - ratio) / ratio : Real(0);
    }
  }

  // Where an age is wanted, a touch that reaches its length before it is not full.
  constexpr bool ends(ticks_type time) noexcept {
    const bool length = (settings.samples > 0 && counts_.samples >= settings.samples) ||
                        (settings.seconds > 0 && !(seconds_between<Real>(time, before_) < settings.seconds));
    full_ = length;
    if constexpr (levels) {
      if (PALPATE_UNLIKELY(level_settings().age > 0)) {
        full_ = Extra::evidence.level.aged(seconds_between<Real>(time, Extra::begin));
      }
    }
    return length || full_;
  }

  std::conditional_t<averages, Means<Real, ticks_type, Pair>, NoMeans> means_;
  std::size_t readings_ = 0;
  ticks_type before_ = 0;  // time of the reading before the contact was found
  bool open_ = false;      // the touch takes samples
  bool running_ = false;   // a touch has begun, and its result is not yet reported
  bool full_ = false;      // the touch has the wanted length
  Counts counts_;
  Real standard_error_ = not_a_number<Real>;
};

}  // namespace palpate
