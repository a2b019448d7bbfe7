"""The design of the CUSUM: linear equations, simulation; published run lengths: test_published_numbers.py."""

from math import erf, inf, log

import numpy as np
import palpate
import pytest
from effort import examples
from hypothesis import assume, given
from hypothesis import strategies as st
from palpate.design import cusum, run_length

RUNS = 10_000  # run lengths are nearly exponential: their mean is known to 1 %
CHAIN = 0.02  # of the Markov chain, as its documentation says
EPS = np.finfo(float).eps

drifts = st.floats(0.1, 1.2)
clips = st.sampled_from([2.0, 3.0, 6.0])


def by_linear_equations(drift: float, threshold: float, shift: float, clip: float) -> float:
    """Return the mean run length by the equations of Brook and Evans, (I - Q) mu = 1."""
    states = max(400, int(10 * threshold))
    width = threshold / (states - 0.5)

    def below(limit: float) -> float:
        if not -clip <= limit < clip:
            return float(limit >= clip)
        return 0.5 + 0.5 * erf((limit - shift) / 2**0.5)

    falls = [below((n + 0.5) * width + drift) for n in range(-states, states)]
    up = np.arange(states) - np.arange(states)[:, None] + states
    steps = np.diff(falls, prepend=0.0)[up]
    steps[:, 0] = np.array(falls)[up[:, 0]]
    return float(np.linalg.solve(np.eye(states) - steps, np.ones(states))[0])


def simulated(
    drift: float, threshold: float, shift: float, clip: float, *, two_sided: bool
) -> float:
    """Return the mean run length of many runs."""
    random = np.random.default_rng(5)
    alive = RUNS
    sides = np.zeros((2, RUNS))
    total = 0
    while alive:
        z = np.clip(shift + random.standard_normal(alive), -clip, clip)
        sides = np.maximum(
            0, sides + np.stack([z, -z if two_sided else np.full(alive, -np.inf)]) - drift
        )
        total += alive
        sides = sides[:, (sides <= threshold).all(axis=0)]
        alive = sides.shape[1]
    return total / RUNS


@examples(30, 300)
@given(drifts, st.floats(0.0, 45.0), st.floats(-0.5, 3.0), clips)
def test_a_run_is_as_long_as_by_linear_equations(
    drift: float, threshold: float, shift: float, clip: float
) -> None:
    """The condition of the equations is twice the run length: they lose all digits at 1e15."""
    expected = by_linear_equations(drift, threshold, shift, clip)
    assume(0 < expected < 1e11)
    found = run_length(drift, threshold, shift=shift, clip=clip)
    assert found == pytest.approx(expected, rel=1e-12 + 4 * EPS * expected)


@examples(10, 150)
@given(drifts, st.floats(0.5, 5.0), st.floats(0.0, 2.0), clips)
def test_a_run_is_as_long_as_simulated(
    drift: float, threshold: float, shift: float, clip: float
) -> None:
    expected = run_length(drift, threshold, shift=shift, clip=clip)
    assume(expected < 300)
    found = simulated(drift, threshold, shift, clip, two_sided=False)
    assert found == pytest.approx(expected, rel=5 / RUNS**0.5 + CHAIN)


@examples(8)
@given(st.floats(20, 120), st.floats(0.5, 2.5))
def test_a_design_has_its_false_alarms_and_its_delay(interval: float, shift: float) -> None:
    """Of both sides together. Sides that alarm often are not independent: below 20 samples they are fewer than twice."""
    design = cusum(false_alarm_interval=interval, smallest_shift=shift)
    between = simulated(design.drift, design.threshold, 0.0, 3.0, two_sided=True)
    assert between == pytest.approx(design.false_alarm_interval, rel=5 / RUNS**0.5 + CHAIN)
    delay = simulated(design.drift, design.threshold, shift, 3.0, two_sided=False)
    assert delay == pytest.approx(design.delay, rel=5 / RUNS**0.5 + CHAIN)


@examples(8, 60)
@given(st.floats(1.0, 11.0), st.floats(0.5, 2.5), clips)
def test_the_threshold_is_the_smallest_for_its_interval(
    digits: float, shift: float, clip: float
) -> None:
    """But for the tolerances of the bisection: 5e-4 of the interval, or 5e-5 of the threshold."""
    interval = 10**digits
    design = cusum(false_alarm_interval=interval, smallest_shift=shift, clip=clip)
    assert run_length(design.drift, design.threshold, clip=clip) / 2 >= interval
    below = run_length(design.drift, design.threshold * (1 - 1e-4), clip=clip) / 2
    assert below < interval or log(design.false_alarm_interval / interval) < 5e-4


