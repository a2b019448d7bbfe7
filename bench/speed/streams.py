"""The cost of a stream: a file through it, a live source at 100,000 pairs a second, and the time from a sample to its result.

    python -m bench.speed.streams [--rows 200000] [--rounds 5] [--seconds 60] [--latency 5]

A file: CPU and wall time a row over the time of reading its rows (`Recorded.blocks`), side by side in each round; the
quotients are those of the smallest times, and in brackets the medians of the rounds. Live: blocks of 1,000 pairs each
10 ms, recorded. Latency: from the making of a sample to its estimate, at 1,000 single samples a second and in blocks.
"""

import argparse
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
import palpate
from numpy.typing import NDArray
from palpate import Sample, Source, Stream
from palpate.recording.foreign import recorded
from palpate.recording.recorder import Recorder
from palpate.samples import Block, blank, samples_of

from bench.speed.__main__ import commit, processor

CPU_GOAL, RECORDED_GOAL = 10.0, 20.0


def pairs(count: int, period_ns: int, first: int = 0) -> Block:
    """Return samples of presses of 250 pairs, each after 250 pairs without contact, with some noise."""
    block = blank(count)
    block["seq"] += first
    seq = block["seq"]
    block["t_hard_ns"] = seq * period_ns
    block["t_soft_ns"] = block["t_hard_ns"] + period_ns // 2
    noise = np.random.default_rng(first)
    press = np.where(seq // 250 % 2, 0.25 * (1 + 0.02 * np.sin(0.1 * seq)), 0.0)
    block["hard"] = 1 + 2.5 * press + 1e-4 * noise.standard_normal(count)
    block["soft"] = 1 + press + 1e-4 * noise.standard_normal(count)
    return block


def file_of(path: Path, rows: int) -> Path:
    """Write a recording."""
    recorder = Recorder(path, {"name": "made"}, {}, [])
    for sample in samples_of(pairs(rows, 26_000_000)):
        while recorder.is_behind:
            time.sleep(0.001)
        recorder.push(sample)
    recorder.close()
    return path


def through(path: Path, **how: Any) -> None:
    """Send a file through a stream, in batches."""
    with Stream(str(path), **how) as stream:
        for _ in stream.batches():
            pass
    counters = stream.counters
    if counters.read != counters.delivered or (how and counters.recorded != counters.read):
        raise RuntimeError(f"{path}: {counters}")


def one_by_one(path: Path) -> None:
    """Send a file through a stream, an estimate for each sample."""
    with Stream(str(path)) as stream:
        for _ in stream:
            pass


def timed(work: Callable[[], object]) -> tuple[float, float]:
    """Return CPU and wall time, s."""
    cpu, wall = time.process_time(), time.perf_counter()
    work()
    return time.process_time() - cpu, time.perf_counter() - wall


def files(rows: int, rounds: int) -> None:
    """Print the cost of a file through a stream."""
    with tempfile.TemporaryDirectory() as folder:
        path = file_of(Path(folder) / "made.csv", rows)
        copies = iter(Path(folder) / f"{number}.csv" for number in range(rounds))
        works: dict[str, Callable[[], object]] = {
            "its rows read": lambda: sum(map(len, recorded(path).blocks())),
            "through a stream": lambda: through(path),
            "through a stream, recorded": lambda: through(path, record=next(copies)),
            "an Estimate for each sample": lambda: one_by_one(path),
        }
        times = np.array([[timed(work) for work in works.values()] for _ in range(rounds)])
    least, middle = times.min(axis=0), np.median(times, axis=0)
    goals = {"through a stream": CPU_GOAL, "through a stream, recorded": RECORDED_GOAL}
    print(f"{rows} rows, {rounds} rounds      us a row: CPU  wall    over the time of reading: CPU         wall")
    for k, name in enumerate(works):
        ratios, medians = least[k] / least[0], middle[k] / middle[0]
        goal = f"  at most {goals[name]:g}" if name in goals else ""
        cells = "  ".join(f"{r:5.2f} ({m:.2f})" for r, m in zip(ratios, medians, strict=True))
        print(f"{name:30} {1e6 * least[k, 0] / rows:12.3f} {1e6 * least[k, 1] / rows:6.3f}  {cells:>36}{goal}")


class Fast(Source):
    """Pairs in real time, in blocks: those of 10 ms each time."""

    def __init__(self, rate: int, count: int, every_s: float = 0.01) -> None:
        self._period_ns, self._count, self._every_s = 10**9 // rate, count, every_s
        self._size = round(rate * every_s)
        self._made = pairs(self._size, self._period_ns)
        self._next, self._begun = 0, 0.0
        self._stopped = Event()
        self.made_s: dict[int, float] = {}

    def describe(self) -> dict[str, Any]:
        """Return the period."""
        return {"name": "made in blocks", "period_s": self._period_ns / 1e9}

    def read_block(self) -> Block:
        """Return the next pairs, when they are due."""
        self._begun = self._begun or time.monotonic() - self._next / self._size * self._every_s
        due = self._begun + (self._next + self._size) / self._size * self._every_s
        if self._stopped.wait(max(due - time.monotonic(), 0)) or self._next >= self._count:
            return self._made[:0]
        block = self._made.copy()
        for name in ("seq", "t_hard_ns", "t_soft_ns"):
            block[name] += self._next * (1 if name == "seq" else self._period_ns)
        self._next += self._size
        self.made_s[int(block["seq"][-1])] = time.monotonic()
        return block

    def __iter__(self) -> Iterator[Sample]:
        """Return the pairs."""
        while len(block := self.read_block()):
            yield from samples_of(block)

    def interrupt(self) -> None:
        """Stop."""
        self._stopped.set()


class Slow(Fast):
    """The same pairs as single samples."""

    def __iter__(self) -> Iterator[Sample]:
        """Return the pairs."""
        return super().__iter__()


def live(rate: int, seconds: float) -> None:
    """Print what of a fast live source is lost, and what it costs."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "live.csv"
        source = Fast(rate, round(rate * seconds))
        cpu, wall = time.process_time(), time.perf_counter()
        with Stream(source, record=path) as stream:
            for _ in stream.batches():
                pass
        cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
        counters, clean = stream.counters, palpate.check(path).clean
    print(f"live, {rate} pairs a second in blocks, recorded, {wall:.1f} s: read {counters.read}, dropped {counters.dropped}, "
          f"unrecorded {counters.unrecorded}, late {counters.late}, CPU {cpu / wall:.1%} of a core, clean {clean}")  # fmt: skip


def ages_ms(source: Fast) -> NDArray[np.float64]:
    """Return the time from the making of each block's last sample to its estimate."""
    found = []
    with Stream(source) as stream:
        for estimate in stream:
            if (made_s := source.made_s.get(estimate.sample.seq)) is not None:
                found.append(time.monotonic() - made_s)
    return np.array(found) * 1e3


def latency(seconds: float) -> None:
    """Print how old an estimate is."""
    for name, source in (
        ("single samples", Slow(1000, round(1000 * seconds), every_s=0.001)),
        ("blocks of 10", Fast(1000, round(1000 * seconds))),
    ):
        ages = ages_ms(source)
        middle, high = np.percentile(ages, [50, 95])
        print(f"from a sample to its estimate, 1,000 a second, {name}: median {middle:.3f} ms, 95 % {high:.3f} ms")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--rows", type=int, default=200_000, help="of the file")
    parser.add_argument("--rounds", type=int, default=5, help="of the file through a stream")
    parser.add_argument("--rate", type=int, default=100_000, help="pairs a second of the live source")
    parser.add_argument("--seconds", type=float, default=60.0, help="of the live source; 0: none")
    parser.add_argument("--latency", type=float, default=5.0, help="seconds of the measurement of latency; 0: none")
    options = parser.parse_args()
    print(f"{processor()}; commit {commit()}")
    if options.rounds:
        files(options.rows, options.rounds)
    if options.seconds:
        live(options.rate, options.seconds)
    if options.latency:
        latency(options.latency)


if __name__ == "__main__":
    main()
