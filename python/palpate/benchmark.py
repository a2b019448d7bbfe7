"""Benchmark: error and run time of every estimator on every simulated scenario.

Scenes run from the readings on, as in an application. Bare estimators and other libraries get the begin of the press: they
get the changes of each channel from its mean before contact, for as many pairs as the scenes use. They run twice: on the
readings as they come, and ("+A") on pairs aligned as in the scene handheld.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from pathlib import Path
from timeit import repeat
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from palpate import rivals
from palpate._core import AdaptiveRls, HandoverRls, Rls, Tracker
from palpate.ad7746.datasheet import NOISE_PF
from palpate.display.plots import FAST, HANDHELD, HARD, PAGE_IN, PAPER, SLOW, SOFT, TRUTH, written
from palpate.reference import matched_pair
from palpate.simulation import scenarios
from palpate.simulation.probe import Simulation, simulate
from palpate.simulation.scenario import Scenario

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


@dataclass(frozen=True)
class ErrorTrace:
    """Relative error of one estimator on one touch, after each pair from contact on."""

    since_s: Array
    error: Array
    alarm: NDArray[np.bool_]
    standard_error: Array  # relative; nan where unknown
    result: float = math.nan  # error of the result, if it is not the last ratio: revised after the release


@dataclass(frozen=True)
class Row:
    """Error and speed of one estimator on one scenario.

    Attributes
    ----------
    scenario, estimator : str
    rmse : float
        Relative rms error of the steady part, median over the seeds; 1 for a lost press.
    bias : float
        Relative error at the end of the touch, mean over the seeds; nan if all presses are lost.
    alarm : float, in [0, 1]
        Share of the steady part in alarm, mean over the seeds; nan if all presses are lost.
    coverage : float, in [0, 1]
        Share of seeds whose nominal 95 % interval contains the truth at the end; nan without a standard error.
    pairs_to_3_percent, slowest_pairs : float
        Pairs after a step until the error stays below 3 %: median and largest over the seeds; nan without a step.
    ns : float
        Run time for each pair, ns, minimum. Of a scene: all its stages. With "+A": the estimator, and all stages of the
        scene handheld but its own estimator. Else the estimator alone.
    rms : float
        Relative rms error of the steady part over all seeds; 1 for a lost press. Above `rmse` where a few seeds are worse.
    end : float
        Relative error of the result, without sign, median over the seeds; 1 for a lost press. The result is the ratio at
        the end of the touch; of a scene the ratio of the touch, which handheld and sliding revise after the release.

    Examples
    --------
    >>> [row] = [row for row in compare(1, ["stiff-steady"]) if row.estimator == "handheld scene"]
    >>> row.rmse < 0.01
    True
    """

    scenario: str
    estimator: str
    rmse: float
    bias: float
    alarm: float
    coverage: float
    pairs_to_3_percent: float
    slowest_pairs: float
    ns: float
    rms: float
    end: float


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
        return ErrorTrace(self.since_s, ratio / self.truth - 1, alarm, np.full(len(ratio), math.nan))


def pairs_as_read(run: Simulation) -> Pairs:
    """Return the pairs of readings as they come, the soft one later than the hard one."""
    used = np.isfinite(run.hard) & np.isfinite(run.soft) & (run.t_hard_s >= run.presses[0].start_s)
    return _changes(run, np.flatnonzero(used), run.hard[used], run.soft[used])


def pairs_aligned(run: Simulation) -> Pairs:
    """Return the pairs that the scene handheld makes of the readings; each counts from the reading that completes it."""
    made = matched_pair(*_times_ns(run), run.hard, run.soft)
    soft_at = np.flatnonzero(np.isfinite(run.soft))
    at = np.flatnonzero(made.valid)
    middle = soft_at[np.searchsorted(soft_at, at) - 1]  # a pair is of the time before its last reading
    at = at[run.t_hard_s[middle] >= run.presses[0].start_s]
    return _changes(run, at, made.hard[at], made.soft[at])


def _times_ns(run: Simulation) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    hard, soft = (np.round(times * 1e9).astype(np.int64) for times in (run.t_hard_s, run.t_soft_s))
    return hard, soft


def _changes(run: Simulation, at: NDArray[np.intp], hard: Array, soft: Array) -> Pairs:
    start = run.presses[0].start_s
    inside = np.isfinite(run.true_ratio[at]) & (run.t_hard_s[at] < start + LENGTH_S)
    idle = run.t_hard_s < start - EARLY_S
    return Pairs(
        run.t_hard_s[at[inside]] - start,
        hard[inside] - np.nanmean(run.hard[idle]),
        soft[inside] - np.nanmean(run.soft[idle]),
        run.true_ratio[at[inside]],
    )


def _no_alarm(estimate: Callable[..., Array]) -> Estimate:
    return lambda output, regressor: (estimate(output, regressor), np.zeros(len(output), bool))


_PRIOR = {"initial_covariance": rivals.COVARIANCE, "max_covariance": rivals.COVARIANCE}


def _adaptive(**settings: float) -> Estimate:
    def estimate(output: Array, regressor: Array) -> tuple[Array, NDArray[np.bool_]]:
        rows = AdaptiveRls(**settings, **_PRIOR).trace(output, regressor)
        return rows["ratio"], rows["alarm"]

    return estimate


def _fixed(forgetting: float) -> Estimate:
    return _no_alarm(lambda output, regressor: Rls(forgetting=forgetting, **_PRIOR).process(output, regressor))


# Of e = y - r x at the largest ratio of the probe: with less, the noise of a stiff object is an alarm.
_NOISE_PF = NOISE_PF[0] * math.hypot(1, scenarios.PROBE.rigid_ratio)
OWN: dict[str, Estimate] = {
    "fixed 0.995": _fixed(0.995),
    "fixed 0.9": _fixed(0.9),
    "paper": _adaptive(),
    "paper tuned": _adaptive(alarmed=0.5, drift=2 * _NOISE_PF, threshold=5 * _NOISE_PF),
}
"""Estimators of palpate without a scene: name -> function(output, regressor) that returns (ratio, alarm)."""


def bare_estimators(*, libraries: bool = True) -> dict[str, Estimate]:
    """Return the estimators without a scene: those of palpate, other methods, and the other libraries that are installed."""
    others = rivals.METHODS | (rivals.installed() if libraries else {})
    return OWN | {name: _no_alarm(estimate) for name, estimate in others.items()}


def scene_trace(scene: "_Scene", run: Simulation, **settings: Any) -> ErrorTrace:
    """Return the error of a scene, with settings of your own, on the press of a simulation."""
    tracker = Tracker(scene, **settings)
    rows = tracker.process(run.t_hard_s, run.t_soft_s, run.hard, run.soft)
    used = (rows["touch"] > 0) & np.isfinite(run.true_ratio)
    truth = run.true_ratio[used]
    since = run.t_hard_s[used] - run.presses[0].start_s
    error = rows["ratio"][used] / truth - 1
    result = tracker.touches[0].ratio / truth[-1] - 1 if used.any() and tracker.touches else math.nan
    return ErrorTrace(since, error, rows["alarm"][used], rows["standard_error"][used] / truth, result)


def nanoseconds(work: Callable[[], Any], pairs: int, repeats: int = 25) -> float:
    """Return the run time for each pair, ns: the fastest of several runs."""
    return min(repeat(work, number=1, repeat=repeats)) / pairs * 1e9


def long_touch() -> Simulation:
    """Return a simulated touch of about 15,000 pairs, to measure run times."""
    press = scenarios.SCENARIOS["tremor"].presses[0]
    return simulate(Scenario(presses=[replace(press, hold_s=500.0)], duration_s=400.0, tremor=0.03), seed=1)


def costs() -> dict[str, float]:
    """Return the run time of every estimator for each pair, ns, as in `Row`."""
    run = long_touch()
    y, x = run.hard - 0.62, run.soft + 0.41
    scenes = {f"{scene} scene": nanoseconds(_scene_work(scene, run), len(y)) for scene in SCENES}
    stages = max(0.0, scenes["handheld scene"] - nanoseconds(partial(HandoverRls().process, y, x), len(y)))
    bare = {name: nanoseconds(partial(estimate, y, x), len(y)) for name, estimate in OWN.items()}
    few = slice(100, 600)  # the libraries take microseconds for each pair
    for name, estimate in (rivals.METHODS | rivals.installed()).items():
        bare[name] = nanoseconds(partial(estimate, y[few], x[few]), few.stop - few.start, repeats=10)
    return scenes | bare | {name + ALIGNED: ns + stages for name, ns in bare.items()}


def _scene_work(scene: "_Scene", run: Simulation) -> Callable[[], Any]:
    times_ns = _times_ns(run)
    return lambda: Tracker(scene, samples=None).process(*times_ns, run.hard, run.soft)


def summarise(scenario: str, estimator: str, traces: Iterable[ErrorTrace], ns: float = math.nan) -> Row:
    """Return the row of one estimator, from its traces for all seeds."""
    rmse, end, last, alarm, covered, follow = [], [], [], [], [], []
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
        bias=float(np.mean(last)) if last else math.nan,
        alarm=float(np.mean(alarm)) if alarm else math.nan,
        coverage=float(np.mean(covered)) if covered else math.nan,
        pairs_to_3_percent=float(np.median(follow)) if follow else math.nan,
        slowest_pairs=float(max(follow)) if follow else math.nan,
        ns=ns,
        rms=math.sqrt(np.mean(np.square(rmse))),
        end=float(np.median(end)),
    )


SINGLE = [
    name
    for name, s in scenarios.SCENARIOS.items()
    if len(s.presses) == 1 and name not in ("sliding", "saturating", "tap")
]
"""The scenarios with one press that is held, and one true ratio at a time."""


def compare(seeds: int, names: Iterable[str] = SINGLE, extra: dict[str, Estimate] | None = None) -> list[Row]:
    """Return error and speed of every estimator on every scenario.

    Parameters
    ----------
    seeds : int
        Number of simulated recordings of each scenario, 1 or more.
    names : iterable of str
        Names of scenarios; default: all in `SINGLE`.
    extra : dict, optional
        More estimators: name -> function(output, regressor) that returns (ratio, alarm), arrays of shape (n,).

    Returns
    -------
    list of Row

    Examples
    --------
    >>> rows = compare(1, ["stiff-steady"])
    >>> print(table(rows).split()[:2])
    ['scenario', 'estimator']
    """
    ns = costs()
    return [row for name in names for row in on_scenario(name, seeds, ns, bare_estimators() | (extra or {}))]


def on_scenario(name: str, seeds: int, ns: Mapping[str, float], bare: Mapping[str, Estimate]) -> list[Row]:
    """Return the rows of one scenario: the scenes, then the bare estimators; run times as from `costs`."""
    runs = [scenarios.run(name, seed) for seed in range(seeds)]
    found: dict[str, list[ErrorTrace]] = {f"{s} scene": [scene_trace(s, run) for run in runs] for s in SCENES}
    for suffix, pairs_of in (("", pairs_as_read), (ALIGNED, pairs_aligned)):
        pairs = [pairs_of(run) for run in runs]
        for estimator, estimate in bare.items():
            found[estimator + suffix] = [of_run.trace(estimate) for of_run in pairs]
    return [summarise(name, title, traces, ns.get(title, math.nan)) for title, traces in found.items()]


def table(rows: Iterable[Row]) -> str:
    """Return rows as a text table.

    Parameters
    ----------
    rows : iterable of Row

    Returns
    -------
    str
        A header and one line for each row; an empty line between scenarios.

    Examples
    --------
    >>> row = Row("tremor", "paper", 0.01, 0.0, 0.5, 0.95, 4.0, 6.0, 20.0, 0.02, 0.01)
    >>> table([row]).splitlines()[1].split()
    ['tremor', 'paper', '1.0000', '0.0000', '50.0', '95.0', '4', '(6)', '20.0']
    """
    head = "scenario        estimator        rmse %   bias %  alarm %  cover %  pairs to 3 % (slowest)  ns/pair\n"
    return head + "\n\n".join("\n".join(map(_line, some)) for _, some in groupby(rows, lambda row: row.scenario))


def _line(r: Row) -> str:
    pairs = "-" if math.isnan(r.pairs_to_3_percent) else f"{r.pairs_to_3_percent:.0f} ({r.slowest_pairs:.0f})"
    cover, ns = ("-" if math.isnan(value) else f"{value:.1f}" for value in (100 * r.coverage, r.ns))
    errors = f"{100 * r.rmse:8.4f} {100 * r.bias:8.4f} {100 * r.alarm:8.1f}"
    return f"{r.scenario:15} {r.estimator:14} {errors} {cover:>8} {pairs:>23} {ns:>8}"


PLOTTED = {
    "strong-tremor": "a hand that trembles",
    "step-up": "a step of the ratio",
    "spikes": "spikes in the readings",
    "slow-drift": "ratio and baselines drift, another is better",
}
"""Scenarios of the picture, and what each shows."""
_LOOKS: dict[str, tuple[str, str]] = {
    "handheld scene": ("D", HANDHELD),
    "sliding scene": ("d", HANDHELD),
    "paper scene": ("o", PAPER),
    "paper": ("P", PAPER),
    "paper tuned": ("*", PAPER),
    "fixed 0.995": ("s", SLOW),
    "fixed 0.9": ("s", FAST),
    "Kalman walk": ("^", HARD),
    "sum / sum": ("v", HARD),
    "restarted": ("*", HARD),
    **dict(zip(rivals.LIBRARIES, [(mark, SOFT) for mark in "X<>ph"], strict=True)),
}


def plot(rows: Sequence[Row], path: Path) -> None:
    """Draw error against run time: a panel for each scenario, a point for each estimator, and the front of the best."""
    names = list(dict.fromkeys(row.scenario for row in rows))
    across = min(2, len(names))
    down = -(-len(names) // across)
    with written(path, PAGE_IN, 2.4 * down + 1.1) as figure:
        axes = figure.subplots(down, across, sharex=True, sharey=True, squeeze=False)
        for ax, name in zip(axes.flat, names, strict=False):
            _panel(ax, [row for row in rows if row.scenario == name])
            ax.set_title(f"{name}: {PLOTTED[name]}" if name in PLOTTED else name)
        for ax in axes.flat[len(names) :]:
            ax.set_axis_off()
        for ax in axes[-1]:
            ax.set_xlabel("run time of a pair of readings, ns")
        for ax in axes[:, 0]:
            ax.set_ylabel("error of the ratio, %")
        first = axes[0, 0]
        first.plot([], [], "o", color="black", ms=5, mew=0.9, mfc="none", label="hollow: on readings as they come")
        first.plot([], [], "o", color="black", ms=5, label="filled: on aligned pairs")
        figure.legend(*first.get_legend_handles_labels(), loc="outside lower center", ncols=4)


def _panel(ax: Any, rows: Sequence[Row]) -> None:
    for row in rows:
        name = row.estimator.removesuffix(ALIGNED)
        mark, colour = _LOOKS.get(name, ("*", "black"))
        filled = row.estimator.endswith(ALIGNED) or row.estimator in ("handheld scene", "sliding scene")
        look: dict[str, Any] = {"mec": "white", "mew": 0.4} if filled else {"mfc": "none", "mew": 0.9}
        look |= {"ms": 8 if name == "handheld scene" else 5.5, "zorder": 4 if "scene" in name else 3}
        label = name if filled or name == "paper scene" else "_"
        ax.loglog(row.ns, 100 * row.rmse, mark, color=colour, ls="", label=label, **look)
    ns, errors = zip(*((row.ns, 100 * row.rmse) for row in front(rows)), strict=True)
    ax.step(ns, errors, where="post", label="front: no other is better", **TRUTH)


def front(rows: Iterable[Row]) -> list[Row]:
    """Return the rows that are better by 1 % than all faster ones, the fastest first."""
    best: list[Row] = []
    for row in sorted(rows, key=lambda row: row.ns):
        if math.isfinite(row.ns) and (not best or row.rmse < 0.99 * best[-1].rmse):
            best.append(row)
    return best
