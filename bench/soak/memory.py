"""Memory of `palpate live` over a long time: it plays a recording at 1,000 pairs a second, as long as it is watched.

    python -m bench.soak.memory [--seconds 3600]

Prints JSON: resident memory after a sixth of the time and at its end, MB, and pairs dropped; exit code 1 if it grew by more than
`ALLOWED_MB`, or if pairs were dropped. Needs /proc of Linux, and the extra live.
"""

import argparse
import json
import os
import sys
import tempfile
import time
from pathlib import Path
from subprocess import DEVNULL, PIPE, Popen
from typing import Any

import numpy as np
from palpate.recording import sidecar
from palpate.recording.writer import Writer
from palpate.samples import blank
from palpate.simulation import scenarios
from websockets.sync.client import connect
from websockets.typing import Origin

PERIOD_NS = 26_000_000
RATE = 1000  # pairs a second
ALLOWED_MB = 24
"""The levels of the page fill in 10 minutes: 64k rows of 49 bytes each."""


def written(path: Path, hours: float) -> int:
    """Write a recording of touches without end; return its rows."""
    run = scenarios.run("four-specimens")
    rows = round(hours * 3600e9 / PERIOD_NS)
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


def resident_MB(pid: int) -> float:
    """Return the resident memory of a process, MB."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def dropped(address: str) -> int:
    """Return how many pairs the measurement has dropped, by the state that a page gets."""
    url = f"{address.replace('http', 'ws')}/ws"
    with connect(url, origin=Origin(address), max_size=None) as page:
        while True:
            message: Any = page.recv()
            if isinstance(message, str) and json.loads(message)["type"] == "state":
                return int(json.loads(message)["counters"]["dropped"])


def measure(path: Path, seconds: float) -> dict[str, float]:
    """Run the server for this time."""
    source = f"{path}?speed={RATE * PERIOD_NS * 1e-9:g}"
    command = [
        sys.executable,
        "-m",
        "palpate",
        "live",
        source,
        "--no-open",
        "--json",
        "--no-token",
        "--port",
        "0",
    ]
    with Popen(command, stdout=PIPE, stderr=DEVNULL, text=True) as server:
        assert server.stdout
        address = json.loads(server.stdout.readline())["address"].rstrip("/")
        time.sleep(seconds / 6)
        early = resident_MB(server.pid)
        time.sleep(seconds * 5 / 6)
        found = {"early_MB": early, "late_MB": resident_MB(server.pid), "dropped": dropped(address)}
        server.terminate()
    return found


def main() -> None:
    """Print what was measured."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seconds", type=float, default=3600)
    seconds = parser.parse_args().seconds
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.csv"
        written(path, (seconds + 60) * RATE * PERIOD_NS / 3600e9)
        found = measure(path, seconds)
    print(json.dumps(found))
    sys.exit(found["late_MB"] - found["early_MB"] > ALLOWED_MB or found["dropped"] > 0)


if __name__ == "__main__":
    main()
