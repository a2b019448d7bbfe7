"""The matched pair of filters against its reference, with everything that times and readings of a converter do."""

from typing import Any

import numpy as np
from driving import drive
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from palpate.reference import align, matched_pair
from tally import Tally

EPS = np.finfo(float).eps
SPECIAL = st.sampled_from([np.nan, np.inf, -np.inf])


@st.composite
def readings(draw: st.DrawFn) -> tuple[NDArray[Any], ...]:
    """Draw times, ns, and values: an even grid with jitter, gaps, lost readings, both orders, times that go back."""
    count = draw(st.integers(4, 60))
    period = draw(
        st.sampled_from([1e-4, 0.001, 0.026, 0.0285, 0.0286, 0.0315, 0.04, 0.0405, 0.3, 1.2]) | st.floats(1e-4, 1.5)
    )
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    jitter = period * draw(st.sampled_from([0.0, 0.01, 0.1, 0.2, 0.3]))
    phase = draw(st.sampled_from([0.5, -0.5, 0.0, 0.3, 0.9]))
    k = np.arange(count) + np.cumsum(draw(st.sampled_from([0, 0, 1, 40])) * (random.random(count) < 0.05))
    begin = draw(st.sampled_from([0.0, 3600.0, -5.0]))
    times = [begin + period * (k + shift) + jitter * random.uniform(-1, 1, count) for shift in (0.0, phase)]
    t_hard, t_soft = (np.rint(t * 1e9).astype(np.int64) for t in times)
    if phase == 0.0:
        t_soft = t_hard.copy()
    if draw(st.booleans()):  # the clock is set back
        at, back = draw(st.integers(0, count - 1)), np.int64(draw(st.integers(0, 10**10)))
        t_hard[at:] -= back
        t_soft[at:] -= back
    scale = 10.0 ** draw(st.integers(-9, 9))
    values = [scale * (level + random.standard_normal(count)) for level in draw(st.sampled_from([(0, 0), (9, -4)]))]
    for channel in values:
        channel[random.random(count) < draw(st.sampled_from([0.0, 0.05, 0.4]))] = draw(SPECIAL)
    return t_hard, t_soft, *values


def allowed(t_soft: NDArray[Any], soft: NDArray[Any], hard: NDArray[Any]) -> float:
    """Return the rounding of a pair: 50 operations on products of values and weights, the largest in the interpolation."""
    there = np.isfinite(soft)
    t, s = t_soft[there], soft[there]
    largest = 1.0
    for i in range(3, len(t)):
        window = t[i - 3 : i + 1]
        if (np.diff(window) > 0).all():
            ends = (int(window[1]), int(window[2]))
            largest = max(
                largest, *(np.abs(align.lagrange(window.tolist(), at)).sum() for at in (*ends, sum(ends) // 2))
            )
    both = np.concatenate([s, hard[np.isfinite(hard)], [0.0]])
    return float(50 * EPS * largest * np.abs(both).max())


@examples(200, 4000)
@given(readings())
def test_the_core_is_the_reference(tally: Tally, drawn: tuple[NDArray[Any], ...]) -> None:
    tally.count("recordings against the reference of the alignment")
    _, t_soft, hard, soft = drawn
    right = matched_pair(*drawn)
    found = drive("pair", np.column_stack(drawn), 4)
    assert np.array_equal(found[:, 2] == 1, right.valid)
    assert np.array_equal(found[right.valid, 3] == 1, right.matched[right.valid])
    assert not right.matched[~right.valid].any()
    off = np.abs(found[right.valid, :2] - np.column_stack(right[:2])[right.valid])
    assert (off <= allowed(t_soft, soft, hard)).all()


def test_the_examples_reach_every_branch() -> None:
    """An even grid at both speeds, both channels at once, uneven windows before and after the patience, and no pair."""
    random, k = np.random.default_rng(1), np.arange(40)
    value = 1 + random.standard_normal(40)

    def pairs(period_ms: float, phase: float = 0.5, jitter: float = 0.0) -> Any:
        t = period_ms * (k + jitter * random.uniform(-1, 1, 40))
        t_hard, t_soft = (np.rint(1e6 * (t + shift * period_ms)).astype(np.int64) for shift in (0, phase))
        return matched_pair(t_hard, t_soft, value, value)

    fast, slow, uneven = pairs(26.0), pairs(31.5), pairs(50.0)
    assert fast.matched[3:].all()
    assert slow.matched[3:].all()
    assert (fast.hard != slow.hard)[3:].all()  # other coefficients
    assert pairs(26.0, 0.0).hard[3:].tolist() == value[2:-1].tolist()
    assert np.flatnonzero(uneven.valid)[0] == 3 + align.PATIENCE - 1
    assert not uneven.matched.any()
    assert not pairs(1100.0).valid.any()
    mixed = pairs(26.0, jitter=0.24)
    assert 0 < mixed.matched.sum() < 30
