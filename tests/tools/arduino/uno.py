"""Runs the simulated board: what a recording has of it, what it prints, and what its chip converted."""

import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from functools import reduce
from operator import xor
from pathlib import Path
from typing import Any

import numpy as np
import palpate
from numpy.typing import NDArray
from recording_bench import soon

LIMIT_S = 3600
"""For the board, however busy the machine is. It ends itself if its sketch is too slow in simulated time."""


@contextmanager
def board(built: Path, folder: Path, pairs: int, *events: str) -> Iterator[Path]:
    """Give the port of a board; at the end, check that it did with its chip only what the data sheet allows."""
    link, log = folder / "port", folder / "log"
    command: list[str | Path] = [built / "board", built / "sketch.elf", link, log, str(pairs), *events]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as process:
        try:
            soon(link.is_symlink)
            yield link
            assert process.wait(LIMIT_S) == 0
        finally:
            process.kill()


def record(built: Path, folder: Path, pairs: int) -> NDArray[Any]:
    """Record pairs of a board; return the rows, as a structured array with the CSV's names."""
    path = folder / "run.csv"
    with board(built, folder, pairs) as port, palpate.Stream(f"serial:{port}", record=path) as stream:
        for batch in stream.batches():
            if len(batch.samples) and batch.samples["seq"][-1] >= pairs - 1:
                break
        stream.close()  # the board ends when nobody has its port open
    rows: NDArray[Any] = np.genfromtxt(path, delimiter=",", names=True)
    return rows


def conversions(folder: Path) -> NDArray[Any]:
    """Return what the chip converted: `middle_us`, `input` (1, 2) and `code`, shape (n,)."""
    made: NDArray[Any] = np.loadtxt(folder / "log", delimiter=",", dtype="f8,i4,i8")
    made.dtype.names = ("middle_us", "input", "code")
    return made


def lines(port: Path, count: int, centre_at: int = 0) -> Iterator[str]:
    """Yield all lines until there were `count` pairs; send the letter c at one of them."""
    with os.fdopen(os.open(port, os.O_RDWR | os.O_NOCTTY), "r+b", buffering=0) as end:
        pairs = 0
        while pairs < count:
            line = end.readline().decode("ascii").rstrip()
            if line.startswith("seq="):
                pairs += 1
                end.write(b"c" * (pairs == centre_at))
            yield line


def fields(line: str) -> dict[str, int]:
    """Return the fields of a line, whose sum must be right."""
    text, told = line.split("*")
    assert int(told, 16) == reduce(xor, text.encode()), line
    return {name: int(value) for name, value in (field.split("=") for field in text.split(","))}