@pytest.mark.parametrize(
    ("interval", "shift", "clip", "message"),
    [
        (5.0, 1.0, 3.0, "false_alarm_interval: got 5.0, allowed: 10 to 1e12"),
        (1e3, 7.0, 3.0, r"smallest_shift: got 7.0, allowed: .* \(4.5\)"),
        (1e9, 1e-3, 3.0, "smallest_shift: got 0.001, allowed: a larger shift"),
        (1e9, 1e-3, 3.0, "or a shorter interval than 1e[+]09 samples: threshold below 128"),
        (inf, 1.0, 3.0, "false_alarm_interval: got inf, allowed: 10 to 1e12 samples$"),
        (1e3, 1.0, 0.0, "clip: got 0.0, allowed: 1 to 100"),
    ],
)
def test_wishes_that_cannot_be(interval: float, shift: float, clip: float, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        cusum(false_alarm_interval=interval, smallest_shift=shift, clip=clip)


@pytest.mark.parametrize(
    ("kind", "share", "threshold"),
    [
        ("HandoverRls", 5.363, 11.0),
        ("HandoverRls32", 5.363, 11.0),
        ("VectorRls", 25.12, 12.0),  # for eight coefficients
    ],
)
def test_an_estimator_has_the_threshold_for_its_false_alarms(
    kind: str, share: float, threshold: float
) -> None:
    size = {"size": 2} if kind == "VectorRls" else {}

    def threshold_for(**goal: float) -> float:
        return float(getattr(palpate, kind)(**size, **goal).threshold)

    assert threshold_for() == threshold
    assert threshold_for(false_alarm_interval=1e7 + 1) == pytest.approx(threshold, rel=1e-3)
    chosen = {"false_alarm_interval": 1e4, "smallest_shift": 2.0, "clip": 2.5}
    design = cusum(**chosen | {"false_alarm_interval": share * 1e4})
    # As float32 it is rounded, by 2^-24 of it.
    assert threshold_for(**chosen) == pytest.approx(design.threshold, rel=2**-23)
    assert threshold_for(false_alarm_interval=inf) == inf


def test_each_of_three_numbers_makes_another_threshold() -> None:
    """The last design is kept for the next estimator: each change of an argument needs a new one."""
    base = {"false_alarm_interval": 1e4, "smallest_shift": 1.0, "clip": 2.5}
    other = {"false_alarm_interval": 1e5, "smallest_shift": 2.0, "clip": 5.0}
    first = palpate.HandoverRls(**base).threshold
    for name, value in other.items():
        changed = palpate.HandoverRls(**base | {name: value}).threshold
        assert abs(changed - first) > 0.1, name
        assert palpate.HandoverRls(**base).threshold == first


@pytest.mark.parametrize(("scene", "interval"), [("handheld", 1.1558e4), ("sliding", 5.363e4)])
def test_a_tracker_has_a_threshold_of_its_own(scene: str, interval: float) -> None:
    chosen = {"false_alarm_interval": 1e4, "smallest_shift": 2.0}
    tracker = palpate.Tracker(scene, **chosen)  # type: ignore[call-overload]
    design = cusum(**chosen | {"false_alarm_interval": interval})
    assert tracker.threshold == pytest.approx(design.threshold, rel=EPS)
    is_window = tracker.threshold == palpate.HandoverRls(**chosen).threshold
    assert is_window == (scene == "sliding")


def test_an_estimator_without_alarms_has_none() -> None:
    """But the same samples have one at any other interval."""
    output = np.repeat([0.5, 0.8], 200) + 1e-3 * np.random.default_rng(1).standard_normal(400)
    regressor = np.full(400, 0.25)
    for never, interval in ((True, inf), (False, 1e12)):
        estimator = palpate.HandoverRls(false_alarm_interval=interval)
        assert estimator.trace(output, regressor)["alarm"].any() != never


def test_what_is_no_threshold_is_refused() -> None:
    for wrong in (-1.0, float("nan"), inf):
        with pytest.raises(ValueError, match=r"threshold: got .*, allowed: 0 to 1000"):
            run_length(0.5, wrong)


def test_the_default_threshold_buys_what_its_page_says() -> None:
    """docs/two_signals.md: intervals, more than a spike in four pairs can add, less than five samples of a change add."""
    tracker = palpate.Tracker("handheld")
    estimator = palpate.HandoverRls()
    for detector, interval in ((tracker, 1.16e7), (estimator, 5.36e7)):
        drift = detector.settings["smallest_shift"] / 2
        clip = detector.settings["clip"]
        found = run_length(drift, detector.threshold, clip=clip) / 2
        assert found == pytest.approx(interval, rel=5e-3)
        assert 4 * (clip - drift) < detector.threshold < 5 * (clip - drift)
    assert run_length(3.0, 1.0, clip=3.0) == inf


def test_a_change_beyond_the_clip_is_found_at_its_fifth_sample() -> None:
    output = 0.5 + 1e-3 * np.random.default_rng(2).standard_normal(1000)
    output[900:] += 0.02
    alarm = palpate.HandoverRls().trace(output, np.full(1000, 0.25))["alarm"]
    assert np.flatnonzero(alarm)[0] == 904
