"""The press of the required results, variants of it, and the errors of what is found: live, offline, and by a spline.

Unless a row says otherwise: ratio 2.8, 0.25 pF, noise 40 aF, 26 ms a pair, 2 s of baseline, and a tremor of 5 % rms: a
line of 3 to 7 Hz and one of 7 to 12 Hz, with a width, and sway. The same seed is the same hand in every row.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import palpate
from numpy.typing import NDArray
from palpate.simulation import Press, Scenario, Simulation, simulate
from palpate.simulation.signals import Lines

from bench.accuracy.scene_rows import scene_rows

if TYPE_CHECKING:
    from palpate._core import _Scene

Array = NDArray[np.float64]
T = TypeVar("T")
RATIO = 2.8
DEPTH_PF = 0.25
START_S = 2.0
PAIR_S = 0.026
EARLY_S = 0.3  # that a touch may begin before its press, and still be it
SIDES = 1.96  # standard errors on either side of a nominal 95 % interval


def held(
    tremor: float = 0.05,
    *,
    duration_s: float = 12.0,
    press: dict[str, Any] | None = None,
    **parts: Any,
) -> Scenario:
    """Return the scenario of one press; `press` and `parts` change its settings."""
    one = Press(START_S, **{"ratios": [(0.0, RATIO)], "depth_pF": DEPTH_PF, **(press or {})})
    return Scenario(presses=[one], duration_s=duration_s, tremor=tremor, **parts)


def recordings(scenario: Scenario, seeds: Iterable[int]) -> Iterator[Simulation]:
    """Simulate a scenario; each seed has lines of its own, and its presses begin anywhere within a pair."""
    for seed in seeds:
        hand = np.random.default_rng([seed, 2])
        late = PAIR_S * hand.uniform()
        spectrum = Lines((hand.uniform(3, 7), hand.uniform(7, 12)))
        presses = [replace(press, start_s=press.start_s + late) for press in scenario.presses]
        yield simulate(replace(scenario, presses=presses, spectrum=spectrum), seed)


@dataclass(frozen=True)
class Result:
    """Error and standard error of a ratio, relative, and the flags; a lost touch has the error 1."""

    error: float
    standard_error: float
    flags: frozenset[str] = frozenset()

    @property
    def covers(self) -> bool:
        """Whether the nominal 95 % interval holds the truth."""
        return abs(self.error) < SIDES * self.standard_error

    @property
    def silent(self) -> bool:
        """Whether it is wrong by more than 4 standard errors (0 if unknown) and 0.2 %, without a flag."""
        known = self.standard_error if math.isfinite(self.standard_error) else 0.0
        return not self.flags and abs(self.error) > max(4 * known, 2e-3)


LOST = Result(1.0, math.nan, frozenset({"lost"}))


def result(run: Simulation, *, host_stamps: bool = False) -> Result:
    """Return the best result known of the first press; a press that was short on purpose has no flag for that."""
    touch = found(run, host_stamps=host_stamps)
    if touch is None:
        return LOST
    truth = run.presses[0].ratios[-1][1]
    return Result(
        touch.ratio / truth - 1, touch.standard_error / truth, frozenset(touch.flags) - {"short"}
    )


def afterwards(run: Simulation, *, host_stamps: bool = False) -> Result:
    """Return the offline result of the first press."""
    touch = longest(palpate.offline(run, host_stamps=host_stamps), run, lambda touch: touch.live)
    if touch is None or math.isnan(touch.ratio):
        return LOST
    truth = run.presses[0].ratios[-1][1]
    return Result(
        touch.ratio / truth - 1, touch.standard_error / truth, frozenset(touch.flags) - {"short"}
    )


def found(
    run: Simulation, *, host_stamps: bool = False, scene: "_Scene" = "handheld"
) -> palpate.Touch | None:
    """Return the longest touch that begins in the first press, or a little before it."""
    touches = palpate.touches(run, host_stamps=host_stamps, scene=scene)
    return longest(touches, run, lambda touch: touch)


def longest(touches: list[T], run: Simulation, live: Callable[[T], palpate.Touch]) -> T | None:
    """Return the result whose touch is the longest that begins in the first press, or a little before it."""
    press = run.presses[0]
    inside = [
        touch for touch in touches if press.start_s - EARLY_S < live(touch).start_s < press.stop_s
    ]
    return max(inside, key=lambda touch: live(touch).samples, default=None)


def running(
    run: Simulation, moments: Sequence[float], scene: "_Scene" = "handheld"
) -> list[Result]:
    """Return what the last whole pair at each time since contact says."""
    rows = scene_rows(run, scene)
    last = np.searchsorted(run.t_soft_s - run.presses[0].start_s, moments, "right") - 1
    return [
        Result(row["ratio"] / truth - 1, row["standard_error"] / truth)
        if row["touch"] > 0
        else LOST
        for row, truth in zip(rows[last], run.true_ratio[last], strict=True)
    ]


def coverage_of(results: Iterable[Result]) -> tuple[float, int]:
    """Return the share of nominal 95 % intervals without a flag that hold the truth, and their number."""
    known = [r for r in results if not r.flags and math.isfinite(r.standard_error)]
    return (float(np.mean([r.covers for r in known])) if known else math.nan), len(known)


def spline_ratio(run: Simulation, *, after: bool) -> float:
    """Return the ratio of one press, offline: least squares on a cubic spline through all readings of the soft channel.

    It knows when the press begins and ends. `after`: the baseline is a line between before and after the press.
    """
    from scipy.interpolate import CubicSpline

    press = run.presses[0]
    channels = []
    for times, values in ((run.t_hard_s, run.hard), (run.t_soft_s, run.soft)):
        known = np.isfinite(values)
        t = times[known]
        c = values[known]
        before = t < press.start_s
        behind = t > press.stop_s
        base = np.full(len(t), c[before].mean())
        if after:
            ends = [[part.mean() for part in (t[side], c[side])] for side in (before, behind)]
            base = np.interp(t, *np.transpose(ends))
        channels.append((t, c - base))
    (t, hard), soft = channels
    inside = (t >= press.start_s) & (t <= press.stop_s)
    regressor = CubicSpline(*soft)(t[inside])
    return float(hard[inside] @ regressor / (regressor @ regressor))
