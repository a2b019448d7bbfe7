"""Errors and run times of every estimator, ours and every rival, on simulated touches with known truth.

Scenes run from the readings on, as in an application. Bare estimators and other libraries do not find the contact: they
get the changes of each channel from its mean before contact, for as many pairs as the scenes use. They run twice: on the
readings as they come, and ("+A") on pairs aligned as in the scene handheld. Needs the extra science.
"""

import json
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from time import perf_counter_ns
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from palpate import AdaptiveRls, HandoverRls, Rls, Tracker
from palpate.ad7746.registers import NOISE_PF
from palpate.elasticity import SORBOTHANE_MPA
from palpate.reference import matched_pair
from palpate.simulation import Press, Scenario, Simulation, scenarios, simulate

from bench.accuracy import rivals
from bench.accuracy.scene_rows import scene_rows
from bench.results_age import RESULTS

if TYPE_CHECKING:
    from palpate._core import _Scene

Array = NDArray[np.float64]
SETTLED_S = 1.0  # after contact, and after a step; later samples are steady
STEP_S = 4.0
WITHIN = 0.03
LENGTH_S = 6.5  # of a touch
EARLY_S = 0.1  # the baseline ends so long before the press
SCENES: tuple["_Scene", ...] = ("paper", "handheld", "sliding")
ALIGNED = " +A"
WARM_UP = 50  # pairs


@dataclass(frozen=True)
class Cost:
    """Run time for each pair, ns: of the estimator alone, and of the stages of its scene before and after it."""

    estimator_ns: float = math.nan
    stages_ns: float = 0.0

    @property
    def ns(self) -> float:
        """Of the whole."""
        return self.estimator_ns + self.stages_ns


@dataclass(frozen=True)
class ErrorTrace:
    """Relative error of one estimator on one touch, after each pair from contact on."""

    since_s: Array
    error: Array
    alarm: NDArray[np.bool_]
    standard_error: Array  # relative; nan where unknown
    # error of the result, if it is not the last ratio: revised after the release
    result: float = math.nan


@dataclass(frozen=True)
class Row:
    """Error and speed of one estimator on one scenario.

    Attributes
    ----------
    scenario, estimator : str
    rmse, rmse_90 : float
        Relative rms error of the steady part, median and 90th percentile over the seeds; 1 for a lost press.
    bias : float
        Relative error at the end of the touch, mean over the seeds; nan if all presses are lost.
    alarm : float, in [0, 1]
        Share of the steady part in alarm, mean over the seeds; nan if all presses are lost.
    coverage : float, in [0, 1]
        Share of seeds whose nominal 95 % interval contains the truth at the end; nan without a standard error.
    pairs_to_3_percent, slowest_pairs : float
        Pairs after a step until the error stays below 3 %: median and largest over the seeds; nan without a step.
    end : float
        Relative error of the result, without sign, median over the seeds; 1 for a lost press. The result is the ratio at
        the end of the touch; of a scene the ratio of the touch, which handheld and sliding revise after the release.
    cost : Cost
        Without "+A", a bare estimator has no stages.
    """

    scenario: str
    estimator: str
    rmse: float
    rmse_90: float
    bias: float
    alarm: float
    coverage: float
    pairs_to_3_percent: float
    slowest_pairs: float
    end: float
    cost: Cost = Cost()


Estimate = Callable[[Array, Array], tuple[Array, NDArray[np.bool_]]]


@dataclass(frozen=True)
class Pairs:
    """Changes of both channels in the first press of a simulation, for estimators without a detection of contact."""

    since_s: Array
    output: Array
    regressor: Array
    truth: Array

    def trace(self, estimate: Estimate) -> ErrorTrace:
        """Return the error of an estimator."""
        ratio, alarm = estimate(self.output, self.regressor)
        return ErrorTrace(
            self.since_s, ratio / self.truth - 1, alarm, np.full(len(ratio), math.nan)
        )


def pairs_as_read(run: Simulation) -> Pairs:
    """Return the pairs of readings as they come, the soft one later than the hard one."""
    used = np.isfinite(run.hard) & np.isfinite(run.soft) & (run.t_hard_s >= run.presses[0].start_s)
    return _changes(run, np.flatnonzero(used), run.hard[used], run.soft[used], LENGTH_S)


def pairs_aligned(run: Simulation, length_s: float = LENGTH_S) -> Pairs:
    """Return the pairs that the scene handheld makes of the readings; each counts from the reading that completes it."""
    made = matched_pair(*_times_ns(run), run.hard, run.soft)
    soft_at = np.flatnonzero(np.isfinite(run.soft))
    at = np.flatnonzero(made.valid)
    # a pair is of the time before its last reading
    middle = soft_at[np.searchsorted(soft_at, at) - 1]
    at = at[run.t_hard_s[middle] >= run.presses[0].start_s]
    return _changes(run, at, made.hard[at], made.soft[at], length_s)


def _times_ns(run: Simulation) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    hard, soft = (np.round(times * 1e9).astype(np.int64) for times in (run.t_hard_s, run.t_soft_s))
    return hard, soft


