"""Healthy touches of all kinds: their flags, their 95 % intervals, and whether each has a standard error."""

import math
from collections.abc import Iterator

import numpy as np
import palpate
from palpate.ad7746.datasheet import NOISE_PF
from palpate.simulation import Simulation
from palpate.simulation.faults import Faults

from bench.accuracy.must_hold.physics import flags
from bench.accuracy.must_hold.presses import coverage_of, held, recordings, result
from bench.accuracy.must_hold.row import Row, between

TOUCHES = 10  # for each seed
FULL_PAIRS, FEWEST_PAIRS = 40, 3


def rows(seeds: int) -> Iterator[Row]:
    """Return the rows of this theme."""
    found = [result(healthy(seed)) for seed in range(TOUCHES * seeds)]
    flagged = 100 * float(np.mean([bool(r.flags) for r in found]))
    coverage, count = coverage_of(found)
    yield Row(f"flags on {len(found)} healthy touches", flagged, 0.5, beside=f"flags: {flags(found)}")
    yield from between(
        f"95 % intervals, {count} healthy touches of {FULL_PAIRS} pairs and more: hold", coverage, 92, 99
    )
    lengths = [(touch.samples, touch.standard_error) for seed in range(seeds) for touch in palpate.touches(brief(seed))]
    without = [not math.isfinite(error) for samples, error in lengths if samples >= FEWEST_PAIRS]
    name = f"touches of {FEWEST_PAIRS} to {max(lengths)[0]} pairs without a standard error"
    yield Row(name, 100 * float(np.mean(without)), 0.0, beside=f"of {len(without)}")


def healthy(seed: int) -> Simulation:
    """Return a press that follows C1 = r C2: 2 fF to 0.25 pF, 1.1 to 6.6 s, with tremor, hum, spikes and losses."""
    draw = np.random.default_rng([seed, 7])
    depth = 2e-3 * 125 ** draw.uniform()
    faults = Faults(
        pickup_pF=1e-3 * draw.integers(2) * draw.uniform(),
        spikes_per_s=0.5 * draw.integers(2),
        spike_pF=100 * NOISE_PF[0],
        lost=0.05 * draw.integers(2),
    )
    scene = held(draw.uniform(0, 0.12), press={"depth_pF": depth, "hold_s": draw.uniform(0.6, 6.05)}, faults=faults)
    [run] = recordings(scene, [seed])
    return run


def brief(seed: int) -> Simulation:
    """Return a press of 0.1 to 1 s."""
    press = {"rise_s": 0.05, "hold_s": np.random.default_rng([seed, 8]).uniform(0.001, 0.9), "fall_s": 0.05}
    [run] = recordings(held(duration_s=4.5, press=press), [seed])
    return run
