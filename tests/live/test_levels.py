"""The rows at several levels of detail: every view has the extremes of all rows, whatever was forgotten."""

import math
from typing import Any

import numpy as np
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from palpate.live import levels as module
from palpate.live.feed import BINS_PER_S, FIELDS, ROW, Rows, thinned
from palpate.live.levels import Levels

SMALL = {"FINEST": 600, "COARSER": 400, "WHOLE": 800, "_AT_ONCE": 64, "_SPLIT": 200, "KEPT": 100, "NEWEST": 50}


def made(times: np.ndarray[Any, np.dtype[np.float64]], draw: np.random.Generator) -> Rows:
    """Return random rows at these times, some without values."""
    rows = np.empty(len(times), ROW)
    rows["t_s"] = times
    for name in FIELDS[1:]:
        rows[name] = np.where(draw.random(len(times)) < 0.1, np.nan, draw.normal(size=len(times)))
    rows["flags"] = 1 << draw.integers(0, 5, len(times))
    return rows


def bins_of(rows: Rows, per_s: float) -> np.ndarray[Any, Any]:
    return np.asarray(np.floor(rows["t_s"] * per_s))


def require_extremes(view: Rows, every: Rows, per_s: float) -> None:
    """Compare the bins of a view, without the first and the last, which may stand for a row beyond the window."""
    bins, all_bins = bins_of(view, per_s), bins_of(every, per_s)
    inner = np.unique(bins)[1:-1]
    first, last = (inner[0], inner[-1]) if len(inner) else (0, -1)
    assert np.array_equal(np.unique(all_bins[(all_bins >= first) & (all_bins <= last)]), inner)
    for number in inner:
        shown, there = view[bins == number], every[all_bins == number]
        assert np.bitwise_or.reduce(shown["flags"]) == np.bitwise_or.reduce(there["flags"])
        for name in FIELDS:
            assert np.array_equal(np.fmax.reduce(shown[name]), np.fmax.reduce(there[name]), equal_nan=True)
            if name != "standard_error":
                assert np.array_equal(np.fmin.reduce(shown[name]), np.fmin.reduce(there[name]), equal_nan=True)


@given(
    st.integers(1, 6000),
    st.sampled_from([0.5, 38.0, 400.0]),
    st.booleans(),
    st.tuples(st.floats(0, 1), st.floats(0, 1)),
    st.integers(16, 300),
    st.integers(0, 2**32 - 1),
)
@examples(300)
def test_a_view_has_the_extremes_of_all_rows(
    count: int, rate: float, whole: bool, window: tuple[float, float], most: int, seed: int
) -> None:
    draw = np.random.default_rng(seed)
    steps = draw.exponential(1 / rate, count) + np.where(draw.random(count) < 0.002, 1000 / rate, 0)
    every = made(np.cumsum(steps) - draw.choice([0, 50 / rate]), draw)
    with pytest.MonkeyPatch.context() as patch:
        for name, value in SMALL.items():
            patch.setattr(module, name, value)
        levels, at = Levels(whole=whole), 0
        while at < count:
            size = int(draw.integers(1, 200))
            levels.add(every[at : at + size])
            at += size
        low, high = sorted(every["t_s"][0] + share * np.ptp(every["t_s"]) for share in window)
        per_s, view = levels.finest(low, high, most)
    assert len(view) <= most
    assert (np.diff(view["t_s"]) >= 0).all()
    assert view["t_s"][0] <= low
    assert view["t_s"][-1] >= min(high, every["t_s"][-1])
    if whole and not per_s:
        first, last = np.searchsorted(every["t_s"], [view["t_s"][0], view["t_s"][-1]])
        assert view.tobytes() == every[first : last + 1].tobytes()
        return
    require_extremes(view, every, per_s or BINS_PER_S)
    finer = bins_of(every, 2 * per_s)
    inside = (finer >= math.floor(low * 2 * per_s)) & (finer <= math.floor(high * 2 * per_s))
    if per_s and count < SMALL["FINEST"]:  # nothing is forgotten: it is the finest that fits
        assert len(thinned(every[inside], 2 * per_s)) > most // 2