def _changes(
    run: Simulation, at: NDArray[np.intp], hard: Array, soft: Array, length_s: float
) -> Pairs:
    start = run.presses[0].start_s
    inside = np.isfinite(run.true_ratio[at]) & (run.t_hard_s[at] < start + length_s)
    idle = run.t_hard_s < start - EARLY_S
    return Pairs(
        run.t_hard_s[at[inside]] - start,
        hard[inside] - np.nanmean(run.hard[idle]),
        soft[inside] - np.nanmean(run.soft[idle]),
        run.true_ratio[at[inside]],
    )


def _no_alarm(estimate: Callable[..., Array]) -> Estimate:
    return lambda output, regressor: (estimate(output, regressor), np.zeros(len(output), bool))


def traced(kind: type[AdaptiveRls | HandoverRls], **settings: float) -> Estimate:
    """Return an estimator of palpate with these settings, each time a new one."""

    def estimate(output: Array, regressor: Array) -> tuple[Array, NDArray[np.bool_]]:
        rows = kind(**settings).trace(output, regressor)
        return rows["ratio"], rows["alarm"]

    return estimate


def _fixed(forgetting: float) -> Estimate:
    return _no_alarm(
        lambda output, regressor: Rls(forgetting=forgetting).process(output, regressor)
    )


# Of e = y - r x at the largest ratio of the probe: with less, the noise of a stiff object is an alarm.
_NOISE_PF = NOISE_PF[0] * math.hypot(1, scenarios.PROBE.rigid_ratio)
OWN: dict[str, Estimate] = {
    "fixed 0.995": _fixed(0.995),
    "fixed 0.9": _fixed(0.9),
    "paper": traced(AdaptiveRls),
    "paper tuned": traced(AdaptiveRls, alarmed=0.5, drift=2 * _NOISE_PF, threshold=5 * _NOISE_PF),
}
"""Estimators of palpate without a scene: name -> function(output, regressor) that returns (ratio, alarm)."""


def bare_estimators(*, libraries: bool) -> dict[str, Estimate]:
    """Return the estimators without a scene: those of palpate, other methods, and the other libraries that are installed."""
    others = rivals.METHODS | (rivals.installed() if libraries else {})
    return OWN | {name: _no_alarm(estimate) for name, estimate in others.items()}


def scene_trace(scene: "_Scene", run: Simulation, **settings: Any) -> ErrorTrace:
    """Return the error of a scene, with settings of your own, on the press of a simulation."""
    tracker = Tracker(scene, **settings)
    rows = scene_rows(run, scene, tracker)
    used = (rows["touch"] > 0) & np.isfinite(run.true_ratio)
    truth = run.true_ratio[used]
    since = run.t_hard_s[used] - run.presses[0].start_s
    error = rows["ratio"][used] / truth - 1
    if used.any() and tracker.touches:
        result = tracker.touches[0].ratio / truth[-1] - 1
    else:
        result = math.nan
    return ErrorTrace(
        since, error, rows["alarm"][used], rows["standard_error"][used] / truth, result
    )


def nanoseconds(estimate: Callable[..., Any], pieces: Sequence[Sequence[Any]]) -> float:
    """Return the run time for each pair, ns: the fastest of several pieces of data, each of which is seen once."""
    estimate(*(part[:WARM_UP] for part in pieces[0]))  # compiles
    found = []
    for piece in pieces:
        start_ns = perf_counter_ns()
        estimate(*piece)
        found.append((perf_counter_ns() - start_ns) / len(piece[0]))
    return min(found)


def long_touch(seed: int) -> Simulation:
    """Return a simulated touch of about 15,000 pairs, to measure run times."""
    press = replace(scenarios.SCENARIOS["tremor"].presses[0], hold_s=500.0)
    return simulate(Scenario(presses=[press], duration_s=400.0, tremor=0.03), seed)


def costs() -> dict[str, Cost]:
    """Return the run time of every estimator for each pair."""
    runs = [long_touch(seed) for seed in range(10)]
    aligned = [pairs_aligned(run, math.inf) for run in runs]
    pairs = [(of_run.output, of_run.regressor) for of_run in aligned]
    few = [(y[:500], x[:500]) for y, x in pairs]  # for those that take microseconds
    alone = {name: nanoseconds(estimate, pairs) for name, estimate in OWN.items()}
    for name, estimate in rivals.timed().items():
        alone[name] = nanoseconds(estimate, few if name in rivals.LIBRARIES else pairs)
    of_scene = {"paper": 1.0, "handheld": _in_adaptive(HANDOVER), "sliding": _in_adaptive(WINDOWS)}
    readings = [(*_times_ns(run), run.hard, run.soft) for run in runs]
    found = {name: Cost(ns) for name, ns in alone.items()}
    for scene in SCENES:
        whole_ns = nanoseconds(partial(_in_scene, scene), readings)
        own_ns = alone["paper"] * of_scene[scene]
        found[f"{scene} scene"] = Cost(own_ns, max(0.0, whole_ns - own_ns))
    stages_ns = found["handheld scene"].stages_ns
    return found | {name + ALIGNED: Cost(ns, stages_ns) for name, ns in alone.items()}


