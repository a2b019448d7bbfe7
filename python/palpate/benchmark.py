"""Benchmark: error and run time of every estimator on every simulated scenario.

Scenes run from the readings on, as in an application. Bare estimators (and other libraries) use the true contact: they
get the changes of each channel from its mean before contact, from the beginning of the press, for as many pairs as the
scenes use.
"""

import math
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from palpate._core import AdaptiveRls, Rls, Tracker
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
SCENES: tuple["_Scene", ...] = ("paper", "handheld", "sliding")


@dataclass(frozen=True)
class ErrorTrace:
    """Relative error of one estimator on one touch, after each pair from contact on."""

    since_s: Array
    error: Array
    alarm: NDArray[np.bool_]
    standard_error: Array  # relative; nan where unknown


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
        Run time for each pair, ns, minimum.
    rms : float
        Relative rms error of the steady part over all seeds; 1 for a lost press. Above `rmse` where a few seeds are worse.

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


def _ewma_least_squares(output: Array, regressor: Array, forgetting: float = 0.995) -> Array:
    from scipy.signal import lfilter

    numerator = lfilter([1.0], [1.0, -forgetting], output * regressor)
    return np.asarray(numerator / lfilter([1.0], [1.0, -forgetting], regressor**2))


Estimate = Callable[[Array, Array], tuple[Array, NDArray[np.bool_]]]


def _no_alarm(ratio: Array) -> tuple[Array, NDArray[np.bool_]]:
    return ratio, np.zeros(len(ratio), bool)


def _adaptive(output: Array, regressor: Array) -> tuple[Array, NDArray[np.bool_]]:
    rows = AdaptiveRls().trace(output, regressor)
    return rows["ratio"], rows["alarm"]


def bare_estimators() -> dict[str, Estimate]:
    """Return the estimators without a scene: those of palpate, and a scipy filter if scipy is installed."""
    found: dict[str, Estimate] = {
        "fixed 0.995": lambda y, x: _no_alarm(Rls(forgetting=0.995).process(y, x)),
        "fixed 0.9": lambda y, x: _no_alarm(Rls(forgetting=0.9).process(y, x)),
        "paper": _adaptive,
    }
    try:
        import scipy.signal  # noqa: F401
    except ImportError:
        return found
    return found | {"lfilter 0.995": lambda y, x: _no_alarm(_ewma_least_squares(y, x))}


def scene_trace(scene: "_Scene", run: Simulation, **settings: Any) -> ErrorTrace:
    """Return the error of a scene, with settings of your own, on the press of a simulation."""
    tracker = Tracker(scene, **settings)
    rows = tracker.process(run.t_hard_s, run.t_soft_s, run.hard, run.soft)
    used = (rows["touch"] > 0) & np.isfinite(run.true_ratio)
    truth = run.true_ratio[used]
    since = run.t_hard_s[used] - run.presses[0].start_s
    error = rows["ratio"][used] / truth - 1
    return ErrorTrace(since, error, rows["alarm"][used], rows["standard_error"][used] / truth)


def bare_trace(estimate: Estimate, run: Simulation) -> ErrorTrace:
    """Return the error of a bare estimator on the first press of a simulation."""
    good = np.isfinite(run.hard) & np.isfinite(run.soft)
    press = run.presses[0]
    idle = good & (run.t_hard_s < press.start_s - 0.1)
    used = good & np.isfinite(run.true_ratio) & (run.t_hard_s < press.start_s + LENGTH_S)
    output, regressor = run.hard[used] - run.hard[idle].mean(), run.soft[used] - run.soft[idle].mean()
    ratio, alarm = estimate(output, regressor)
    error = ratio / run.true_ratio[used] - 1
    return ErrorTrace(run.t_hard_s[used] - press.start_s, error, alarm, np.full(len(error), math.nan))


def nanoseconds(work: Callable[[], Any], pairs: int, repeats: int = 25) -> float:
    """Return the run time for each pair, ns: the fastest of several runs."""
    best = math.inf
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        best = min(best, time.perf_counter() - start)
    return best / pairs * 1e9


def long_touch() -> Simulation:
    """Return a simulated touch of about 15,000 pairs, to measure run times."""
    press = scenarios.SCENARIOS["tremor"].presses[0]
    held = type(press)(**{**press.__dict__, "hold_s": 500.0})
    return simulate(Scenario(presses=[held], duration_s=400.0, tremor=0.03), seed=1)


def costs() -> dict[str, float]:
    """Return the run time of every estimator for each pair, ns: scenes with all stages, the others alone."""
    run = long_touch()
    y, x = run.hard - 0.62, run.soft + 0.41
    size = len(y)
    found = {f"{s} scene": nanoseconds(_scene_work(s, run), size) for s in SCENES}
    for name, estimate in bare_estimators().items():
        found[name] = nanoseconds(partial(estimate, y, x), size)
    return found


def _scene_work(scene: "_Scene", run: Simulation) -> Callable[[], Any]:
    t_hard, t_soft = (np.round(t * 1e9).astype(np.int64) for t in (run.t_hard_s, run.t_soft_s))
    return lambda: Tracker(scene, samples=None).process(t_hard, t_soft, run.hard, run.soft)


def summarise(scenario: str, estimator: str, traces: Iterable[ErrorTrace], ns: float) -> Row:
    """Return the row of one estimator, from its traces for all seeds."""
    rmse, last, alarm, covered, follow = [], [], [], [], []
    for t in traces:
        if not len(t.error):  # a lost press
            rmse.append(1.0)
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
    return [row for name in names for row in on_scenario(name, seeds, ns, extra)]


def on_scenario(name: str, seeds: int, ns: dict[str, float], extra: dict[str, Estimate] | None = None) -> list[Row]:
    """Return the rows of one scenario; arguments as in `compare`, run times as from `costs`."""
    runs = [scenarios.run(name, seed) for seed in range(seeds)]
    rows = []
    for scene in SCENES:
        title = f"{scene} scene"
        rows.append(summarise(name, title, (scene_trace(scene, run) for run in runs), ns.get(title, math.nan)))
    for estimator, estimate in {**bare_estimators(), **(extra or {})}.items():
        traces = (bare_trace(estimate, run) for run in runs)
        rows.append(summarise(name, estimator, traces, ns.get(estimator, math.nan)))
    return rows


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
    >>> row = Row("tremor", "paper", 0.01, 0.0, 0.5, 0.95, 4.0, 6.0, 20.0, 0.02)
    >>> table([row]).splitlines()[1].split()
    ['tremor', 'paper', '1.0000', '0.0000', '50.0', '95.0', '4', '(6)', '20.0']
    """
    lines = [
        "scenario        estimator        rmse %   bias %  alarm %  cover %  pairs to 3 % (slowest)  ns/pair",
    ]
    before = ""
    for r in rows:
        if before not in ("", r.scenario):
            lines.append("")
        before = r.scenario
        pairs = "-" if math.isnan(r.pairs_to_3_percent) else f"{r.pairs_to_3_percent:.0f} ({r.slowest_pairs:.0f})"
        cover = "-" if math.isnan(r.coverage) else f"{100 * r.coverage:.1f}"
        ns = "-" if math.isnan(r.ns) else f"{r.ns:.1f}"
        lines.append(
            f"{r.scenario:15} {r.estimator:14} {100 * r.rmse:8.4f} {100 * r.bias:8.4f} {100 * r.alarm:8.1f} {cover:>8}"
            f" {pairs:>23} {ns:>8}"
        )
    return "\n".join(lines)
