"""Times and channels: times of arrival become the converter's; the matched pair of filters against its design and the reference."""

from typing import Any

import numpy as np
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from numeric import drive
from numpy.typing import ArrayLike, NDArray
from palpate import reference
from palpate.reference import align


def mismatch(period_s: float, a: float, b: float) -> float:
    """Return how much the responses of the filters differ, rms from 3 to 13 Hz, by the impulses at their real times."""
    f = np.linspace(3, 13, 2001)

    def at(t: float) -> NDArray[np.complex128]:
        return np.asarray(np.exp(2j * np.pi * f * t * period_s))

    hard = (1 - 2 * a) * at(0) + a * (at(-1) + at(1))
    soft = (0.5 - b) * (at(-0.5) + at(0.5)) + b * (at(-1.5) + at(1.5))
    return float(np.sqrt(np.mean(np.abs(hard - soft) ** 2)))


@pytest.mark.parametrize(
    "period_s", [0.004, 0.01, 0.018, 0.022, 0.026, 0.0285, 0.0315, 0.036, 0.04]
)
def test_the_responses_of_the_filters_agree_as_far_as_any_can(period_s: float) -> None:
    w = 2 * np.pi * period_s * np.linspace(3, 13, 400)
    terms = np.stack([2 * np.cos(w) - 2, 2 * np.cos(w / 2) - 2 * np.cos(1.5 * w)], axis=1)
    least = mismatch(period_s, *np.linalg.lstsq(terms, np.cos(w / 2) - 1, rcond=None)[0])
    found = mismatch(period_s, *align.sides(period_s * 1e9))
    assert found < 1.03 * least + 2e-4
    # Linear interpolation of one channel differs by 1 - cos(w / 2): far more.
    assert found < 0.1 * np.sqrt(np.mean((1 - np.cos(w / 2)) ** 2))


EPS = np.finfo(float).eps
SPECIAL = st.sampled_from([np.nan, np.inf, -np.inf])


@st.composite
def readings(draw: st.DrawFn) -> tuple[NDArray[Any], ...]:
    """Draw times, ns, and values: an even grid with jitter, gaps, lost readings, both orders, times that go back."""
    count = draw(st.integers(4, 60))
    period = draw(
        st.sampled_from([1e-4, 0.001, 0.026, 0.0285, 0.0286, 0.0315, 0.04, 0.0405, 0.3, 1.2])
        | st.floats(1e-4, 1.5)
    )
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    jitter = period * draw(st.sampled_from([0.0, 0.01, 0.1, 0.2, 0.3]))
    phase = draw(st.sampled_from([0.5, -0.5, 0.0, 0.3, 0.9]))
    k = np.arange(count) + np.cumsum(
        draw(st.sampled_from([0, 0, 1, 40])) * (random.random(count) < 0.05)
    )
    begin = draw(st.sampled_from([0.0, 3600.0, -5.0]))
    times = [
        begin + period * (k + shift) + jitter * random.uniform(-1, 1, count)
        for shift in (0.0, phase)
    ]
    t_hard, t_soft = (np.rint(t * 1e9).astype(np.int64) for t in times)
    if phase == 0.0:
        t_soft = t_hard.copy()
    if draw(st.booleans()):  # the clock is set back
        at = draw(st.integers(0, count - 1))
        back = np.int64(draw(st.integers(0, 10**10)))
        t_hard[at:] -= back
        t_soft[at:] -= back
    scale = 10.0 ** draw(st.integers(-9, 9))
    values = [
        scale * (level + random.standard_normal(count))
        for level in draw(st.sampled_from([(0, 0), (9, -4)]))
    ]
    for channel in values:
        channel[random.random(count) < draw(st.sampled_from([0.0, 0.05, 0.4]))] = draw(SPECIAL)
    return t_hard, t_soft, *values


def allowed(t_soft: NDArray[Any], soft: NDArray[Any], hard: NDArray[Any]) -> float:
    """Return the rounding of a pair: 50 operations on products of values and weights, the largest in the interpolation."""
    there = np.isfinite(soft)
    t = t_soft[there]
    s = soft[there]
    largest = 1.0
    for i in range(3, len(t)):
        window = t[i - 3 : i + 1]
        if (np.diff(window) > 0).all():
            ends = (int(window[1]), int(window[2]))
            largest = max(
                largest,
                *(
                    np.abs(align.lagrange(window.tolist(), at)).sum()
                    for at in (*ends, sum(ends) // 2)
                ),
            )
    both = np.concatenate([s, hard[np.isfinite(hard)], [0.0]])
    return float(50 * EPS * largest * np.abs(both).max())


@examples(200, 4000)
@given(readings())
def test_the_core_is_the_reference(drawn: tuple[NDArray[Any], ...]) -> None:
    _, t_soft, hard, soft = drawn
    right = reference.matched_pair(*drawn)
    found = drive("pair", np.column_stack(drawn), 4)
    assert np.array_equal(found[:, 2] == 1, right.valid)
    assert np.array_equal(found[right.valid, 3] == 1, right.matched[right.valid])
    assert not right.matched[~right.valid].any()
    off = np.abs(found[right.valid, :2] - np.column_stack(right[:2])[right.valid])
    assert (off <= allowed(t_soft, soft, hard)).all()


PERIOD = 26_000_000.0  # ns


def smoothed(times: ArrayLike) -> NDArray[np.float64]:
    return drive("stamps", np.round(np.asarray(times, float)), 1)[:, 0]


def arrivals(n: int, late_ms: float = 3.0, seed: int = 0) -> NDArray[np.float64]:
    return (
        1e12
        + PERIOD * np.arange(n)
        + 1e6 * np.random.default_rng(seed).uniform(-late_ms, late_ms, n)
    )


@pytest.mark.parametrize("n", [3, 8, 60])
def test_the_first_stamps_are_a_least_squares_line(n: int) -> None:
    times = arrivals(n)
    line = np.polyfit(np.arange(n), times - times[0], 1)
    # whole ns each time
    assert smoothed(times)[-1] - times[0] == pytest.approx(np.polyval(line, n - 1), abs=2 * n)


@pytest.mark.parametrize("lost", [2, 500])
def test_a_gap_of_whole_periods_is_lost_readings(lost: int) -> None:
    steps = np.diff(smoothed(np.delete(1e12 + PERIOD * np.arange(lost + 98), range(50, 50 + lost))))
    assert steps[49] == pytest.approx((lost + 1) * PERIOD, abs=4)
    late = arrivals(120, seed=3)
    late[60:] += lost * PERIOD
    assert smoothed(late)[60] != np.round(late[60])  # still on the line


@pytest.mark.parametrize("jump", [0.45, 7.45, -3.0, -1e4, 1e6])
def test_after_anything_else_the_line_begins_again(jump: float) -> None:
    """The stamp itself, then a line through the later ones only."""
    times = arrivals(120, late_ms=0.5)
    times[60:] += jump * PERIOD
    found = smoothed(times)
    assert found[60] == np.round(times[60])
    line = np.polyfit(np.arange(20), times[60:80] - times[60], 1)
    assert found[79] - times[60] == pytest.approx(np.polyval(line, 19), abs=60)
