// SPDX-License-Identifier: MIT
#pragma once

// What the samples of a touch say beside its ratio: misfits, the level ratio, a change that is not confirmed, a revision.

#include <palpate/judge/level_ratio.hpp>
#include <palpate/judge/pending_change.hpp>
#include <palpate/judge/ratio_error.hpp>
#include <palpate/judge/slow_noise.hpp>
#include <palpate/judge/touch.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

namespace detail {
// The estimate before a sample. An estimator without snapshots does not go back to it.
template <class Estimator, class = void>
struct Before {
  struct Snapshot {
    typename Estimator::real_type ratio;
  };
  static constexpr bool goes_back = false;
};
template <class Estimator>
struct Before<Estimator, std::void_t<typename Estimator::Snapshot>> {
  using Snapshot = typename Estimator::Snapshot;
  static constexpr bool goes_back = true;
};
}  // namespace detail

/// A sample of a touch as a judge sees it: the changes of both channels.
template <class Real, class Time>
struct JudgedSample {
  Real hard;           ///< pF
  Real soft;           ///< pF
  bool matched;        ///< both channels with the same response
  Time time;           ///< of the reading
  std::size_t number;  ///< of the pair
};

/// The null judge: a ratio and its standard error.
template <class Estimator>
struct NoJudge {
  using Real = typename Estimator::real_type;  ///< float or double
  static constexpr bool judges = false;        ///< there are no flags and no revision
  static constexpr bool levels = false;        ///< there is no level ratio
  static constexpr NoCodeSteps codes{};        ///< of both channels
  /// @{
  /// As the function of Judge of this name.
  static constexpr void read(Real, Real, bool, bool) noexcept {}
  template <class Time>
  static constexpr void begun(Time, std::size_t) noexcept {}
  static constexpr int before(const Estimator&) noexcept { return 0; }
  template <class Step, class Sample, class Errors>
  static constexpr void sampled(const Step&, int, const Sample&, const Estimator&, const Errors&, Real) noexcept {}
  template <class Sample>
  static constexpr void falling(const Sample&) noexcept {}
  template <class Errors>
  static constexpr Real ended(const Estimator& estimator, const Errors& errors) noexcept {
    return errors.of(estimator);
  }
  template <class Baseline>
  static constexpr void released(const Baseline&, const Baseline&, std::size_t) noexcept {}
  template <class Errors>
  static constexpr bool measured(const Estimator&, const Errors&, std::size_t, Real&) noexcept {
    return false;
  }
  static constexpr void tared() noexcept {}
  static constexpr void rested(Real, Real, bool) noexcept {}
  static constexpr void moved() noexcept {}
  static constexpr bool level_changed(std::uint8_t) noexcept { return false; }
  static constexpr void complete(Touch<Real>&, const Estimator&) noexcept {}
  /// @}
};

/// Judges each touch: whether its samples contradict hard = ratio * soft, and by how much; the ratio over the swept depth;
/// whether a change of the ratio is one of the object or of the lift; and what the baseline after the touch corrects.
template <class Estimator, class Time, class Level = LevelRatio<typename Estimator::real_type>>
class Judge {
  using Before = detail::Before<Estimator>;
  using Snapshot = typename Before::Snapshot;

 public:
  using Real = typename Estimator::real_type;    ///< float or double
  static constexpr bool judges = true;           ///< there are flags, and a revision
  static constexpr bool levels = Level::levels;  ///< there is a level ratio
  CodeSteps<Real> codes;                         ///< of both channels
  SlowNoises<Real> slow;                         ///< of both channels

  /// Each reading, also without contact; `held`: a touch takes samples.
  PALPATE_INLINE constexpr void read(Real hard, Real soft, bool at_once, bool held) noexcept {
    codes.add(hard, soft, held);
    at_once_ = at_once;
  }

  /// Values without a touch; `suspected`: one may have begun.
  PALPATE_INLINE constexpr void rested(Real hard, Real soft, bool suspected) noexcept {
    if (rests_ && is_finite(hard + soft)) {
      slow.hard.add(hard, suspected);
      slow.soft.add(soft, suspected);
    }
  }

