"""Runs the simulated board: what `palpate record` makes of it, what it prints, and what its chip converted."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import reduce
from operator import xor
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

LIMIT_S = 3600
"""For anything, however busy the machine is. The board itself ends if its sketch is too slow in simulated time."""


def wait(ready: Callable[[], object]) -> None:
    """Wait until something holds."""
    until = time.monotonic() + LIMIT_S
    while not ready():
        assert time.monotonic() < until
        time.sleep(0.1)


@contextmanager
def board(built: Path, folder: Path, pairs: int, *events: str) -> Iterator[Path]:
    """Give the port of a board; at the end, check that it did with its chip only what the data sheet allows."""
    link, log = folder / "port", folder / "log"
    command: list[str | Path] = [built / "board", built / "sketch.elf", link, log, str(pairs), *events]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as process:
        try:
            wait(link.is_symlink)
            yield link
            assert process.wait(LIMIT_S) == 0
        finally:
            process.kill()


def record(built: Path, folder: Path, pairs: int) -> NDArray[Any]:
    """Record pairs of a board with the command line; return the rows, as a structured array with the CSV's names."""
    path = folder / "run.csv"
    command = [sys.executable, "-m", "palpate", "record"]
    with board(built, folder, pairs) as port, (folder / "said").open("w") as said:
        with subprocess.Popen([*command, f"serial:{port}", "-o", path], stdout=said, stderr=said) as process:
            try:
                wait(lambda: process.poll() is not None or _last_seq(path) >= pairs - 1)
                process.send_signal(signal.SIGINT)
                code = process.wait(LIMIT_S)
            finally:
                process.kill()
        assert code == 130, (folder / "said").read_text()
    rows: NDArray[Any] = np.genfromtxt(path, delimiter=",", names=True)
    return rows


def _last_seq(path: Path) -> int:
    if not path.exists():
        return -1
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - 400))
        begins = re.findall(rb"\n(\d+),", file.read())
    return int(begins[-1]) if begins else -1


def conversions(folder: Path) -> NDArray[Any]:
    """Return what the chip converted: `middle_us`, `input` (1, 2) and `code`, shape (n,)."""
    made: NDArray[Any] = np.loadtxt(folder / "log", delimiter=",", dtype="f8,i4,i8")
    made.dtype.names = ("middle_us", "input", "code")
    return made


def lines(port: Path, count: int, send: Callable[[int, IO[bytes]], None] = lambda *_: None) -> Iterator[str]:
    """Yield all lines until there were `count` pairs; call `send` with the number of each pair and the port."""
    with os.fdopen(os.open(port, os.O_RDWR | os.O_NOCTTY), "r+b", buffering=0) as end:
        pairs, rest = 0, b""
        while pairs < count:
            *whole, rest = (rest + end.read(4096)).split(b"\n")
            for line in whole:
                pairs += line.startswith(b"seq=")
                if line.startswith(b"seq="):
                    send(pairs, end)
                yield line.decode("ascii").rstrip("\r")


def fields(line: str) -> dict[str, int]:
    """Return the fields of a line, whose sum must be right."""
    text, told = line.split("*")
    assert int(told, 16) == reduce(xor, text.encode()), line
    return {name: int(value) for name, value in (field.split("=") for field in text.split(","))}
