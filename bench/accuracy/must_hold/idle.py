"""The probe without contact: drift in both channels, and what a tap leaves behind."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import palpate
from palpate.simulation import Press, Scenario

from bench.accuracy.must_hold.presses import DEPTH_PF, RATIO, START_S, held, recordings
from bench.accuracy.must_hold.row import Row

DRIFTS_FF = (0.03, 0.1, 0.3)
STARTS_S = (2.0, 12.0, 22.0)


def rows(seeds: int) -> Iterator[Row]:
    """Return the rows of this theme."""
    yield drifting(seeds)
    yield tap(seeds)


def drifting(seeds: int) -> Row:
    """Return the row of a drift in both channels from the start: touches lost and invented."""
    lost = invented = 0
    for seed in range(seeds):
        draw = np.random.default_rng([seed, 5])
        baselines = tuple(
            replace(baseline, drift_pF_per_s=1e-3 * draw.choice(DRIFTS_FF) * draw.choice([-1, 1]))
            for baseline in Scenario().baselines
        )
        scene = held(duration_s=32.0, baselines=baselines)
        presses = [Press(start, [(0.0, RATIO)], depth_pF=DEPTH_PF) for start in STARTS_S]
        [run] = recordings(replace(scene, presses=presses), [seed])
        starts = [touch.start_s for touch in palpate.touches(run)]
        true = [any(abs(start - press.start_s) < 0.2 for start in starts) for press in run.presses]
        lost += len(true) - sum(true)
        invented += len(starts) - sum(true)
    name = f"drift up to .3 fF/s in both, {3 * seeds} presses: touches lost or invented"
    return Row(name, lost + invented, 0.0, "touches", beside=f"{lost} lost, {invented} invented")


def tap(seeds: int) -> Row:
    """Return the row of a tap of 5 pairs and 18 s of nothing: the largest number of touches."""
    counts = []
    for seed in range(seeds):
        depth = 1e-3 * 0.05 * 20 ** np.random.default_rng([seed, 6]).uniform()
        press = {"depth_pF": depth, "rise_s": 0.03, "hold_s": 0.07, "fall_s": 0.03}
        [run] = recordings(held(duration_s=START_S + 18.13, press=press), [seed])
        counts.append(len(palpate.touches(run)))
    beside = f"mean {np.mean(counts):.2g}"
    return Row("a tap of 5 pairs of 0.05-1 fF, then 18 s of nothing, most", max(counts), 2, "touches", beside=beside)
