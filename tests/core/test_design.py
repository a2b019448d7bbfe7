"""The design of the CUSUM: Siegmund's formula, simulation; published run lengths: test_published_numbers.py."""

import numpy as np
import palpate
import pytest
from effort import examples
from hypothesis import assume, given
from hypothesis import strategies as st
from palpate.design import cusum, run_length

RUNS = 10_000  # run lengths are nearly exponential: their mean is known to 1 %
CHAIN = 0.02  # of the Markov chain, as its documentation says

drifts = st.floats(0.1, 1.2)
clips = st.sampled_from([2.0, 3.0, 6.0])


def simulated(
    drift: float, threshold: float, shift: float, clip: float, *, two_sided: bool
) -> float:
    """Return the mean run length of many runs."""
    random, alive = np.random.default_rng(5), RUNS
    sides, total = np.zeros((2, RUNS)), 0
    while alive:
        z = np.clip(shift + random.standard_normal(alive), -clip, clip)
        sides = np.maximum(
            0, sides + np.stack([z, -z if two_sided else np.full(alive, -np.inf)]) - drift
        )
        total += alive
        sides = sides[:, (sides <= threshold).all(axis=0)]
        alive = sides.shape[1]
    return total / RUNS


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


@pytest.mark.parametrize(
    ("interval", "shift", "clip", "message"),
    [
        (5.0, 1.0, 3.0, "false_alarm_interval: got 5.0, allowed: 10 to 1e12"),
        (1e3, 7.0, 3.0, r"smallest_shift: got 7.0, allowed: .* \(4.5\)"),
        (1e9, 1e-3, 3.0, "smallest_shift: got 0.001, allowed: a larger shift"),
        (1e3, 1.0, 0.0, "clip: got 0.0, allowed: 1 to 100"),
    ],
)
def test_wishes_that_cannot_be(interval: float, shift: float, clip: float, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        cusum(false_alarm_interval=interval, smallest_shift=shift, clip=clip)


def test_the_default_threshold_buys_what_its_page_says() -> None:
    """docs/threshold.md: 1.16e7 samples between false alarms; more than a spike in four pairs can add."""
    settings = palpate.HandoverRls().settings
    drift, threshold, clip = (settings[name] for name in ("drift", "threshold", "clip"))
    assert run_length(drift, threshold, clip=clip) / 2 == pytest.approx(1.16e7, rel=5e-3)
    assert 4 * (clip - drift) < threshold
    assert run_length(3.0, 1.0, clip=3.0) == float("inf")
