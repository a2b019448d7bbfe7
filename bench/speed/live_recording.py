"""An opened recording of 10 h, and a measurement at 1 kHz: how soon there is a picture, and how memory grows.

    python -m bench.speed.live_recording [--hours 10]

First picture: from the start of the process `palpate live run.csv` to the first view of the whole recording that a
client gets, and to the first one that has all of it. --flat SECONDS: resident memory of a process that measures at
1 kHz, after a sixth of the time and at its end, MB, and pairs dropped; needs /proc of Linux.
"""

import argparse
import json
import os
import tempfile
import time
from pathlib import Path
from subprocess import DEVNULL, PIPE, Popen
from sys import executable

import numpy as np
from palpate.live.feed import HEADER, Kind
from palpate.live.recordings import Recordings
from palpate.live.session import Session
from palpate.recording import sidecar
from palpate.recording.writer import Writer
from palpate.samples import blank
from palpate.simulation import scenarios
from websockets.sync.client import connect
from websockets.typing import Origin

from bench.speed.live_load import Held, Processes

PERIOD_NS = 26_000_000
ROWS = 2560


def written(path: Path, hours: float) -> int:
    """Write a recording of touches without end; return its rows."""
    run, rows = scenarios.run("four-specimens"), round(hours * 3600e9 / PERIOD_NS)
    block = blank(rows)
    block["t_hard_ns"] = np.arange(rows) * PERIOD_NS
    block["t_soft_ns"] = block["t_hard_ns"] + PERIOD_NS // 2
    for name in ("hard", "soft"):
        block[name] = np.resize(getattr(run, name), rows)
    writer = Writer(path, sidecar.fresh({"name": "made"}, {}, []))
    for first in range(0, rows, 4096):
        writer.write(block[first : first + 4096])
    writer.checkpoint({})
    writer.end({}, {"dropped": 0, "counters": {}})
    return rows


def pictures(path: Path) -> dict[str, float]:
    """Return seconds from the start of the process to its address, the first view, and the first whole one."""
    begun = time.monotonic()
    command = [executable, "-m", "palpate", "live", str(path), "--no-open", "--json", "--no-token", "--port", "0"]
    found: dict[str, float] = {}
    with Popen(command, stdout=PIPE, stderr=DEVNULL, text=True) as server:
        assert server.stdout
        address = json.loads(server.stdout.readline())["address"].rstrip("/")
        found["address"] = time.monotonic() - begun
        with connect(f"{address.replace('http', 'ws')}/ws", origin=Origin(address), max_size=None) as page:
            asked, whole = {"do": "view", "id": 1, "from_s": -1, "to_s": 1e9, "rows": ROWS}, False
            page.send(json.dumps(asked))
            while "whole picture" not in found:
                message = page.recv()
                if isinstance(message, str):
                    told = json.loads(message)
                    whole |= told["type"] == "hello" and told["file"]["rows"] > 0
                elif HEADER.unpack_from(message)[3] == Kind.VIEW:
                    if HEADER.unpack_from(message)[2]:
                        found.setdefault("first picture", time.monotonic() - begun)
                    if whole:
                        found["whole picture"] = time.monotonic() - begun
                    time.sleep(0.1)
                    page.send(json.dumps(asked))
        found["resident MB"] = Processes(server.pid).resident_MB()
        found["CPU s"] = Processes(server.pid).cpu_s()
        server.terminate()
    return found


def flat(seconds: float) -> tuple[float, float, int]:
    """Measure at 1 kHz; return resident memory after a sixth of the time and at the end, MB, and pairs dropped."""
    session, this = Session(lambda: Held(1000.0), Recordings(None), {"scene": "sliding"}), Processes(os.getpid())
    session.start()
    time.sleep(seconds / 6)
    early = this.resident_MB()
    time.sleep(seconds * 5 / 6)
    late = this.resident_MB()
    session.close()
    return early, late, session.counters.dropped


def main() -> int:
    """Print the figures."""
    parser = argparse.ArgumentParser(description="An opened recording, and the memory of a measurement.")
    parser.add_argument("--hours", type=float, default=10)
    parser.add_argument("--flat", type=float, metavar="SECONDS")
    arguments = parser.parse_args()
    if arguments.flat:
        print(json.dumps(flat(arguments.flat)))
        return 0
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.csv"
        print(f"{written(path, arguments.hours)} rows, {path.stat().st_size / 1e6:.0f} MB")
        for name, value in pictures(path).items():
            print(f"{name:14} {value:8.2f}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