  /// The levels are new ones, without contact.
  constexpr void moved() noexcept {
    slow.hard.interrupt();
    slow.soft.interrupt();
    rests_ = true;
  }

  /// A touch begins, with this pair.
  constexpr void begun(Time time, std::size_t pair) noexcept {
    moved();
    rests_ = false;
    evidence_.test.reset();
    changes_.reset();
    earlier_ = after_ = level_ = {};
    tilted_ = lifted_ = drifts_ = false;
    begin_ = time;
    evidence_.level.reset();
    evidence_.reviser.begin(pair);
    misfits_ = {};
    revision_ = {};
    level_flags_ = 0;
  }

  /// The estimate before a sample, which an alarm with it makes the last one before a change.
  static constexpr Snapshot before(const Estimator& estimator) noexcept {
    if constexpr (Before::goes_back) {
      return estimator.snapshot();
    } else {
      return {estimator.ratio()};
    }
  }

  /// The estimator has taken a sample. `confirmed`: seconds that a change needs; 0: it is at once the result.
  template <class Step, class Errors>
  PALPATE_INLINE constexpr void sampled(const Step& step, const Snapshot& before,
                                        const JudgedSample<Real, Time>& sample, const Estimator& estimator,
                                        const Errors& errors, Real confirmed) noexcept {
    if (PALPATE_UNLIKELY((errors.samples & (errors.samples - 1)) == 0)) {  // at each doubling
      slow.find(errors);
    }
    if (PALPATE_UNLIKELY(step.alarm)) {
      keep(before, sample.time, estimator, confirmed, true);
      evidence_.level.restart();
      evidence_.test.restart(step.ratio / before.ratio - 1);
    }
    if constexpr (Before::goes_back) {
      if (PALPATE_UNLIKELY(step.drifts && !(drifts_ && changes_.waits()))) {
        keep(before, sample.time, estimator, confirmed, false);
      }
      drifts_ = step.drifts;
      if (PALPATE_UNLIKELY(changes_.follow(sample.time, sample.soft, confirmed))) {
        note_change(estimator, errors);
      }
    } else {
      changes_.follow(step.alarm || step.drifts, estimator, evidence_);
    }
    const bool counts = step.gain != 0;  // in the sums
    evidence_.reviser.follow(sample.number, estimator.count(), step.alarm, counts);
    if (sample.matched && counts && !step.outlier) {
      evidence_.test.add(sample.hard, sample.soft, static_cast<std::uint32_t>(sample.number));
      add_level(sample, true);
    }
  }

  /// A pair after the end of the touch, before the probe is lifted: the fall belongs to the level ratio.
  PALPATE_INLINE constexpr void falling(const JudgedSample<Real, Time>& sample) noexcept {
    if (sample.matched) {
      add_level(sample, false);
    }
  }

  /// Whether the touch has the age that is wanted.
  constexpr bool aged(Time time) const noexcept {
    return evidence_.level.aged(time.template seconds_since<Real>(begin_));
  }

  /// The touch has ended. After a change that is not confirmed the estimator goes back to before it. Returns the standard
  /// error.
  template <class Errors>
  constexpr Real ended(Estimator& estimator, const Errors& errors) noexcept {
    slow.find(errors);
    lifted_ = changes_.holds(estimator);
    bool changed = lifted_ ? go_back(estimator, errors) : has_changed(estimator, errors);
    const Real code = codes.coarser(errors.hard.noise(), errors.soft.noise());
    misfits_ =
        evidence_.test.result(larger(errors.hard.noise(), code), larger(errors.soft.noise(), code), estimator.ratio());
    if (!changed && misfits_.flags == 0) {  // a ratio that comes and goes: its mean is another one
      earlier_ = evidence_.test.mean();
      changed = differs(estimator, errors, earlier_);
    }
    if (changed) {
      misfits_.flags |= misfit_changed;
    } else {
      earlier_ = {};
    }
    first_error_ = errors.with(estimator, errors.shared(estimator), misfits_.open + misfits_.open_drift);
    find_level(estimator, errors, false);
    return first_error_;
  }

