"""Blocks of Tracker from Python, on readings that it has not seen before; and two trackers in two threads.

    python -m bench.speed.tracker_blocks [--blocks 2000]

Prints ns a reading, minimum and median, divided by those of the paper's literal form in C++ over the same readings; and
how much more two threads do than one, in the best and the median round, beside what they can on this
machine. Needs a C++ compiler, as $CXX or c++.
"""

import ctypes
import hashlib
import os
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import click
import numpy as np
import palpate
from numpy.typing import NDArray

HERE = Path(__file__).parent
SIZE = 1000
Columns = tuple[NDArray[Any], ...]


def literal(folder: Path) -> Callable[[Columns], None]:
    """Build the literal form and return a function that sends a block to it."""
    built = folder / "literal_block.so"
    compiler = os.environ.get("CXX", "c++")
    command = [compiler, "-O3", "-std=c++17", "-shared", "-fPIC", "-o", str(built), str(HERE / "literal_block.cpp")]
    subprocess.run(command, check=True)
    block = ctypes.CDLL(str(built)).literal_block
    array = np.ctypeslib.ndpointer(np.float64, flags="C_CONTIGUOUS")
    block.argtypes, block.restype = [array, array, array, ctypes.c_int], ctypes.c_double
    ratios = np.empty(SIZE)
    return lambda columns: block(*columns[4:], ratios, SIZE)


def readings(size: int) -> Columns:
    """Return times of both channels, ns; the channels; and these at the same times without baseline, for the literal form.

    It is a press without end, after 60 readings without contact.
    """
    hard_ns = 26_000_000 * np.arange(size) + np.random.default_rng(1).integers(0, 300_000, size)
    soft_ns = hard_ns + 13_000_000

    def press(ns: NDArray[Any]) -> NDArray[Any]:
        s = ns * 1e-9
        return np.where(np.arange(size) < 60, 0, 0.25 * (1 + 0.03 * np.sin(50 * s) + 0.01 * np.sin(27 * s)))

    noise = np.random.default_rng(2).uniform(-0.7e-4, 0.7e-4, (2, size))
    soft = press(soft_ns) + noise[1]
    hard, hard_then = (2.5 * press(ns) + noise[0] for ns in (hard_ns, soft_ns))
    return hard_ns, soft_ns, hard + 0.6, soft - 0.4, hard_then, soft


def parts(columns: Columns, size: int) -> Iterator[Columns]:
    """Yield all columns in blocks."""
    for begin, end in pairwise(range(0, len(columns[0]) + 1, size)):
        yield tuple(column[begin:end] for column in columns)


def ways() -> dict[str, Callable[[Columns], Any]]:
    """Return functions that send a block to a tracker of their own."""
    scenes: Any = ("handheld", "handheld", "handheld", "paper")
    handheld, in_s, alone, paper = (palpate.Tracker(scene, samples=None) for scene in scenes)
    return {
        "handheld, rows": lambda c: handheld.process(*c[:4]),
        "handheld, rows, times in s": lambda c: in_s.process(c[0] / 1e9, c[1] / 1e9, *c[2:4]),
        "handheld, without rows": lambda c: alone.take(*c[:4]),
        "paper, rows": lambda c: paper.process(*c[:4]),
    }


def in_turn(work: dict[str, Callable[[Columns], Any]], columns: Columns) -> dict[str, NDArray[np.float64]]:
    """Send each block to each function; return ns a reading."""
    times: dict[str, list[float]] = {name: [] for name in work}
    for part in parts(columns, SIZE):
        for name, run in work.items():
            begin = time.perf_counter_ns()
            run(part)
            times[name].append((time.perf_counter_ns() - begin) / SIZE)
    return {name: np.array(found[1:]) for name, found in times.items()}


def gain(work: list[Callable[[Columns], Any]], blocks: list[Columns], rounds: int) -> tuple[float, float]:
    """Return how many times the work of one thread two do in the same time: the best of the rounds, and the median."""

    def run(send: Callable[[Columns], Any]) -> None:
        for block in blocks:
            send(block)

    def seconds(count: int) -> float:
        threads = [threading.Thread(target=run, args=(send,)) for send in work[:count]]
        begin = time.perf_counter()
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        return time.perf_counter() - begin

    found = np.array([(seconds(1), seconds(2)) for _ in range(rounds)])
    return 2 * found[:, 0].min() / found[:, 1].min(), float(np.median(2 * found[:, 0] / found[:, 1]))


def in_threads(columns: Columns, rounds: int) -> Iterator[tuple[str, float, float]]:
    """Yield the gain of two threads by name: of sha256, which needs no lock for long, and of two trackers."""
    text = bytes(500_000)
    yield "sha256", *gain([lambda _: hashlib.sha256(text).digest()] * 2, list(parts(columns, SIZE))[:8], rounds)
    for size in (SIZE, 5 * SIZE, 20 * SIZE):
        trackers = [palpate.Tracker(samples=None) for _ in range(2)]
        blocks = [part[:4] for part in parts(columns, size)][: 40_000 // size]
        sends: list[Callable[[Columns], Any]] = [lambda c, t=t: t.process(*c) for t in trackers]  # type: ignore[misc]
        yield f"handheld, blocks of {size:,}", *gain(sends, blocks, rounds)


@click.command()
@click.option("--blocks", default=2000, show_default=True, type=click.IntRange(min=40), help=f"Blocks of {SIZE}.")
@click.option("--rounds", default=100, show_default=True, type=click.IntRange(min=2), help="Rounds with threads.")
def main(blocks: int, rounds: int) -> None:
    """Print the costs, and their quotients."""
    columns = readings(blocks * SIZE)
    with tempfile.TemporaryDirectory() as folder:
        found = in_turn({"literal": literal(Path(folder))} | ways(), columns)
    gains = list(in_threads(columns, rounds))
    least, median = (measure(found["literal"]) for measure in (np.min, np.median))
    click.echo(f"{'ns a reading':28} {'min':>6} {'median':>7}   / literal")
    for name, ns in found.items():
        low, middle = ns.min(), np.median(ns)
        click.echo(f"{name:28} {low:6.1f} {middle:7.1f}   {low / least:5.2f} {middle / median:5.2f}")
    click.echo(f"\n{'two threads / one':28} {'best':>6} {'median':>7}")
    for name, best, usual in gains:
        click.echo(f"{name:28} {best:6.2f} {usual:7.2f}")


if __name__ == "__main__":
    main()
