"""What holds for every design of the CUSUM: the order of its numbers, Siegmund's formula, and a direct simulation."""

import numpy as np
import pytest
from effort import examples
from hypothesis import assume, given
from hypothesis import strategies as st
from palpate.design import cusum, run_length, siegmund
from tally import Tally

RUNS = 10_000  # run lengths are nearly exponential: their mean is known to 1 %
CHAIN = 0.02  # of the Markov chain, as its documentation says

drifts, thresholds = st.floats(0.1, 1.2), st.floats(1.0, 12.0)
clips = st.sampled_from([2.0, 3.0, 6.0])


@examples(8, 250)
@given(st.floats(20, 1e9), st.floats(1.1, 100), st.floats(0.3, 3.0), clips)
def test_rarer_false_alarms_need_a_higher_threshold_and_more_time(
    interval: float, factor: float, shift: float, clip: float
) -> None:
    often, rarely = (
        cusum(false_alarm_interval=wanted, smallest_shift=shift, clip=clip) for wanted in (interval, factor * interval)
    )
    assert often.drift == rarely.drift == shift / 2
    assert rarely.threshold >= often.threshold
    assert rarely.delay >= often.delay
    assert rarely.false_alarm_interval >= often.false_alarm_interval * 0.999
    assert often.false_alarm_interval >= interval * 0.999


@examples(10, 200)
@given(drifts, thresholds, st.floats(-0.5, 3.0), st.floats(0.05, 1.0), clips)
def test_a_larger_shift_is_found_sooner(drift: float, threshold: float, shift: float, more: float, clip: float) -> None:
    """And a higher threshold or a larger drift makes every run longer."""
    length = run_length(drift, threshold, shift=shift, clip=clip)
    assume(length < 1e9)
    assert run_length(drift, threshold, shift=shift + more, clip=clip) < length
    assert run_length(drift, threshold + more, shift=shift, clip=clip) > length * 0.999
    assert run_length(drift + more, threshold, shift=shift, clip=clip) > length
    assert length >= 1


@examples(15, 400)
@given(st.floats(0.2, 0.8), st.floats(3.0, 12.0))
def test_siegmund(drift: float, threshold: float) -> None:
    """Without clipping; the formula is an approximation itself, 4 % off at a drift of 0.8."""
    assume(siegmund(drift, threshold) < 1e9)
    assert run_length(drift, threshold, clip=50.0) == pytest.approx(siegmund(drift, threshold), rel=0.05)


def simulated(drift: float, threshold: float, shift: float, clip: float, *, two_sided: bool) -> float:
    """Return the mean run length of many runs."""
    random, alive = np.random.default_rng(5), RUNS
    sides, total = np.zeros((2, RUNS)), 0
    while alive:
        z = np.clip(shift + random.standard_normal(alive), -clip, clip)
        sides = np.maximum(0, sides + np.stack([z, -z if two_sided else np.full(alive, -np.inf)]) - drift)
        total += alive
        sides = sides[:, (sides <= threshold).all(axis=0)]
        alive = sides.shape[1]
    return total / RUNS


@examples(10, 150)
@given(drifts, st.floats(0.5, 5.0), st.floats(0.0, 2.0), clips)
def test_a_run_is_as_long_as_simulated(tally: Tally, drift: float, threshold: float, shift: float, clip: float) -> None:
    expected = run_length(drift, threshold, shift=shift, clip=clip)
    assume(expected < 300)
    found = simulated(drift, threshold, shift, clip, two_sided=False)
    tally.note("run length of a CUSUM by simulation, relative deviation", abs(found / expected - 1))
    assert found == pytest.approx(expected, rel=5 / RUNS**0.5 + CHAIN)


@examples(8)
@given(st.floats(20, 300), st.floats(0.5, 2.5))
def test_a_design_has_its_false_alarms_and_its_delay(interval: float, shift: float) -> None:
    """Of both sides together. Sides that alarm often are not independent: below 20 samples they are fewer than twice."""
    design = cusum(false_alarm_interval=interval, smallest_shift=shift)
    between = simulated(design.drift, design.threshold, 0.0, 3.0, two_sided=True)
    assert between == pytest.approx(design.false_alarm_interval, rel=5 / RUNS**0.5 + CHAIN)
    delay = simulated(design.drift, design.threshold, shift, 3.0, two_sided=False)
    assert delay == pytest.approx(design.delay, rel=5 / RUNS**0.5 + CHAIN)