  /// The release is over: the baselines from before the touch, with the number of its first pair.
  template <class Baseline>
  constexpr void released(const Baseline& hard, const Baseline& soft, std::size_t first) noexcept {
    evidence_.reviser.keep(hard, soft, slow.hard.variance, slow.soft.variance, first);
  }

  /// The baselines after the touch are measured. Returns whether they revise it; then with another standard error.
  template <class Errors>
  constexpr bool measured(const Estimator& estimator, const Errors& errors, std::size_t pair, Real& error) noexcept {
    rests_ = true;
    if (!evidence_.reviser.waits()) {  // the first ones, or again: what was before them was perhaps no idle value
      slow = {};
      return false;
    }
    if (estimator.mean_regressor() == 0) {
      return false;
    }
    const Real size = square_root(estimator.mean_square());
    const Real mean = estimator.mean_regressor() > 0 ? size : -size;
    const TouchEvidence<Real> evidence{misfits_.drift, misfits_.drift_error, evidence_.test.length(), level_};
    revision_ = evidence_.reviser.result(errors.hard, errors.soft, pair, estimator.ratio(), mean, evidence);
    rests_ = revision_.kind != Revision::creep;                                // a recovery is no noise
    const Real drift = revision_.significant ? Real(0) : misfits_.open_drift;  // else the baselines explain it
    const Real open = misfits_.open + revision_.open + drift;
    error = errors.with(estimator, revision_.variance + errors.rounding(estimator), open);
    find_level(estimator, errors, true);
    return true;
  }

  /// The baselines are measured again: the last touch will not be revised.
  constexpr void tared() noexcept { evidence_.reviser.drop(); }

  /// Sets the flags of a touch in which a channel jumped; they replace other flags. 0: none. Returns whether this is a change.
  constexpr bool level_changed(std::uint8_t flags) noexcept {
    const bool changed = flags != level_flags_;
    level_flags_ = flags;
    return changed;
  }

  /// Add to a touch what is known beside its ratio.
  constexpr void complete(Touch<Real>& touch, const Estimator& estimator) const noexcept {
    touch.misfits = misfits_;
    touch.first_standard_error = first_error_;
    touch.revision = revision_.kind;
    touch.shift = revision_.shift / estimator.ratio();
    touch.before = earlier_;
    touch.after = after_;
    touch.level = level_;
    if constexpr (levels) {
      touch.depth = evidence_.level.depth();
      touch.rise = evidence_.level.rise_time();
    }
    if (revision_.significant && magnitude(touch.shift) > ModelTest<Real>::least) {
      touch.misfits.flags |= misfit_drift;
    }
    if (revision_.kind == Revision::drift) {
      touch.ratio += revision_.shift;
      if (touch.misfits.flags == misfit_offset) {
        touch.misfits.offset_ratio += revision_.shift;
      }
    }
    // Where something else contradicts the model, that is the cause; an offset has a flag of its own.
    if (tilted_ && !(touch.misfits.flags & (misfit_offset | misfit_drift | misfit_lag | misfit_curve))) {
      touch.misfits.flags |= misfit_tilt;
    }
    touch.misfits.flags = level_flags_ ? level_flags_ : touch.misfits.flags;
  }

  /// Settings of the level ratio.
  constexpr auto& level_settings() noexcept { return evidence_.level.settings; }
  /// The same, of a constant tracker.
  constexpr const auto& level_settings() const noexcept { return evidence_.level.settings; }

 private:
  /// What it learns from the samples of a touch.
  struct Evidence {
    ModelTest<Real> test;
    Reviser<Real> reviser;
    Level level;
  };

  static constexpr Real least_change = Real(0.005);  // share; smaller ones have no flag: gauges are bent, by .5 %/pF

  static constexpr Real larger(Real left, Real right) noexcept { return left > right ? left : right; }

  /// Whether the ratio is another one, by more than 4 errors of both.
  template <class Errors>
  static constexpr bool differs(const Estimator& estimator, const Errors& errors,
                                const Estimate<Real>& other) noexcept {
    if (!(other.standard_error >= 0)) {
      return false;
    }
    const Real apart = estimator.ratio() - other.ratio, own = errors.of(estimator);
    const Real square = product(own, own) + product(other.standard_error, other.standard_error);
    return product(apart, apart) > 16 * square && magnitude(apart / other.ratio) > least_change;
  }

