"""The rows of a measurement, the older ones thinned: every view has the extremes of all rows, whatever was forgotten."""

import math
from typing import Any

import numpy as np
import pytest
from effort import NIGHTLY, examples
from hypothesis import given
from hypothesis import strategies as st
from palpate.live import multiresolution as module
from palpate.live.multiresolution import MultiresolutionRows
from palpate.live.page_frames import BINS_PER_S, FIELDS, ROW, Rows, thinned

SMALL = {"FINEST": 600, "EARLIER": 400, "WHOLE": 800, "KEPT": 100, "NEWEST": 50}


def made(times: Any, draw: np.random.Generator) -> Rows:
    """Return random rows at these times, some without values."""
    rows = np.empty(len(times), ROW)
    rows["t_s"] = times
    for name in FIELDS[1:]:
        rows[name] = np.where(draw.random(len(times)) < 0.1, np.nan, draw.normal(size=len(times)))
    rows["flags"] = 1 << draw.integers(0, 5, len(times))
    return rows


def require_extremes(shown: Rows, there: Rows, *, exactly: bool) -> None:
    """Compare flags and extremes of rows with those that they stand for, or with a part of those."""
    flags = np.bitwise_or.reduce(there["flags"])
    assert np.bitwise_or.reduce(shown["flags"]) & flags == flags
    for name in FIELDS[1:]:
        for sign in (1, -1)[: 1 if name == "standard_error" else 2]:
            high, most = np.fmax.reduce(sign * shown[name]), np.fmax.reduce(sign * there[name])
            assert high == most or math.isnan(most) or (not exactly and high > most)


@given(
    st.integers(1, 3000), st.sampled_from([38.0, 1000.0, 3000.0, 1e5]), st.integers(0, 2**32 - 1)
)
@examples(100)
def test_no_extreme_and_no_flag_is_lost(count: int, rate: float, seed: int) -> None:
    """Sparse rows stay as they are; of dense ones two are left in each bin, in the order in which a column rises or falls."""
    rows = made((np.arange(count) + 0.5) / rate, np.random.default_rng(seed))
    rows["soft"] = -rows["t_s"]
    kept = thinned(rows)
    if rate <= 2 * BINS_PER_S:
        assert kept is rows
        return
    assert (np.diff(kept["soft"]) <= 0).all()
    bins, all_bins = (np.floor(each["t_s"] * BINS_PER_S) for each in (kept, rows))
    assert np.array_equal(np.unique(bins), np.unique(all_bins))
    for number in np.unique(bins):
        assert np.count_nonzero(bins == number) <= 2
        require_extremes(kept[bins == number], rows[all_bins == number], exactly=True)


@given(
    st.integers(1, 6000),
    st.sampled_from([0.5, 38.0, 400.0]),
    st.booleans(),
    st.tuples(st.floats(0, 1), st.floats(0, 1)),
    st.integers(16, 300),
    st.integers(0, 2**32 - 1),
)
@examples(200)
def test_a_view_has_the_extremes_of_all_rows(
    count: int, rate: float, whole: bool, window: tuple[float, float], most: int, seed: int
) -> None:
    """And a page that follows gets the newest rows."""
    draw = np.random.default_rng(seed)
    steps = draw.exponential(1 / rate, count) + np.where(draw.random(count) < 0.002, 1000 / rate, 0)
    every = made(np.cumsum(steps), draw)
    with pytest.MonkeyPatch.context() as patch:
        for name, value in SMALL.items():
            patch.setattr(module, name, value)
        levels, at = MultiresolutionRows(whole=whole), 0
        while at < count:
            size = int(draw.integers(1, 200))
            levels.add(every[at : at + size])
            at += size
        low, high = sorted(every["t_s"][0] + share * np.ptp(every["t_s"]) for share in window)
        view = levels.view(low, high, most)
        newest = levels.newest_rows()
        missed, followed = levels.following(0, count)
    assert 0 < len(view) <= most
    assert (np.diff(view["t_s"]) >= 0).all()
    assert (view["t_s"][0] <= low, view["t_s"][-1] >= min(high, every["t_s"][-1])) == (True, True)
    inside = every[(every["t_s"] >= low) & (every["t_s"] <= high)]
    if len(inside):
        require_extremes(view, inside, exactly=False)
    around = every[(every["t_s"] >= view["t_s"][0]) & (every["t_s"] <= view["t_s"][-1])]
    if levels.has_all and whole:
        require_extremes(view, around, exactly=len(around) <= most)
        assert len(view) > min(len(around), most // 2) - 3
    assert newest.tobytes() == every[-50:].tobytes()
    if rate == 0.5:  # nothing is so dense that it is thinned
        assert missed == (0 if whole else max(count - 100, 0))
        assert followed.tobytes() == (b"" if whole else every[-100:].tobytes())


def test_memory_of_a_long_measurement_is_bounded() -> None:
    """A day at 1 kHz, in blocks: the newest rows and a quarter more, and few rows for all before."""
    seconds = 86_400 if NIGHTLY else 1200
    levels, second = MultiresolutionRows(), made(np.arange(1000) / 1000, np.random.default_rng(1))
    begun = second["t_s"].copy()
    for number in range(seconds):
        second["t_s"] = begun + number
        levels.add(second)
    assert len(levels._finest._rows) == module.FINEST * 5 // 4
    assert module.EARLIER // 4 < len(levels._earlier) <= module.EARLIER
    view = levels.view(0, seconds, 4096)
    assert (view["t_s"][0], len(view)) == (0, 4096)
    assert np.fmax.reduce(view["hard"]) == np.fmax.reduce(second["hard"])
