"""Measures the live page under attack, each beside the same measurement without one, at the same time.

python tests/tools/live_attacks.py [SECONDS] [RATE] [KIND...]      prints a row for each kind

Both servers run side by side, so that what the machine does besides concerns both. Needs /proc of Linux.
"""

import json
import math
import secrets
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple, Self

from attacks import KINDS, Target, fresh

_HERE = Path(__file__).parent
_PATIENCE_S = 60
RATES = (38, 1000)


class Attacked:
    """A server in a process of its own."""

    def __init__(self, rate: float, folder: Path, token: str) -> None:
        folder.mkdir()
        command = [sys.executable, str(_HERE / "attacked.py"), str(rate), str(folder), token]
        self._errors = (folder / "errors").open("w+")
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors, text=True
        )
        assert self._process.stdout
        self.address = self._process.stdout.readline().strip()

    def __enter__(self) -> Self:
        """Return the server."""
        return self

    def __exit__(self, *_: object) -> None:
        """End it, also after an error."""
        for stream in (self._process.stdin, self._process.stdout, self._errors):
            if stream:
                stream.close()
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()

    def figures(self) -> dict[str, Any]:
        """Return the figures up to now; the loop's since the last call."""
        assert self._process.stdin
        assert self._process.stdout
        self._process.stdin.write("\n")
        self._process.stdin.flush()
        return dict(json.loads(self._process.stdout.readline()))

    def end(self) -> tuple[dict[str, Any], str]:
        """End it; return the last figures, and what was printed to standard error."""
        assert self._process.stdout
        self._process.send_signal(signal.SIGINT)
        line = self._process.stdout.readline()
        self._process.wait(_PATIENCE_S)
        self._errors.seek(0)
        return json.loads(line), self._errors.read()


class Measured(NamedTuple):
    """What a measurement lost, of how many pairs, during an attack; and what its page cost.

    `unwritten`: pairs that were read and are not in the file. `fresh_s`: time to open a page; inf: it was refused.
    """

    pairs: int
    late: int
    lost: int
    unwritten: int
    cpu: float
    grown_MB: float
    block_ms: float
    fresh_s: float
    clean: bool
    errors: str


def _measured(
    before: dict[str, Any], after: dict[str, Any], end: tuple[dict[str, Any], str], fresh_s: float
) -> Measured:
    late, lost, read = (after[name] - before[name] for name in ("late", "lost", "read"))
    last, errors = end
    unwritten = last["read"] - last["rows"]
    grown = after["peak_MB"] - before["MB"]
    cpu = (after["cpu_s"] - before["cpu_s"]) / (after["at_s"] - before["at_s"])
    return Measured(read + lost, late, lost, unwritten, cpu, grown, after["block_ms"], fresh_s, last["clean"], errors)


def attacked(kind: str, rate: float, seconds: float) -> tuple[Measured, Measured]:
    """Measure with an attack, and without."""
    with tempfile.TemporaryDirectory() as folder, ExitStack() as running:
        token = secrets.token_urlsafe(24)
        both = [running.enter_context(Attacked(rate, Path(folder, name), token)) for name in ("attacked", "alone")]
        pages = [running.enter_context(_watching(server.address)) for server in both]
        before = [server.figures() for server in both]
        command = [sys.executable, str(_HERE / "attacks.py"), kind, both[0].address, str(seconds)]
        attack = subprocess.Popen(command)
        time.sleep(seconds / 2)
        opened = [_opened(server.address) for server in both]
        assert attack.wait(seconds + _PATIENCE_S) == 0
        after = [server.figures() for server in both]
        for page in pages:
            page.kill()
        ends = [server.end() for server in both]
    with_it, without = map(_measured, before, after, ends, opened)
    return with_it, without


def _opened(address: str) -> float:
    try:
        return fresh(Target(address, _PATIENCE_S))
    except OSError:
        return math.inf


def _watching(address: str) -> "subprocess.Popen[bytes]":
    """Open an honest page, which reads and confirms what it gets."""
    return subprocess.Popen([sys.executable, str(_HERE / "attacks.py"), "honest", address, "100000"])


def main() -> int:
    """Print the table."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 3.0
    rates = [float(sys.argv[2])] if len(sys.argv) > 2 else RATES
    print(f"{'attack, with and (without)':26} {'pairs/s':>8} {'pairs':>7} {'late':>15} {'lost':>15} {'unwritten':>9} {'processor':>11}"
          f" {'MB more':>15} {'block, ms':>17} {'fresh page, s':>15}")  # fmt: skip
    for rate in rates:
        for kind in sys.argv[3:] or KINDS:
            print(row(kind, rate, *attacked(kind, rate, seconds)), flush=True)
    return 0


def row(kind: str, rate: float, it: Measured, alone: Measured) -> str:
    """Return the row of a table."""
    return (
        f"{kind:26} {rate:8g} {it.pairs:7d} {it.late:6d} {f'({alone.late})':>8} {it.lost:6d} {f'({alone.lost})':>8}"
        f" {it.unwritten:9d} {it.cpu:5.0%} {f'({alone.cpu:.0%})':>5} {it.grown_MB:7.1f} {f'({alone.grown_MB:.1f})':>7} {it.block_ms:8.1f} {f'({alone.block_ms:.1f})':>8}"
        f" {it.fresh_s:7.2f} {f'({alone.fresh_s:.2f})':>7}{'' if it.clean else ' NOT CLEAN'} {len(it.errors.splitlines()) or ''}"
    )


if __name__ == "__main__":
    raise SystemExit(main())