  /// At a hand-over, and where a drift begins: the estimate before it.
  constexpr void keep([[maybe_unused]] const Snapshot& before, [[maybe_unused]] Time time,
                      [[maybe_unused]] const Estimator& now, [[maybe_unused]] Real confirmed,
                      [[maybe_unused]] bool alarm) noexcept {
    if constexpr (Before::goes_back) {
      if (confirmed > 0) {
        changes_.keep(time, now, before, evidence_, alarm);
      }
    }
  }

  /// A change is confirmed: the ratio before it. Of several, the one that is farthest from the ratio now counts; that of
  /// a few samples is none.
  template <class Errors>
  constexpr void note_change(const Estimator& now, const Errors& errors) noexcept {
    if (!changes_.estimator.settled()) {
      return;
    }
    const Estimate<Real> before{changes_.estimator.ratio(), errors.of(changes_.estimator)};
    const Real apart = magnitude(before.ratio - now.ratio());
    if (!(earlier_.standard_error > 0) || apart > magnitude(earlier_.ratio - now.ratio())) {
      earlier_ = before;
    }
  }

  /// The change was an effect of the lift, or too late. Returns whether it is large enough for a flag.
  template <class Errors>
  constexpr bool go_back(Estimator& estimator, const Errors& errors) noexcept {
    const Real before = changes_.estimator.ratio();
    const bool changed = magnitude(estimator.ratio() / before - 1) > least_change;
    after_ = changed ? Estimate<Real>{estimator.ratio(), errors.of(estimator)} : Estimate<Real>();
    earlier_ = {};
    estimator = changes_.estimator;
    evidence_ = changes_.evidence;
    return changed;
  }

  /// Whether the ratio changed within the touch.
  template <class Errors>
  constexpr bool has_changed(const Estimator& estimator, const Errors& errors) noexcept {
    if (changes_.waits()) {
      note_change(estimator, errors);
    }
    return differs(estimator, errors, earlier_);
  }

  PALPATE_INLINE constexpr void add_level([[maybe_unused]] const JudgedSample<Real, Time>& sample,
                                          [[maybe_unused]] bool held) noexcept {
    if constexpr (levels) {
      evidence_.level.add(sample.hard, sample.soft, sample.time.template seconds_since<Real>(begin_), held);
    }
  }

  // After a change that was not confirmed the fall has another ratio; codes that are too coarse show no line.
  template <class Errors>
  constexpr void find_level([[maybe_unused]] const Estimator& estimator, [[maybe_unused]] const Errors& errors,
                            [[maybe_unused]] bool revised) noexcept {
    if constexpr (levels) {
      const Real gain = at_once_ || errors.decimated > 1 ? Real(1) : noise_gain<Real>;
      const Real noise = product(gain, product(errors.soft.noise(), errors.soft.noise()));
      level_ = evidence_.level.result(estimator.ratio(), noise, revised && !lifted_);
      if (errors.rounding(estimator) > 0) {
        level_ = {};
      }
      tilted_ = differs(estimator, errors, level_);
      misfits_.tilt = level_.ratio > 0 ? (estimator.ratio() - level_.ratio) / level_.ratio : Real(0);
    }
  }

  Evidence evidence_;
  std::conditional_t<Before::goes_back, PendingChange<Real, Time, Estimator, Snapshot, Evidence>,
                     LastHold<Estimator, Evidence>>
      changes_;
  Time begin_;  // of the touch
  Misfits<Real> misfits_;
  typename Reviser<Real>::Result revision_;
  Estimate<Real> level_, earlier_, after_;  // the last two: on the other side of a change
  Real first_error_ = 0;
  std::uint8_t level_flags_ = 0;
  bool tilted_ = false;   // the ratio and the level ratio differ
  bool lifted_ = false;   // the result is the one before a change that was not confirmed
  bool drifts_ = false;   // the ratio, at the last sample
  bool rests_ = false;    // the baselines are measured, and no touch has begun
  bool at_once_ = false;  // both channels are read at once
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
