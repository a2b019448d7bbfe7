"""Offline estimation, and plain replay, beside the best rival: a spline of the soft channel and least squares."""

import math
from collections.abc import Iterator
from math import inf

import numpy as np
import palpate
from palpate.simulation import Simulation, simulate
from palpate.simulation.scenarios import SCENARIOS

from bench.accuracy.must_hold.presses import LOST, Result, held, longest, recordings, result, rms_row
from bench.accuracy.must_hold.row import Row
from bench.peers import spline_ratio

TIMES = 1.1
ONE_MEMORY = ("soft-steady", "stiff-steady", "near-rigid", "tremor", "strong-tremor", "light-touch", "spikes", "dropouts",
              "tremor-lines", "bursts", "pickup", "lost-10", "lost-runs", "coarse-codes", "jitter", "host-stamps", "skew",
              "slow-converter", "fast-converter", "together")  # fmt: skip
"""Named scenarios of one press with a constant ratio, which the readings follow."""
REASONS = {
    "bursts": "In a few recordings a burst hides the press, or the result is refused with its reason: each is an error of "
    "100 %. The spline knows the press.",
}
"""Scenario -> why the limit is not kept."""


def rows(seeds: int) -> Iterator[Row]:
    """Return the rows of this theme."""
    for name in ONE_MEMORY:
        runs = [simulate(SCENARIOS[name], seed) for seed in range(seeds)]
        yield compared(name, runs, host_stamps=SCENARIOS[name].stamps.host_s > 0)
    for tremor in (0.0, 0.05, 0.08, 0.12):
        yield compared(f"lines, tremor {100 * tremor:g} %", list(recordings(held(tremor), range(seeds))))


def compared(name: str, runs: list[Simulation], *, host_stamps: bool = False) -> Row:
    """Return the row of one scenario: error of the offline result over that of the rival with the better baseline."""
    offline = rms_row(name, [afterwards(run, host_stamps=host_stamps) for run in runs], inf)
    plain = rms_row(name, [result(run, host_stamps=host_stamps) for run in runs], inf)
    truth = np.array([run.presses[0].ratios[-1][1] for run in runs])
    before, both = (
        100 * math.sqrt(np.mean((np.array([spline_ratio(run, after=after) for run in runs]) / truth - 1) ** 2))
        for after in (False, True)
    )
    best = min(before, both)
    beside = (
        f"offline {offline.value:.2g} %; replay {plain.value:.2g} %, {plain.value / best:.2g} times; "
        f"spline {before:.2g} %, with the baseline after the release {both:.2g} %"
    )
    return Row(
        f"error / spline's, {name}",
        offline.value / best,
        TIMES,
        "",
        coverage=offline.coverage,
        intervals=offline.intervals,
        beside=beside,
        reason=REASONS.get(name, ""),
    )


def afterwards(run: Simulation, *, host_stamps: bool) -> Result:
    """Return the offline result of the first press."""
    touch = longest(palpate.offline(run, host_stamps=host_stamps), run, lambda touch: touch.live)
    if touch is None or math.isnan(touch.ratio):
        return LOST
    truth = run.presses[0].ratios[-1][1]
    return Result(touch.ratio / truth - 1, touch.standard_error / truth, frozenset(touch.flags) - {"short"})
