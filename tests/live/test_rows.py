"""The rows that a page gets: when they are sent, and what is left of them where samples are dense."""

import asyncio
import time
from collections.abc import Iterator
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
import pytest
from effort import NIGHTLY, examples
from hypothesis import given
from hypothesis import strategies as st
from palpate import Sample, Source
from palpate.live import hub as hubs
from palpate.live.feed import BINS_PER_S, FIELDS, HEADER, ROW, Rows, thinned
from palpate.live.hub import Hub
from palpate.live.levels import Levels
from palpate.live.pages import AHEAD, ROWS, Page
from palpate.live.recordings import Recordings
from palpate.live.session import Session
from palpate.live.workbench import Workbench

_PATIENCE_S = 60


def made(count: int, rate: float, seed: int) -> Rows:
    """Return random rows, some without values; no time is at the edge of a bin."""
    draw = np.random.default_rng(seed)
    rows = np.empty(count, ROW)
    rows["t_s"] = (np.arange(count) + 0.5) / rate
    for name in FIELDS[1:]:
        values = np.cumsum(draw.normal(size=count)) * draw.choice([1e-3, 1.0])
        rows[name] = np.where(draw.random(count) < draw.choice([0.0, 0.3, 1.0]), np.nan, values)
    rows["flags"] = draw.integers(0, 32, count)
    return rows


@given(st.integers(0, 3000), st.sampled_from([38.0, 1000.0, 3000.0, 1e4, 1e5]), st.integers(0, 2**32 - 1))
@examples(100)
def test_no_extreme_and_no_flag_is_lost(count: int, rate: float, seed: int) -> None:
    rows = made(count, rate, seed)
    kept = thinned(rows)
    bins, kept_bins = (np.floor(part["t_s"] * BINS_PER_S) for part in (rows, kept))
    assert len(kept) <= min(len(rows), 2 * len(np.unique(bins)))
    assert np.array_equal(np.unique(bins), np.unique(kept_bins))
    assert (np.diff(kept["t_s"]) >= 0).all()
    for number in np.unique(bins):
        there, left = rows[bins == number], kept[kept_bins == number]
        assert np.bitwise_or.reduce(there["flags"]) == np.bitwise_or.reduce(left["flags"])
        for name in FIELDS:
            highest = [np.fmax.reduce(part[name]) for part in (there, left)]
            assert highest == pytest.approx(highest[::-1], rel=0, abs=0, nan_ok=True)
            lowest = [np.fmin.reduce(part[name]) for part in (there, left)]
            assert name == "standard_error" or lowest == pytest.approx(lowest[::-1], rel=0, abs=0, nan_ok=True)


def test_sparse_rows_are_sent_as_they_are() -> None:
    for rate in (38.0, 1000.0):
        rows = made(500, rate, 1)
        assert thinned(rows) is rows


def test_a_column_that_rises_or_falls_keeps_its_order() -> None:
    rows = made(1000, 1e4, 1)
    rows["hard"], rows["soft"] = np.arange(1000), -np.arange(1000)
    kept = thinned(rows)
    assert len(kept) == 100
    assert (np.diff(kept["hard"]) > 0).all()
    assert (np.diff(kept["soft"]) < 0).all()


async def turns() -> None:
    for _ in range(20):
        await asyncio.sleep(0)


class Noting:
    """A web socket that keeps the frames."""

    def __init__(self) -> None:
        self.frames: list[bytes] = []
        self.came = asyncio.Event()

    async def send_text(self, data: str) -> None:
        pass

    async def send_bytes(self, data: bytes) -> None:
        self.frames.append(data)
        if HEADER.unpack_from(data)[2]:
            self.came.set()


class One(Source):
    """A source that gives one sample, when it is told to."""

    def __init__(self) -> None:
        self.may, self._ended = Event(), Event()

    def describe(self) -> dict[str, Any]:
        return {"period_s": 0.026}

    def __iter__(self) -> Iterator[Sample]:
        """Wait, and return it."""
        self.may.wait()
        yield Sample(0, 0, 0, -1, -1, 1.0, 1.0)
        self._ended.wait()

    def interrupt(self) -> None:
        self.may.set()
        self._ended.set()


