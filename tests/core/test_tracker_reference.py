"""Whole touches: the scenes "handheld" and "sliding" against their references, with all that a hand, a probe and a converter do."""

from typing import Any

import numpy as np
import palpate
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from palpate import reference
from palpate.reference.align import means
from palpate.simulation import (
    SCENARIOS,
    BaselineModel,
    Bumps,
    ConverterModel,
    Faults,
    Gauge,
    Press,
    Scenario,
    Stamps,
    Tilt,
    simulate,
)

MISFITS = {
    "offset",
    "drift",
    "lag",
    "curve",
    "tilt",
    "changed",
    "creep",
    "baseline",
    "step",
    "jumped",
}
NUMBERS = (
    *(
        "ratio",
        "standard_error",
        "first_ratio",
        "first_standard_error",
        "covariance",
        "offset_ratio",
    ),
    *(
        "level_ratio",
        "level_standard_error",
        "depth_pF",
        "rise_s",
        "ratio_before",
        "before_standard_error",
        "ratio_after",
        "after_standard_error",
    ),
)
EFFECTS = ("offset", "drift", "curve", "tilt", "shift")


def readings_of(
    scenario: Scenario, seed: int, scale: float = 1.0, *, soft_first: bool = False
) -> tuple[NDArray[Any], ...]:
    """Return times, ns, and values, pF, of both channels."""
    run = simulate(scenario, seed)
    t_hard, t_soft = (np.rint(1e9 * t).astype(np.int64) for t in (run.t_hard_s, run.t_soft_s))
    hard, soft = (  # a saturated reading is a missing one
        scale * np.where(np.abs(values) < run.full_scale_pF, values, np.inf)
        for values in (run.hard, run.soft)
    )
    if soft_first:
        return (t_hard[1:], t_soft[:-1], hard[1:], soft[:-1])
    return (t_hard, t_soft, hard, soft)


@st.composite
def presses(draw: st.DrawFn) -> list[Press]:
    """Draw up to three presses: short and long ones, near each other, with steps of the ratio, deep and light."""
    made = []
    start = draw(st.floats(1.0, 2.0))
    for _ in range(draw(st.sampled_from([1, 2, 3, 0]))):
        ratios = [(0.0, draw(st.sampled_from([1.1, 2.8, 8.0])))]
        if draw(st.booleans()):
            ratios.append(
                (draw(st.floats(0.5, 4.0)), ratios[0][1] * draw(st.sampled_from([0.7, 1.01, 1.3])))
            )
        press = Press(
            start,
            ratios,
            depth_pF=draw(st.sampled_from([0.25, 0.25, 0.02, 5e-4, 1.0])),
            rise_s=draw(st.sampled_from([0.03, 0.3])),
            hold_s=draw(st.sampled_from([2.0, 7.0, 0.6, 0.07])),
            creep=draw(st.sampled_from([0.0, 0.3, -0.1])),
            relaxes=draw(st.sampled_from([0.0, 0.0, 0.1])),
        )
        made.append(press)
        start = press.stop_s + draw(st.sampled_from([0.1, 0.5, 1.5]))
    return made


