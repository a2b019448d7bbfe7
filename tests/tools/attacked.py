"""A live page in a process of its own, measured while others attack it.

python tests/tools/attacked.py RATE FOLDER TOKEN      prints the address; after each line on standard input, the figures

The source is a polled converter: a pair that is not read within its period is replaced by the next one, and is lost.
"""

import asyncio
import json
import math
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from threading import Thread
from typing import Any

import palpate
from palpate import Sample, Source
from palpate.cli.library_logs import library_logs
from palpate.live.recordings import Recordings
from palpate.live.serve import address_of, listen, serve
from palpate.live.server import Server
from palpate.live.session import Session
from palpate.live.workbench import Workbench
from starlette.types import ASGIApp, Receive, Scope, Send

HOST = "127.0.0.1"
_TICK_S = 0.005


class Polled(Source):
    """An endless press, with a given number of pairs per second, in real time."""

    def __init__(self, rate: float) -> None:
        self._rate = rate

    def describe(self) -> dict[str, Any]:
        return {"name": f"polled, {self._rate:g} pairs a second", "period_s": 1 / self._rate}

    def __iter__(self) -> Iterator[Sample]:
        """Return a second without contact, then contact."""
        begun, last = time.monotonic(), -1
        while True:
            time.sleep(max(0.0, begun + (last + 1) / self._rate - time.monotonic()))
            now = time.monotonic() - begun
            n = max(int(now * self._rate), last + 1)
            x = 0.25 * (n > 2 * self._rate) * (1 + 0.02 * math.sin(9.0 * n)) + 1e-4 * math.sin(3.7 * n)
            t = round(now * 1e9)
            yield Sample(n, t, t, -1, -1, 1 + 2.5 * x, 1 + x)
            last = n


class Loop:
    """An application that measures for how long its event loop does nothing else, s."""

    def __init__(self, app: ASGIApp) -> None:
        self._app, self._worst, self._at = app, 0.0, math.inf

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "lifespan":
            await self._app(scope, receive, send)
            return
        watching = asyncio.create_task(self._watch())
        await self._app(scope, receive, send)
        watching.cancel()

    def worst(self) -> float:
        """Return the longest block since the last call, also one that has not ended."""
        worst, self._worst = max(self._worst, time.monotonic() - self._at - _TICK_S), 0.0
        return worst

    async def _watch(self) -> None:
        while True:
            self._at = time.monotonic()
            await asyncio.sleep(_TICK_S)
            self._worst = max(self._worst, time.monotonic() - self._at - _TICK_S)


def figures(session: Session, loop: Loop) -> dict[str, float]:
    """Return counters, rows in the file, memory, MB, and the worst block of the loop since the last call, ms."""
    status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    file = session.recordings.find("run.csv")
    rows = file.read_bytes().count(b"\n") - 1 if file else 0
    peak, now = (int(status[name].split()[0]) / 1024 for name in ("VmHWM", "VmRSS"))
    return {
        **asdict(session.counters),
        "rows": rows,
        "cpu_s": time.process_time(),
        "at_s": time.monotonic(),
        "peak_MB": peak,
        "MB": now,
        "block_ms": 1000 * loop.worst(),
    }


def main() -> int:
    """Serve until standard input ends."""
    rate, folder, token = float(sys.argv[1]), Path(sys.argv[2]), sys.argv[3] or None
    session = Session(lambda: Polled(rate), Recordings(folder / "run.csv"), {"scene": "sliding"})
    with listen(HOST, 0) as listening:
        session.start()
        print(address_of(listening, HOST, token), flush=True)
        loop = Loop(Server(Workbench(session, "polled")).app(HOST, listening.getsockname()[1], token))
        Thread(target=_answer, args=[session, loop], daemon=True).start()
        with suppress(KeyboardInterrupt), library_logs(debug=False):
            serve(loop, listening, token)
    session.close()
    print(json.dumps(figures(session, loop) | {"clean": palpate.check(folder / "run.csv").clean}), flush=True)
    return 0


def _answer(session: Session, loop: Loop) -> None:
    for _ in sys.stdin:
        print(json.dumps(figures(session, loop)), flush=True)


if __name__ == "__main__":
    raise SystemExit(main())
