"""Cost of the live page: the server's share of a core, and frames per second, at 40, 1,000 and 10,000 pairs per second.

    python -m bench.speed.live_load [--seconds 10]

The page is a client in this process that receives all frames; the server is a separate process. Needs /proc of Linux.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import nullcontext, suppress
from pathlib import Path
from typing import Any

from palpate import Sample, Source
from palpate.live.recordings import Recordings
from palpate.live.serve import address_of, listen, serve
from palpate.live.server import Server
from palpate.live.session import Session
from palpate.live.workbench import Workbench
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

HOST = "127.0.0.1"
CONFIRMED = 4  # as the page does: every fourth frame


class Held(Source):
    """A source of an endless press, with a given number of pairs per second."""

    def __init__(self, rate: float) -> None:
        self._rate = rate

    def describe(self) -> dict[str, Any]:
        """Return the period."""
        return {"name": f"made, {self._rate:g} pairs a second", "period_s": 1 / self._rate}

    def __iter__(self) -> Iterator[Sample]:
        """Return a second without contact, then contact."""
        begun, n = time.monotonic(), 0
        while True:
            time.sleep(max(0.0, begun + n / self._rate - time.monotonic()))
            x = 0.25 * (n > 2 * self._rate) * (1 + 0.02 * math.sin(9.0 * n)) + 1e-4 * math.sin(3.7 * n)
            t = round(n / self._rate * 1e9)
            yield Sample(n, t, t, -1, -1, 1 + 2.5 * x, 1 + x)
            n += 1


def run_server(rate: float) -> None:
    """Serve until interrupted; print the address."""
    session = Session(lambda: Held(rate), Recordings(None), {"scene": "sliding"})
    with listen(HOST, 0) as listening:
        session.start()
        print(address_of(listening, HOST), flush=True)
        with suppress(KeyboardInterrupt):
            serve(Server(Workbench(session, "made")).app(HOST, listening.getsockname()[1]), listening)
    session.close()


class Processes:
    """A process with all that it has started.

    Parameters
    ----------
    pid : int
    """

    def __init__(self, pid: int) -> None:
        self._pid = pid

    def cpu_s(self) -> float:
        """Return their processor time, s."""
        return sum(int(field) for stat in self._stats() for field in stat[11:13]) / os.sysconf("SC_CLK_TCK")

    def resident_MB(self) -> float:
        """Return their resident memory, MB; shared pages count in each."""
        return sum(int(stat[21]) for stat in self._stats()) * os.sysconf("SC_PAGE_SIZE") / 1e6

    def _stats(self) -> list[list[str]]:
        """Return the fields of /proc/PID/stat from the state on."""
        stats = {}
        for path in Path("/proc").glob("[0-9]*/stat"):
            with suppress(OSError):  # it has ended
                stats[int(path.parent.name)] = path.read_text().rsplit(")", 1)[1].split()
        ours = [self._pid]
        for parent in ours:
            ours += [pid for pid, stat in stats.items() if int(stat[1]) == parent]
        return [stats[pid] for pid in ours if pid in stats]


def watch(page: ClientConnection | None, seconds: float) -> tuple[int, dict[str, dict[str, int]]]:
    """Receive frames; return their number, and the last state."""
    frames, end = 0, time.monotonic() + seconds
    state: dict[str, dict[str, int]] = {"counters": {"dropped": 0}, "frames": {"lost": 0}}
    while page is None and time.monotonic() < end:
        time.sleep(0.1)
    while page is not None and time.monotonic() < end:
        message = page.recv()
        if isinstance(message, bytes):
            frames += 1
            if frames % CONFIRMED:
                continue
            page.send(json.dumps({"do": "seen", "frame": int.from_bytes(message[4:8], "little")}))
        elif '"type": "state"' in message:
            state = json.loads(message)
    return frames, state


def measure(rate: float, seconds: float, *, watched: bool) -> dict[str, float]:
    """Run a server, with or without a page; return its share of a core, and frames and pairs per second."""
    server = subprocess.Popen([sys.executable, __file__, "--serve", str(rate)], stdout=subprocess.PIPE, text=True)
    assert server.stdout
    address = server.stdout.readline().strip().rstrip("/")
    with connect(f"{address.replace('http', 'ws')}/ws", origin=Origin(address)) if watched else nullcontext() as page:
        watch(page, 3)
        process = Processes(server.pid)
        begun, cpu = time.monotonic(), process.cpu_s()
        frames, state = watch(page, seconds)
        passed, share = time.monotonic() - begun, process.cpu_s() - cpu
    server.send_signal(2)
    server.wait()
    return {
        "cpu": share / passed,
        "frames": frames / passed,
        "dropped": state["counters"]["dropped"],
        "lost": state["frames"]["lost"],
    }


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description="What the live page costs.")
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--serve", type=float, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.serve:
        run_server(arguments.serve)
        return 0
    print("pairs a second  page   share of a core  frames a second  samples dropped  frames lost")
    for rate in (40, 1000, 10000):
        for watched in (False, True):
            cost = measure(rate, arguments.seconds, watched=watched)
            told = f"{cost['frames']:15.1f}  {cost['dropped']:15.0f}  {cost['lost']:11.0f}" if watched else ""
            print(f"{rate:14d}  {'open' if watched else 'none':4}  {cost['cpu']:15.1%}  {told}", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
