"""False alarms in touches: their interval, compared with the one that the threshold was designed for."""

from collections.abc import Iterator

import numpy as np
import palpate
from palpate.ad7746.datasheet import NOISE_PF
from palpate.design import cusum

from bench.accuracy.must_hold.presses import DEPTH_PF, PAIR_S, RATIO
from bench.accuracy.must_hold.row import Row

TOUCHES = 150  # for each seed
AT_ONCE = 500  # touches of one tracker
FIRST = 64
SAMPLES = 250  # of a touch, for the estimator alone
IDLE, RISE, HOLD, FALL = 60, 12, 256, 10  # pairs
DESIGNED = (5e3, 25e3)


def rows(seeds: int) -> Iterator[Row]:
    """Return the rows of this theme."""
    count = TOUCHES * seeds
    for designed in DESIGNED:
        threshold = cusum(false_alarm_interval=designed, smallest_shift=1.5).threshold
        for name, watch in (("estimator", estimated), ("scene", tracked)):
            parts = [watch(threshold, min(AT_ONCE, count - first), first) for first in range(0, count, AT_ONCE)]
            for text, (samples, alarms) in zip((f"first {FIRST}", "later"), np.sum(parts, axis=0), strict=True):
                interval = samples / max(alarms, 1) / designed
                beside = f"{alarms} alarms in {samples:,} samples"
                title = f"false-alarm interval / designed {designed:,.0f}, {name}, {text} samples"
                yield Row(title, interval, 0.5, "", at_least=True, beside=beside)


def estimated(threshold: float, touches: int, seed: int) -> list[tuple[int, int]]:
    """Return samples and alarms in the first samples of touches, and later: a steady level, white noise, no scene."""
    random, estimator = np.random.default_rng(seed), palpate.HandoverRls(threshold=threshold)
    alarms = np.zeros(SAMPLES, int)
    for _ in range(touches):
        noise = NOISE_PF[0] * random.standard_normal((2, SAMPLES))
        estimator.reset()
        alarms += estimator.trace(RATIO * DEPTH_PF + noise[0], DEPTH_PF + noise[1])["alarm"]
    return [(touches * len(part), int(part.sum())) for part in (alarms[:FIRST], alarms[FIRST:])]


def tracked(threshold: float, touches: int, seed: int) -> list[tuple[int, int]]:
    """Return the same for whole touches, with their rise, in the scene handheld."""
    rise = 0.5 * (1 - np.cos(np.pi * np.arange(2 * RISE) / (2 * RISE)))
    fall = rise[:: -RISE // FALL][: 2 * FALL]
    press = DEPTH_PF * np.concatenate([np.zeros(2 * IDLE), rise, np.ones(2 * HOLD), fall])
    force = np.tile(press, touches)
    readings = force + NOISE_PF[0] * np.random.default_rng(seed).standard_normal(len(force))
    readings[0::2] += (RATIO - 1) * force[0::2]
    times = PAIR_S / 2 * np.arange(len(force))
    rows = palpate.Tracker("handheld", threshold=threshold).process(
        times[0::2], times[1::2], readings[0::2], readings[1::2]
    )
    inside = rows[rows["touch"] > 0]
    begins = np.flatnonzero(np.diff(inside["touch"], prepend=0))
    since = np.arange(len(inside)) - np.repeat(begins, np.diff(begins, append=len(inside)))
    parts = [inside["alarm"][since < FIRST], inside["alarm"][since >= FIRST]]
    return [(len(part), int(part.sum())) for part in parts]
