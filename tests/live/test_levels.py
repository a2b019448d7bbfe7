"""The rows at several levels of detail: every view has the extremes of all rows, whatever was forgotten."""

import asyncio
import json
import math
import subprocess
import sys
import time
from typing import Any

import numpy as np
import pytest
from effort import NIGHTLY, examples
from hypothesis import given
from hypothesis import strategies as st
from palpate.live import levels as module
from palpate.live.access.limits import VIEWS, VIEWS_WAITING
from palpate.live.feed import BINS_PER_S, FIELDS, HEADER, ROW, Kind, Rows, thinned
from palpate.live.levels import Levels
from palpate.live.pages import Page
from palpate.live.protocol import Command

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
    if per_s and count < SMALL["FINEST"] and inside.any():  # nothing is forgotten: it is the finest that fits
        assert len(thinned(every[inside], 2 * per_s)) > most // 2


@pytest.mark.parametrize("whole", [False, True])
def test_a_coarse_view_has_the_newest_rows(whole: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also those that wait to be passed on to the coarser levels."""
    for name, value in SMALL.items():
        monkeypatch.setattr(module, name, value)
    every = made(np.arange(3030) / 38, np.random.default_rng(1))
    levels, waited = Levels(whole=whole), 0
    for begin in range(0, len(every), 10):
        levels.add(every[begin : begin + 10])
        here = every[: begin + 10]
        per_s, view = levels.finest(0, here["t_s"][-1], 16)
        waited += bool(per_s and levels._late)
        assert view["t_s"][-1] == here["t_s"][-1]
        assert np.fmax.reduce(view["hard"]) == np.fmax.reduce(here["hard"])
    assert waited > 100


def test_memory_of_a_long_measurement_is_bounded() -> None:
    """A day at 1 kHz, in blocks: each level has its rows and a quarter more, and there are as many as quadruplings."""
    seconds = 86_400 if NIGHTLY else 3600
    levels, second = Levels(), made(np.arange(1000) / 1000, np.random.default_rng(1))
    begun = second["t_s"].copy()
    for number in range(seconds):
        second["t_s"] = begun + number
        levels.add(second)
    rows = [len(level._rows) for level in levels._levels]
    assert rows[0] <= module.FINEST * 5 // 4
    assert max(rows[1:]) <= module.COARSER * 5 // 4
    assert len(rows) <= 2 + math.log(seconds * 1000 / module._SPLIT, module._WIDER)
    view = levels.view(0, seconds, 4096)
    assert view["t_s"][0] == 0
    assert len(view) > 1024
    assert np.fmax.reduce(view["hard"]) == np.fmax.reduce(second["hard"])


class Socket:
    """A web socket that keeps the views."""

    def __init__(self) -> None:
        self.views: list[int] = []

    async def send_text(self, data: str) -> None:
        pass

    async def send_bytes(self, data: bytes) -> None:
        _, number, _, kind = HEADER.unpack_from(data)
        if kind == Kind.VIEW:
            self.views.append(number)


def test_a_page_gets_a_recording_as_views_alone() -> None:
    """It draws a recording from views: rows in frames would be work for nothing."""
    rows = np.zeros(5000, ROW)
    rows["t_s"] = np.arange(5000) / 38
    levels = {whole: Levels(whole=whole) for whole in (False, True)}
    for kept in levels.values():
        kept.add(rows)
    assert {whole: kept.recent.end for whole, kept in levels.items()} == {False: 5000, True: 0}
    assert len(levels[True].view(0, 1e9, 4096)) > 1000


def test_of_too_many_views_the_newest_are_sent() -> None:
    async def run() -> tuple[list[int], float]:
        socket, begun = Socket(), time.monotonic()
        page = Page(socket)
        sending = asyncio.create_task(page.send())
        for number in range(100):
            page.look(Command("view", {"id": number, "from_s": 0.0, "to_s": 1.0, "rows": 100}))
            await asyncio.sleep(0)
        while socket.views[-1] < 99:
            await asyncio.sleep(0.01)
        sending.cancel()
        return socket.views, time.monotonic() - begun

    views, seconds = asyncio.run(run())
    assert views == sorted(views)
    assert views[-VIEWS_WAITING:] == list(range(100 - VIEWS_WAITING, 100))
    assert len(views) <= VIEWS.at_once + VIEWS.per_s * seconds + 1


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs /proc")
def test_a_server_at_1_kHz_stays_as_large_as_it_is() -> None:
    """From the first sixth of the time to its end: less than the levels that fill in 10 minutes, 64k rows of 49 bytes each."""
    seconds = 600 if NIGHTLY else 12
    command = [sys.executable, "-m", "bench.speed.live_recording", "--flat", str(seconds)]
    told = subprocess.run(command, capture_output=True, text=True, check=True)
    early, late, dropped = json.loads(told.stdout)
    assert late - early < 20 + 4
    assert dropped == 0
