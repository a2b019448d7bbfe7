"""What an open page gets: rows when they come, all of them or the newest, and messages in their order."""

import asyncio
import json
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any
from unittest.mock import AsyncMock

import numpy as np
import pytest
from live_bench import OWN_FILE, SOURCE, begun, client
from live_server import PATIENCE_S
from palpate.live import app as module
from palpate.live.client import FRAME_ROWS, PageClient
from palpate.live.multiresolution import KEPT, MultiresolutionRows
from palpate.live.page_commands import ViewCommand
from palpate.live.page_frames import HEADER, ROW, FrameKind

READ = 30  # frames that a page reads before it falls asleep


async def turns() -> None:
    for _ in range(50):
        await asyncio.sleep(0)


def with_page(
    test: Callable[[PageClient, MultiresolutionRows, asyncio.Event], Awaitable[None]],
) -> tuple[list[str], list[bytes]]:
    """Run a test with a page that sends, and the event that its connection has room; return its texts and frames."""
    socket, levels = AsyncMock(), MultiresolutionRows()

    async def run() -> None:
        page, room = PageClient(socket, levels), asyncio.Event()
        room.set()

        async def send(_: bytes) -> None:
            await room.wait()

        socket.send_bytes.side_effect = send
        sending = asyncio.create_task(page.send())
        await test(page, levels, room)
        sending.cancel()

    asyncio.run(run())
    texts, frames = (
        [call.args[0] for call in sent.await_args_list]
        for sent in (socket.send_text, socket.send_bytes)
    )
    return texts, frames


def times(frame: bytes) -> np.ndarray[Any, Any]:
    return np.frombuffer(frame, "<f8", HEADER.unpack_from(frame)[2], HEADER.size)


@pytest.mark.parametrize("missed", [KEPT, 2 * KEPT])
def test_a_page_that_does_not_read_costs_nothing_and_goes_on_later(missed: int) -> None:
    """It gets what it missed, in frames of limited size; if that is forgotten it begins again with the recent rows."""
    rows = np.zeros(missed, ROW)
    rows["t_s"] = np.arange(missed) / 38

    async def test(page: PageClient, levels: MultiresolutionRows, room: asyncio.Event) -> None:
        for begin in range(0, missed, 64):
            levels.add(rows[begin : begin + 64])
            page.wake()
            await turns()
            if begin == 64 * READ:
                room.clear()
        room.set()
        await turns()

    _, frames = with_page(test)
    assert max(len(times(frame)) for frame in frames) <= FRAME_ROWS
    anew = [at for at, frame in enumerate(frames) if HEADER.unpack_from(frame)[3] == FrameKind.ANEW]
    assert anew == ([0] if missed == KEPT else [0, READ + 2])
    got = np.concatenate([times(frame) for frame in frames])
    assert np.array_equal(got[-KEPT:], rows["t_s"][-KEPT:])
    assert len(got) == missed or missed > KEPT


def test_the_state_comes_before_the_answer_and_only_the_newest() -> None:
    async def test(page: PageClient, _levels: MultiresolutionRows, _room: asyncio.Event) -> None:
        page.send_message("state", "recording: run.csv")
        page.send_answer("closed")
        page.send_message("state", "recording: none")
        page.run(ViewCommand(7, 0.0, 1.0, 100))
        await turns()

    texts, frames = with_page(test)
    assert texts == ["recording: none", "closed"]
    views = [HEADER.unpack_from(frame) for frame in frames]
    assert [number for _, number, _, kind in views if kind == FrameKind.VIEW] == [7]


def test_rows_and_a_new_line_go_out_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not when the server looks again: it does so once in an hour here."""
    monkeypatch.setattr(module, "_STATES_PER_S", 1 / (60 * PATIENCE_S))
    bench = begun(f"{SOURCE}&idle=60", tmp_path)
    lines, rows = [""], 0
    with client(bench) as page, page.websocket_connect("/ws") as socket:
        while lines[-1] != "ready":  # the end of the first baseline, told with the rows of it
            message = socket.receive()
            rows += len(times(message["bytes"])) if message.get("bytes") else 0
            if message.get("text") and (told := json.loads(message["text"]))["type"] == "state":
                lines.append(told["line"]["what"])
    bench.measurement.close()
    assert (rows > 0, len(lines) < 20) == (True, True)


def test_a_touch_goes_out_when_it_has_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With its session, and again when it is revised; no page asks, and the server looks once in an hour."""
    monkeypatch.setattr(module, "_STATES_PER_S", 1 / (60 * PATIENCE_S))
    bench = begun(f"{OWN_FILE}?speed=20", tmp_path, record=False)
    kinds = []
    revised: list[bool] = []
    with client(bench) as page, page.websocket_connect("/ws") as socket:
        while revised[:2] != [False, True]:
            message = socket.receive()
            told = json.loads(message.get("text") or "{}")
            if told.get("rows"):
                kinds.append(told["type"])
                revised += [row["revised"] for row in told["rows"]]
            elif told.get("type") == "session":
                kinds.append(told["count"]["kept"])
    bench.measurement.close()
    assert kinds[-1] == "touches"
    assert bench.measurement.touches
