"""Replay beside the best offline method: a spline of the soft channel and least squares."""

import math
from collections.abc import Iterator
from math import inf

import numpy as np
from palpate.simulation import Simulation, simulate
from palpate.simulation.scenarios import SCENARIOS

from bench.accuracy.must_hold.presses import held, recordings, result, rms_row
from bench.accuracy.must_hold.row import Row
from bench.peers import spline_ratio

TIMES = 1.1
ONE_MEMORY = ("soft-steady", "stiff-steady", "near-rigid", "tremor", "strong-tremor", "light-touch", "spikes", "dropouts",
              "tremor-lines", "bursts", "pickup", "lost-10", "lost-runs", "coarse-codes", "jitter", "host-stamps", "skew",
              "slow-converter", "fast-converter", "together")  # fmt: skip
"""Named scenarios of one press with a constant ratio, which the readings follow."""


def rows(seeds: int) -> Iterator[Row]:
    """Return the rows of this theme."""
    for name in ONE_MEMORY:
        runs = [simulate(SCENARIOS[name], seed) for seed in range(seeds)]
        yield compared(name, runs, host_stamps=SCENARIOS[name].stamps.host_s > 0)
    for tremor in (0.0, 0.05, 0.08, 0.12):
        yield compared(f"lines, tremor {100 * tremor:g} %", list(recordings(held(tremor), range(seeds))))


def compared(name: str, runs: list[Simulation], *, host_stamps: bool = False) -> Row:
    """Return the row of one scenario: error of the touch over that of the rival with the better baseline."""
    ours = rms_row(name, [result(run, host_stamps=host_stamps) for run in runs], inf)
    truth = np.array([run.presses[0].ratios[-1][1] for run in runs])
    before, both = (
        100 * math.sqrt(np.mean((np.array([spline_ratio(run, after=after) for run in runs]) / truth - 1) ** 2))
        for after in (False, True)
    )
    beside = f"{ours.value:.2g} %; spline {before:.2g} %, with the baseline after the release {both:.2g} %"
    times, name = ours.value / min(before, both), f"error / offline spline's, {name}"
    return Row(name, times, TIMES, "", coverage=ours.coverage, intervals=ours.intervals, beside=beside)