drifts = st.sampled_from([0.0, 0.0, 3e-4, -1e-4])
baselines = st.builds(
    BaselineModel,
    level_pF=st.sampled_from([0.62, -0.41, 3.9]),
    drift_pF_per_s=drifts,
    wander_pF=st.sampled_from([0.0, 0.0, 3e-4]),
    jump_pF=st.sampled_from([0.0, 0.0, 2e-3, -0.2]),
    jump_s=st.floats(0.0, 8.0),
)
gauges = st.builds(
    Gauge,
    quadratic_per_pF=st.sampled_from([0.0, 0.005, 0.4]),
    creep=st.sampled_from([0.0, 0.0, 0.05]),
    lag_s=st.sampled_from([0.0, 0.0, 0.05]),
)
scenarios = st.builds(
    Scenario,
    presses=presses(),
    duration_s=st.sampled_from([14.0, 10.0]) | st.floats(3.0, 16.0),
    tremor=st.sampled_from([0.0, 0.01, 0.08]),
    tilt=st.builds(Tilt, ramp_per_s=st.sampled_from([0.0, 0.0, 0.02])),
    bumps=st.builds(Bumps, offset=st.sampled_from([0.0, 0.0, 0.02, -0.05])),
    gauges=st.tuples(gauges, gauges),
    baselines=st.tuples(baselines, baselines),
    converter=st.builds(
        ConverterModel,
        bus_s=st.sampled_from([0.002, 0.002, 0.0048, 0.012]),
        jitter_s=st.sampled_from([0.0002, 0.0, 0.001]),
        together=st.sampled_from([False, False, True]),
    )
    | st.builds(  # 100 to 500 pairs a second
        ConverterModel,
        conversion_s=st.sampled_from([0.0005, 0.003]),
        bus_s=st.sampled_from([0.0005, 0.002]),
        jitter_s=st.sampled_from([0.0002, 0.0, 0.001]),
        together=st.booleans(),
    )
    | st.builds(  # 2 to 25 pairs a second
        ConverterModel,
        capf=st.integers(2, 7),
        bus_s=st.sampled_from([0.0, 0.002, 0.02, 0.1, 0.14]),
        jitter_s=st.sampled_from([0.0002, 0.0, 0.001]),
        together=st.sampled_from([False, False, True]),
    ),
    stamps=st.builds(
        Stamps, host_s=st.sampled_from([0.0, 0.0, 0.003]), skew_s=st.sampled_from([0.0, 0.0, 0.003])
    ),
    faults=st.builds(
        Faults,
        lost=st.sampled_from([0.0, 0.02, 0.2]),
        lost_run=st.sampled_from([0.0, 0.0, 5.0]),
        spikes_per_s=st.sampled_from([0.0, 0.0, 0.5]),
        spike_pF=st.sampled_from([4e-3, 1.0]),
        bursts_per_s=st.sampled_from([0.0, 0.0, 0.3]),
    ),
)
recordings = st.builds(
    readings_of,
    scenario=scenarios,
    seed=st.integers(0, 2**31),
    scale=st.sampled_from([1.0, 1.0, 1e-2, 1e3]),
    soft_first=st.booleans(),
)


def numbers_of(touch: palpate.Touch) -> dict[str, float]:
    return {name: getattr(touch, name) for name in NUMBERS} | {
        name: touch.effects[name] for name in EFFECTS
    }


def numbers_by_reference(touch: reference.Touch) -> dict[str, float]:
    shift = touch.revision.shift / touch.first_ratio if touch.revision else 0.0
    own = {"offset_ratio": touch.misfit.offset_ratio} | dict(
        zip(NUMBERS[-4:], touch.before + touch.after, strict=True)
    )
    found = {name: own[name] if name in own else getattr(touch, name) for name in NUMBERS}
    effects = {name: getattr(touch.misfit, name) for name in EFFECTS[:3]}
    return found | effects | {"tilt": touch.tilt, "shift": shift}


def flags_by_reference(touch: reference.Touch) -> set[str]:
    revision = (MISFITS & {touch.revision.kind} if touch.revision else set()) - {"drift"}
    if touch.level_flag:
        return revision | {touch.level_flag}
    found = set(touch.misfit.flags) | revision
    return found | (
        {"tilt"} if touch.tilted and not found & {"offset", "drift", "lag", "curve"} else set()
    )


def rounding(soft: NDArray[Any], rows: NDArray[Any], largest: float) -> float:
    """Return what rounding does to a ratio, relative: some hundred eps of the readings, against the change of the soft one.

    A factor of a thousand is left for samples that cancel each other, in a touch of one channel alone or of noise.
    """
    change = np.abs(soft - rows["soft_baseline"])
    change = np.median(change[np.isfinite(change)])
    return float(1e-9 + 1e5 * np.finfo(float).eps * largest / change)


@examples(40)
@given(recordings, st.sampled_from([{}, {"contact_exponent": 1.5}, {"age": 1.0}]))
def test_the_tracker_is_the_reference(readings: tuple[NDArray[Any], ...], settings: Any) -> None:
    check(readings, settings)


@examples(40)
@given(recordings)
def test_a_tracker_that_slides_is_the_reference(readings: tuple[NDArray[Any], ...]) -> None:
    check(readings, scene="sliding")


@pytest.mark.parametrize("name", SCENARIOS)
def test_the_named_scenarios_are_as_by_the_reference(name: str) -> None:
    """In the second of lost-runs the last value of a baseline comes alone."""
    for seed in (1, 2):
        check(readings_of(SCENARIOS[name], seed))
    assert check(readings_of(SCENARIOS[name], 1), scene="sliding")