HANDOVER = "Handover, of the scenes"
WINDOWS = "HandoverRls"


def _in_adaptive(estimator: str) -> float:
    """Return how many times as long an estimator takes as AdaptiveRls, by bench.speed: Handover has no class in Python."""
    figures = json.loads((RESULTS / "speed.json").read_text(encoding="utf-8"))
    return float(figures[estimator]["min"] / figures["AdaptiveRls"]["min"])


def _in_scene(scene: "_Scene", *readings: Any) -> None:
    Tracker(scene, samples=None).process(*readings)


def summarise(
    scenario: str, estimator: str, traces: Iterable[ErrorTrace], cost: Cost = Cost()
) -> Row:
    """Return the row of one estimator, from its traces for all seeds."""
    rmse = []
    end = []
    last = []
    alarm = []
    covered = []
    follow = []
    for t in traces:
        if not len(t.error):  # a lost press
            rmse.append(1.0)
            end.append(1.0)
            continue
        steady = t.since_s > SETTLED_S
        if "step" in scenario:
            steady &= (t.since_s < STEP_S) | (t.since_s > STEP_S + SETTLED_S)
            after = np.abs(t.error[t.since_s >= STEP_S]) > WITHIN
            follow.append(int(np.flatnonzero(after)[-1]) + 1 if after.any() else 0)
        if not steady.any():  # it ended before: its last pair
            steady[-1] = True
        rmse.append(math.sqrt(np.mean(t.error[steady] ** 2)))
        alarm.append(t.alarm[steady].mean())
        last.append(t.error[-1])
        end.append(abs(t.error[-1] if math.isnan(t.result) else t.result))
        if np.isfinite(t.standard_error[-1]):
            covered.append(abs(t.error[-1]) < 1.96 * t.standard_error[-1])
    return Row(
        scenario,
        estimator,
        rmse=float(np.median(rmse)),
        rmse_90=float(np.percentile(rmse, 90)),
        bias=float(np.mean(last)) if last else math.nan,
        alarm=float(np.mean(alarm)) if alarm else math.nan,
        coverage=float(np.mean(covered)) if covered else math.nan,
        pairs_to_3_percent=float(np.median(follow)) if follow else math.nan,
        slowest_pairs=float(max(follow)) if follow else math.nan,
        end=float(np.median(end)),
        cost=cost,
    )


def _slide() -> Scenario:
    """Return a touch that slides, from 2 s to 3.5 s after contact, to an object with a ratio 40 % larger."""
    first = scenarios.PROBE.ratio(SORBOTHANE_MPA["70 OO"])
    moments = np.linspace(2.0, 3.5, 301)
    path = np.linspace(first, 1.4 * first, 301)
    ratios = [(0.0, first), *zip(moments.tolist(), path.tolist(), strict=True)]
    return Scenario(presses=[Press(2.0, ratios)], duration_s=12.0)


SINGLE = {
    name: scenario
    for name, scenario in scenarios.SCENARIOS.items()
    if len(scenario.presses) == 1 and name not in ("sliding", "saturating", "tap")
} | {"slide": _slide()}
"""The scenarios with one press that is held, and one true ratio at a time."""
PICTURED = {
    "tremor": "a steady press by hand",
    "step-up": "a step of the ratio",
    "tilt-walk": "the ratio walks at random",
    "slide": "a slide to another object",
    "lag": "the soft gauge lags 0.1 s",
    "bursts": "bursts of noise",
}
"""Scenarios of the picture, and what each shows."""


def on_scenario(
    name: str, seeds: int, cost: Mapping[str, Cost], bare: Mapping[str, Estimate] | None = None
) -> list[Row]:
    """Return the rows of one scenario: the scenes, then the bare estimators; run times as from `costs`."""
    if bare is None:  # the libraries run on the scenarios of the picture only
        bare = bare_estimators(libraries=name in PICTURED)
    runs = [simulate(SINGLE[name], seed) for seed in range(seeds)]
    found: dict[str, list[ErrorTrace]] = {
        f"{s} scene": [scene_trace(s, run) for run in runs] for s in SCENES
    }
    for suffix, pairs_of in (("", pairs_as_read), (ALIGNED, pairs_aligned)):
        pairs = [pairs_of(run) for run in runs]
        for estimator, estimate in bare.items():
            found[estimator + suffix] = [of_run.trace(estimate) for of_run in pairs]
    return [
        summarise(name, title, traces, cost.get(title, Cost())) for title, traces in found.items()
    ]


def measure(seeds: int) -> list[Row]:
    """Return the rows of all scenarios."""
    cost = costs()  # first, alone
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # threads of two processes would wait for each other
    with ProcessPoolExecutor(os.cpu_count(), get_context("spawn")) as pool:
        parts = [pool.submit(on_scenario, name, seeds, cost) for name in SINGLE]
        return [row for part in parts for row in part.result()]
