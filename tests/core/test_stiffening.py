"""Objects that stiffen with depth: the fit against its reference, its rates, and the flag."""

import math
import re
from dataclasses import replace
from functools import reduce
from operator import add
from typing import Any

import numpy as np
import palpate
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from palpate.elasticity import Elasticity
from palpate.flags import Flag
from palpate.reference import stiffening as reference
from palpate.simulation import scenarios, simulate
from palpate.simulation.mechanics import Gauge
from palpate.touch_readings.stiffening import stiffening
from palpate.touch_readings.stiffening_watch import StiffeningWatch
from palpate.touch_readings.sweep import Sweep
from palpate.tracking import tracker_of

from bench.accuracy.other_probe import Recorded, Way, touch

PROBE = Elasticity()
HAND = Way(angle=0.5, trembling=0.03, creep=(0.03, 0.03), bend=0.005)
THIN = replace(HAND, layer=0.2)


def drawn(way: Way, seed: int, low_MPa: float, high_MPa: float) -> Recorded:
    """Return a touch on an object of random modulus, with a random angle, depth and course."""
    random = np.random.default_rng((seed, 49))
    modulus = math.exp(random.uniform(math.log(low_MPa), math.log(high_MPa)))
    pressed = replace(
        way,
        ratio=PROBE.ratio(modulus),
        exponent=float(random.choice([1.0, 1.25, 1.5])),
        angle=way.angle * random.standard_normal(),
        total=random.uniform(0.5, 1.5),
        rise=random.uniform(0.15, 0.5),
        hold=random.uniform(1.5, 6.5),
    )
    return touch(pressed, seed)


def flagged(way: Way, count: int, low_MPa: float, high_MPa: float) -> int:
    """Return how many touches of objects with these moduli have the flag."""
    found = [palpate.touches(drawn(way, seed, low_MPa, high_MPa)) for seed in range(count)]
    assert all(len(touches) == 1 for touches in found)
    return sum(Flag.STIFFENS in touches[0].flags for touches in found)


@given(
    pairs=st.tuples(st.integers(2, 16), st.integers(5, 60), st.integers(0, 16)),
    change=st.floats(-0.1, 0.3),
    tilt=st.floats(-0.03, 0.2),
    seed=st.integers(0, 2**20),
    noise=st.sampled_from([0.0, 1e-4, 3e-3]),
    spike=st.booleans(),
)
def test_the_fit_is_that_of_the_reference(
    pairs: tuple[int, int, int], change: float, tilt: float, seed: int, noise: float, spike: bool
) -> None:
    random = np.random.default_rng(seed)
    rising, held, falling = pairs
    depth = np.concatenate(
        [np.linspace(0.15, 1, rising), np.ones(held), np.linspace(1, 0.15, falling)]
    )
    depth *= 1 + 0.02 * random.standard_normal(len(depth))
    row = np.arange(len(depth))
    soft = 0.2 * depth**1.25
    hard = 0.6 * (depth + tilt) ** 1.25 * np.exp(change * depth**2)
    hard *= np.exp(noise * random.standard_normal(len(depth)))
    if spike:
        hard[rising + 2] *= 1.2
    parts = row < rising, (row >= rising) & (row < rising + held), row >= rising + held
    columns = np.asarray(0.026 * row, float), hard, soft
    found = stiffening(Sweep(*columns, np.zeros(len(row)), *parts))
    expected = reference.stiffening(*columns, *parts)
    assert (found is None) == (expected is None)
    if found is not None and expected is not None:
        # Both end where a step is below 1e-8; the derivatives of the reference are exact to 1e-8 of
        # themselves, which changes the error by as much.
        assert [found.change, found.standard_error] == pytest.approx(expected, rel=1e-6, abs=1e-7)


def test_thin_objects_have_the_flag() -> None:
    for law in (1.0, 2.0, 3.0):
        # 81, 99 and 99 % of 500 others
        assert flagged(replace(THIN, law=law), 20, 0.2, 0.6) >= 16


@pytest.mark.parametrize(
    "way",
    [
        HAND,
        replace(HAND, angle=0.0, trembling=0.0, tremor=0.003),
        replace(HAND, angle=1.5),
        replace(HAND, object_creep=0.03, bend=-0.005),
        replace(HAND, creep=(0.0, 0.0), noise=150e-6),
        replace(HAND, lifted_angle=0.5, settling=0.3, in_phase=0.02),
    ],
    ids=["hand", "stage", "oblique", "object creeps", "noisy", "rolls off"],
)
def test_thick_objects_do_not_have_it(way: Way) -> None:
    # none of 500 others each
    assert flagged(way, 20, 0.15, 6.0) == 0


def test_the_size_is_that_of_the_ratio_from_zero_to_full_depth() -> None:
    level = replace(THIN, angle=0.0, trembling=0.0, creep=(0.0, 0.0), bend=0.0)
    [found] = palpate.touches(touch(level, 3))
    [thick] = palpate.touches(touch(replace(level, layer=0.0), 3))
    # u^2 is the law of the object, but not that of springs in series: a quarter
    grown = found.ratio / thick.ratio - 1
    assert found.effects["stiffening"] == pytest.approx(grown, rel=0.25)
    assert "stiffening" not in thick.effects
    [advice] = [each for each in palpate.advice(found) if each.flag is Flag.STIFFENS]
    [size] = re.findall(r"grows by ([\d.]+) %", advice.text)
    # two digits
    assert float(size) / 100 == pytest.approx(found.effects["stiffening"], rel=0.05)
    assert "only an upper bound" in advice.text
    assert not Flag.STIFFENS.meaning.excludes(found)