def test_a_row_is_sent_when_it_comes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not when the server looks again: it does so once an hour here."""
    monkeypatch.setattr(hubs, "_STATES_PER_S", 1 / 3600)
    source = One()
    session = Session(lambda: source, Recordings(None), {"scene": "sliding"})
    session.start()

    async def run() -> None:
        hub, socket = Hub(Workbench(session, "one")), Noting()
        page = Page(socket)
        hub.join(page)
        tasks = [asyncio.create_task(work) for work in (page.send(), hub.run())]
        await turns()
        assert not socket.came.is_set()
        source.may.set()
        await asyncio.wait_for(socket.came.wait(), _PATIENCE_S)
        for task in tasks:
            task.cancel()

    asyncio.run(run())
    session.close()


class Fast(Source):
    """Ten thousand pairs a second, in real time or as fast as they are taken."""

    RATE = 10_000

    def __init__(self, seconds: float, *, live: bool) -> None:
        self._pairs, self.live, self._ended = round(seconds * self.RATE), live, False

    def describe(self) -> dict[str, Any]:
        return {"period_s": 1 / self.RATE}

    def __iter__(self) -> Iterator[Sample]:
        """Return noise without contact."""
        begun, draw = time.monotonic(), np.random.default_rng(1)
        signal = 1 + 1e-3 * draw.normal(size=self._pairs)
        for n, value in enumerate(signal.tolist()):
            if self._ended:
                return
            if self.live and n % 50 == 0:
                time.sleep(max(0.0, begun + n / self.RATE - time.monotonic()))
            t = round((n + 0.5) / self.RATE * 1e9)
            yield Sample(n, t, t, -1, -1, value, value)

    def interrupt(self) -> None:
        self._ended = True


def test_ten_thousand_pairs_a_second(tmp_path: Path) -> None:
    """Every pair is recorded and estimated; the pages get a tenth as many rows, in as many frames as of a slow source."""
    seconds = 60 if NIGHTLY else 2
    session = Session(lambda: Fast(seconds, live=NIGHTLY), Recordings(tmp_path / "run.csv"), {"scene": "sliding"})
    batches: list[int] = []
    session.on_rows = lambda: batches.append(1)
    begun = time.monotonic()
    session.start()
    parts: list[Rows] = []
    end = 0
    while session.running or end < session.levels.recent.end:
        missed, part = session.levels.following(end, 1 << 20)
        assert missed == 0
        parts.append(part)
        end += len(part)
        time.sleep(0.01)
    session.close()
    took_s = time.monotonic() - begun
    counters, rows = session.counters, np.concatenate(parts)
    assert (counters.read, counters.dropped, counters.recorded) == (10_000 * seconds, 0, 10_000 * seconds)
    assert counters.delivered == counters.read
    assert len(rows) <= 2 * BINS_PER_S * seconds + 4 * len(batches)
    assert len(batches) <= 120 * took_s + 10_000 * seconds / 256 + 2  # a pause after each, but with 256 pairs that wait
    assert (rows["t_s"][0], rows["t_s"][-1]) == pytest.approx((0.5e-4, seconds - 0.5e-4), rel=1e-12)
    assert np.diff(rows["t_s"]).max() <= 1 / BINS_PER_S


def test_a_page_that_confirms_every_fourth_frame_gets_all() -> None:
    async def run() -> tuple[int, int]:
        socket, levels = Noting(), Levels()
        page = Page(socket)
        page.begin(levels)
        sending = asyncio.create_task(page.send())
        for _ in range(4 * AHEAD):
            levels.add(made(ROWS, 38.0, 1))
            page.wake()
            await turns()
            if page.sent % 4 == 0:
                page.seen(page.sent)
        sending.cancel()
        return sum(HEADER.unpack_from(frame)[2] for frame in socket.frames), page.lost

    assert asyncio.run(run()) == (4 * AHEAD * ROWS, 0)
