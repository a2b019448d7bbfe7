"""Files: an own recording read, sent through a stream and recorded, a table of another program, many recordings at once.

    python -m bench.speed.files [--rows 100000] [--rounds 7]

Prints the processor time of a row, minimum and median, beside pandas, and its quotient; then ms for each of many files, one
by one and with `jobs`. All ways take turns. A touch that is not the same bit for bit is an error. Needs the extra tables.
"""

import argparse
import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pandas as pd
from palpate import Stream

from bench.soak.memory import PERIOD_NS, written


def foreign(path: Path, rows: int) -> Path:
    """Write a table of times and two channels with a press every 4 s."""
    random = np.random.default_rng(1)
    t = np.arange(rows) / 38.4
    press = np.clip(np.sin(2 * np.pi * t / 4), 0, None)
    columns = (
        t,
        *(at + by * press + random.normal(0, 2e-4, rows) for at, by in ((6, 0.5), (4, 0.9))),
    )
    table = pd.DataFrame(dict(zip(("time (s)", "C1 (pF)", "C2 (pF)"), columns, strict=True)))
    table.to_csv(path, index=False, float_format="%.6f")
    return path


def through(path: Path, **how: Any) -> None:
    """Send a file through a stream, in batches; nothing may be lost."""
    with Stream(str(path), **how) as stream:
        for _ in stream.batches():
            pass
    counters = stream.counters
    if counters.read != counters.delivered or (how and counters.recorded != counters.read):
        raise RuntimeError(f"{path}: {counters}")


def times(ways: dict[str, Callable[[], Any]], rounds: int) -> dict[str, list[float]]:
    """Return the processor time of all threads, s, of each way in turn, after one run of each."""
    found: dict[str, list[float]] = {name: [] for name in ways}
    for number in range(rounds + 1):
        for name, way in ways.items():
            begin = time.process_time()
            way()
            if number:
                found[name].append(time.process_time() - begin)
    return found


def rows_of_a_file(folder: Path, rows: int, rounds: int) -> None:
    """Print what a row costs; the times of a table are divided by its first one."""
    own = folder / "own.csv"
    other = foreign(folder / "foreign.csv", rows)
    written(own, rows * PERIOD_NS / 3600e9)
    copies = iter(folder / f"copy-{number}.csv" for number in range(rounds + 1))
    tables: dict[str, dict[str, Callable[[], Any]]] = {
        f"own recording, {rows} rows": {
            "pandas.read_csv": lambda: pd.read_csv(own),
            "palpate.read": lambda: palpate.read(own),
            "palpate.touches": lambda: palpate.touches(own),
            "through a stream": lambda: through(own),
            "through a stream, recorded": lambda: through(own, record=next(copies)),
        },
        f"table of another program, {rows} rows": {
            "pandas.read_csv": lambda: pd.read_csv(other),
            "palpate.read": lambda: palpate.read(other),
        },
    }
    for title, ways in tables.items():
        found = times(ways, rounds)
        print(f"{title:40} ns a row  median  / pandas")
        for name, each in found.items():
            least = 1e9 * min(each) / rows
            quotient = min(each) / min(found["pandas.read_csv"])
            print(f"{name:40} {least:8.0f} {1e9 * np.median(each) / rows:7.0f} {quotient:9.2f}")


def many(folder: Path, files: int) -> None:
    """Print ms for each of many files of 10 minutes, one by one and in threads."""
    paths = [folder / f"{number}.csv" for number in range(files)]
    for path in paths:
        written(path, 1 / 6)
    jobs = os.cpu_count() or 1
    ways: dict[str, Callable[[], Any]] = {
        "one by one": lambda: [palpate.touches(path) for path in paths],
        f"jobs={jobs}": lambda: palpate.touches(paths, jobs=jobs),
    }
    expected = [str(touches) for touches in ways["one by one"]()]
    for name, way in ways.items():
        begin = time.perf_counter()
        if [str(touches) for touches in way()] != expected:
            raise SystemExit(f"{name}: other touches than one by one")
        print(f"{files} files, {name}: {1e3 * (time.perf_counter() - begin) / files:.1f} ms a file")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--rows", type=int, default=100_000, help="of each file")
    parser.add_argument("--rounds", type=int, default=7, help="of each way")
    parser.add_argument("--files", type=int, default=32, help="recordings at once")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        rows_of_a_file(Path(name), options.rows, options.rounds)
        many(Path(name), options.files)


if __name__ == "__main__":
    main()