def recording() -> Recorded:
    return reduce(add, (drawn(THIN, seed, 0.2, 0.6) for seed in (1, 2, 3)))


def watched(run: Recorded, block: int, *, in_ns: bool = False) -> list[palpate.Touch]:
    """Return the touches of a recording that is fed in blocks."""
    watch = StiffeningWatch(tracker_of(run, "handheld", {}))
    times: list[NDArray[np.number[Any]]] = [run.t_hard_s, run.t_soft_s]
    if in_ns:
        times = [np.rint(t * 1e9).astype(np.int64) for t in times]
    for begin in range(0, len(run.hard), block):
        part = slice(begin, begin + block)
        t_hard, t_soft = (t[part] for t in times)
        watch.process(t_hard, t_soft, run.hard[part], run.soft[part])
    watch.finish()
    return watch.touches


def test_blocks_do_not_change_the_result() -> None:
    run = recording()
    expected = palpate.touches(run)
    assert all(Flag.STIFFENS in each.flags for each in expected)
    for block in (1, 7, 32, 1000):
        assert watched(run, block) == expected
    sizes = [each.effects["stiffening"] for each in watched(run, 32, in_ns=True)]
    assert sizes == pytest.approx([each.effects["stiffening"] for each in expected], abs=1e-5)


def test_a_stream_has_the_flag_at_the_end_of_a_touch() -> None:
    run = recording()
    watch = StiffeningWatch(tracker_of(run, "handheld", {}))
    ended = 0
    for row in range(len(run.hard)):
        part = slice(row, row + 1)
        watch.process(run.t_hard_s[part], run.t_soft_s[part], run.hard[part], run.soft[part])
        for each in watch.touches_since(ended):
            assert not each.revised
            assert Flag.STIFFENS in each.flags
            ended += 1
    assert ended == 3


def test_the_offline_result_has_its_own_size() -> None:
    run = recording()
    found = palpate.offline(run)
    assert [each.live for each in found] == palpate.touches(run)
    for each in found:
        assert each.stiffening is not None
        assert each.stiffening.is_significant
        error = 2 * each.stiffening.standard_error
        assert each.stiffening.share == pytest.approx(each.live.effects["stiffening"], abs=error)
        assert each.as_dict()["stiffening"]["change"] == each.stiffening.change


def test_a_cut_touch_a_window_and_a_given_baseline_have_it() -> None:
    run = recording()
    cut = run.t_hard_s < 3.0
    columns = run.t_hard_s[cut], run.t_soft_s[cut], run.hard[cut], run.soft[cut]
    [touched] = palpate.touches(Recorded(*columns, ()))
    assert Flag.STIFFENS in touched.flags
    begin_s = run.contacts[1]
    [touched] = palpate.touches(run, windows=[(begin_s - 0.1, begin_s + 1.4)])
    assert Flag.STIFFENS in touched.flags
    still = run.t_hard_s < 1.5
    levels = float(run.hard[still].mean()), float(run.soft[still].mean())
    touched = palpate.touches(run, baseline=levels)[0]
    assert Flag.STIFFENS in touched.flags


@pytest.mark.parametrize("period_s", [0.002, 0.013, 0.05])
def test_other_rates(period_s: float) -> None:
    for way, is_thin in ((THIN, True), (HAND, False)):
        pressed = replace(way, ratio=PROBE.ratio(0.3), period=period_s)
        [found] = palpate.touches(touch(pressed, 5))
        assert (Flag.STIFFENS in found.flags) is is_thin


def test_a_scene_without_a_level_ratio_does_not_test() -> None:
    run = recording()
    for scene in ("paper", "sliding"):
        assert all(Flag.STIFFENS not in each.flags for each in palpate.touches(run, scene=scene))
    found = palpate.touches(run, contact_exponent=0.0)
    assert all(Flag.STIFFENS not in each.flags for each in found)


def test_a_bent_gauge_looks_the_same() -> None:
    """The readings of both channels cannot tell them apart: the flag `curve` comes with it."""
    [found] = palpate.touches(scenarios.run("power-gauge", seed=0))
    assert {Flag.CURVE, Flag.STIFFENS} <= set(found.flags)
    [curve] = [each.text for each in palpate.advice(found) if each.flag is Flag.CURVE]
    assert curve.endswith("the object stiffens, a bump bottoms out, or a gauge is not linear")


@pytest.mark.parametrize("lag_s", [0.1, -0.05])
def test_a_late_channel_has_no_such_flag(lag_s: float) -> None:
    lag = Gauge(lag_s=abs(lag_s))
    gauges = (Gauge(), lag) if lag_s > 0 else (lag, Gauge())
    [found] = palpate.touches(simulate(replace(scenarios.EFFECTS["lag"], gauges=gauges), seed=1))
    assert Flag.LAG in found.flags
    assert Flag.STIFFENS not in found.flags