@pytest.mark.parametrize("steps_ms", [[4.6, 5.5, 4.8], [0.5] * 9 + [40.0], [1.0] * 30 + [300.0]])
def test_the_means_of_a_fast_converter_lose_no_reading(steps_ms: list[float]) -> None:
    """At the limit of what is fast, and in packets."""
    n = 3000
    rng = np.random.default_rng(1)
    t = np.cumsum(1e6 * np.resize(steps_ms, n)).astype(np.int64)
    soft = 0.25 * ((t > 0.4 * t[-1]) & (t < 0.8 * t[-1])) + rng.normal(0, 4e-5, n)
    readings = t, t, 0.6 + 2.8 * soft + rng.normal(0, 4e-5, n), soft
    assert n - 25 <= sum(mean.size for mean in means(*readings)) <= n
    check(readings)


@pytest.mark.parametrize("scene", ["handheld", "sliding"])
@given(
    name=st.sampled_from(
        ["tremor", "jump", "spikes", "thermal", "step-up", "fast-converter", "lost-10"]
    ),
    seed=st.integers(0, 99),
    falls=st.booleans(),
    cut_s=st.floats(0, 4),
)
@examples(10)
def test_a_given_baseline_and_falling_channels(
    *, scene: Any, name: str, seed: int, falls: bool, cut_s: float
) -> None:
    """Also from within the press on."""
    t_hard, t_soft, hard, soft = readings_of(SCENARIOS[name], seed)
    kept = t_hard >= t_hard[0] + 1e9 * cut_s
    sign = -1.0 if falls else 1.0
    readings = t_hard[kept], t_soft[kept], sign * hard[kept], sign * soft[kept]
    levels = sign * float(np.median(hard[:40])), sign * float(np.median(soft[:40]))
    check(readings, {"baseline": levels, "falling": falls}, scene)
    check(readings, {"baseline": (*levels, 4e-5, 5e-5), "falling": falls}, scene)
    changes = readings[2] - levels[0], readings[3] - levels[1]
    check((*readings[:2], *changes), {"baseline": "zero", "falling": falls}, scene)


REFERENCES = {"handheld": reference.handheld, "sliding": reference.sliding}
# Rounding errors of some 1,000 samples, about a ratio whose noise is 1e-4 of it: 1e3 * 1e4 * eps.
UNDECIDED = 1e7 * np.finfo(float).eps


def check(
    readings: tuple[NDArray[Any], ...], settings: Any = None, scene: Any = "handheld"
) -> bool:
    """Compare: every decision is the same; numbers differ by rounding, and those of the fit by what its sums make of it.

    False: rounding may decide another way.
    """
    tracker = palpate.Tracker(scene, **(settings or {}))
    rows = tracker.process(*readings)
    tracker.finish()
    touches, right = REFERENCES[scene](*readings, **(settings or {}))
    if any(touch.margin < UNDECIDED for touch in touches):
        return False
    for name in ("alarm", "contact", "revised"):
        assert np.array_equal(rows[name], getattr(right, name)), name
    assert len(tracker.touches) == len(touches)
    largest = max(float(np.abs(values[np.isfinite(values)]).max()) for values in readings[2:])
    for number, (touch, expected) in enumerate(zip(tracker.touches, touches, strict=True), 1):
        assert (touch.start, touch.samples, touch.refused) == (
            expected.start,
            expected.samples,
            expected.refused,
        )
        assert ("short" in touch.flags) == (not expected.full and scene == "handheld")
        assert MISFITS & set(touch.flags) == flags_by_reference(expected)
        assert touch.revised == (expected.revision is not None)
        inside = rows["touch"] == number
        allowed = rounding(readings[3][inside], rows[inside], largest)
        for name, more in (("ratio", 1), ("standard_error", 100), ("statistic", 100)):
            found = rows[name][inside]
            wanted = getattr(right, name)[inside]
            size = np.nanmax(np.abs(wanted), initial=1.0) if name != "standard_error" else 0.0
            assert np.allclose(
                found, wanted, rtol=more * allowed, atol=more * allowed * size, equal_nan=True
            ), name
        found_numbers = numbers_of(touch)
        wanted_numbers = numbers_by_reference(expected)
        assert found_numbers == pytest.approx(
            wanted_numbers, rel=1e3 * allowed, abs=1e3 * allowed, nan_ok=True
        )
    return True
