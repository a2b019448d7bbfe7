"""The screen against its reference: the same readings are outliers, and the same is judged."""

from typing import Any

import numpy as np
import palpate
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from palpate.reference import screen

BY_THE_SCREEN = {"saturated", "frozen"}

faults = st.sampled_from(["none", "loose", "spikes", "missing", "stands", "end", "zero"])


@st.composite
def sessions(draw: st.DrawFn) -> tuple[NDArray[Any], ...]:
    """Draw some presses with tremor, and what happens to each channel."""
    rng = np.random.default_rng(draw(st.integers(0, 2**31)))
    rate = draw(st.sampled_from([5.0, 38.0, 200.0]))
    n = draw(st.integers(0, 500))
    t = np.arange(n) / rate
    press = 0.2 * np.clip(np.sin(2 * t), 0, 0.6) * (1 + 0.1 * np.sin(45 * t))
    noise = draw(st.sampled_from([4e-5, 1e-3, 0.0]))
    decimals = draw(st.sampled_from([2, 4, 15]))
    channels = []
    for level, share in ((draw(st.sampled_from([9.0, 3.8, -0.4])), 2.5), (3.95, 1.0)):
        values = level + share * press + noise * rng.standard_normal(n)
        channels.append(np.round(_with_fault(draw(faults), values, level, rng), decimals))
    t_ns = np.rint(1e9 * t).astype(np.int64)
    later = draw(st.sampled_from([0, int(0.5e9 / rate)]))
    return t_ns, t_ns + later, *channels


def _with_fault(
    fault: str, values: NDArray[Any], level: float, rng: np.random.Generator
) -> NDArray[Any]:
    n = len(values)
    bad = rng.random(n) < rng.choice([0.02, 0.1, 0.3])
    late = np.arange(n) > n // 2
    if fault == "loose":
        return np.where(bad, level, values)
    if fault == "spikes":
        return np.where(bad, values + rng.normal(0, 0.2, n), values)
    if fault == "missing":
        return np.where(bad, rng.choice([np.nan, np.inf]), values)
    if fault == "stands":
        return np.where(late, values[n // 2], values) if n else values
    if fault == "end":
        clipped: NDArray[Any] = np.clip(values, -4.096, 4.096)
        return clipped
    return np.zeros(n) if fault == "zero" else values


@examples(100)
@given(sessions(), st.sampled_from(["handheld", "sliding"]))
def test_the_screen_is_the_reference(readings: tuple[NDArray[Any], ...], scene: Any) -> None:
    right = screen(*readings)
    tracker = palpate.Tracker(scene)
    tracker.process(*readings)
    tracker.finish()
    found = [each for each in tracker.judgements if each.name in BY_THE_SCREEN]
    assert found == [each.in_seconds() for each in right.judgements]


@examples(60)
@given(sessions())
def test_outliers_of_touches_are_those_of_the_reference(readings: tuple[NDArray[Any], ...]) -> None:
    outlier = screen(*readings).outlier
    tracker = palpate.Tracker("handheld", averaged=0.0)
    rows = tracker.process(*readings)
    tracker.finish()
    # A row is about the reading two before it. Those of the gate's delay are not counted.
    for number, touch in enumerate(tracker.touches, 1):
        inside = np.flatnonzero(rows["touch"] == number)
        if len(inside) > 1 and inside[-1] < len(rows) - 1:
            counted = outlier[inside[1:] - 2].sum(axis=0).max()
            assert touch.outliers in (counted, counted + 1)


def test_a_reading_is_judged_two_readings_later() -> None:
    t = np.arange(300) / 38
    rng = np.random.default_rng(1)
    hard = 9 + rng.normal(0, 4e-5, 300)
    soft = 8 + rng.normal(0, 4e-5, 300)
    tracker = palpate.Tracker("handheld")
    for i in range(40):
        tracker.feed(t[i], t[i] + 0.013, hard[i], soft[i])
    assert tracker.readings == 40
    assert tracker.state == "waiting"
    assert not tracker.judgements


@pytest.mark.parametrize("channel", ["hard", "soft"])
@pytest.mark.parametrize("end", [4.096, -4.096, 8.192, 15.0])
def test_a_known_end_is_said_once(channel: str, end: float) -> None:
    n = 400
    t = np.arange(n) / 38
    rng = np.random.default_rng(2)
    free = 2 + rng.normal(0, 4e-5, n)
    full = np.full(n, end)
    full[:100] -= np.sign(end) * np.linspace(1, 0.05, 100)
    both = (full, free) if channel == "hard" else (free, full)
    tracker = palpate.Tracker("handheld")
    tracker.take(t, t, *both)
    tracker.finish()
    found = [each for each in tracker.judgements if each.name == "saturated"]
    assert [(each.channel, each.size) for each in found] == [(channel, end)]
    known = palpate.Tracker("handheld", full_scale=100.0)
    known.take(t, t, *both)
    assert not [each for each in known.judgements if each.name == "saturated"]
