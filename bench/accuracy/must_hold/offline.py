"""Replay beside the best offline method: a spline of the soft channel and least squares."""

from collections.abc import Iterator
from math import inf

import numpy as np
from palpate.simulation import Scenario
from palpate.simulation.scenarios import SCENARIOS

from bench.accuracy.must_hold.presses import held, recordings, result, rms_row
from bench.accuracy.must_hold.row import Row
from bench.peers import spline_ratio

TIMES = 1.1
ONE_MEMORY = (
    "soft-steady",
    "stiff-steady",
    "near-rigid",
    "tremor",
    "strong-tremor",
    "light-touch",
    "spikes",
    "dropouts",
)
"""Named scenarios of one press with a constant ratio, which the readings follow."""


def rows(seeds: int) -> Iterator[Row]:
    """Return the rows of this theme."""
    scenes = {name: SCENARIOS[name] for name in ONE_MEMORY}
    scenes |= {f"lines, tremor {100 * tremor:g} %": held(tremor) for tremor in (0.0, 0.05, 0.08, 0.12)}
    for name, scene in scenes.items():
        yield compared(name, scene, seeds)


def compared(name: str, scene: Scenario, seeds: int) -> Row:
    """Return the row of one scenario: error of the touch over that of the rival with the better baseline."""
    runs = list(recordings(scene, range(seeds)))
    ours = rms_row(name, [result(run) for run in runs], inf)
    truth = [run.presses[0].ratios[-1][1] for run in runs]
    rivals = [
        100
        * np.sqrt(np.mean([(spline_ratio(run, after=after) / r - 1) ** 2 for run, r in zip(runs, truth, strict=True)]))
        for after in (False, True)
    ]
    beside = f"{ours.value:.2g} %; spline {rivals[0]:.2g} %, with the baseline after the release {rivals[1]:.2g} %"
    times, covered = ours.value / min(rivals), {"coverage": ours.coverage, "intervals": ours.intervals}
    return Row(f"error / offline spline's, {name}", times, TIMES, "", beside=beside, **covered)
