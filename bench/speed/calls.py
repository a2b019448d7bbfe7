"""What `python -m bench.speed` times: native.cpp, and from Python calls, blocks, a tracker, banks, the ring, other libraries."""

import json
import math
import os
import subprocess
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import palpate
from numpy.typing import NDArray
from palpate import reference

from bench.accuracy import rivals

NATIVE = Path(__file__).with_name("native.cpp")
TRUTH = 2.5
CHUNKS = 120
BLOCK = 2000
Array = NDArray[np.float64]


class Work(NamedTuple):
    """A function to be timed, how many items a call has, and what gives it data that it has not seen."""

    name: str
    items: int
    call: Callable[[], Any]
    renew: Callable[[], None] = lambda: None
    error: float | None = None


class Chunks:
    """A block of a long series after the other, from the start again at the end."""

    def __init__(self, size: int, *series: NDArray[Any]) -> None:
        self._size = size
        self._series = series
        self._chunk = -1
        self.renew()

    def renew(self) -> None:
        """Go to the next block, and read it into the cache."""
        self._chunk = (self._chunk + 1) % (len(self._series[0]) // self._size)
        begin = self._chunk * self._size
        self.now = [series[begin : begin + self._size] for series in self._series]
        for block in self.now:
            block.sum()


def timed(works: list[Work], rounds: int) -> dict[str, dict[str, float]]:
    """Time all functions alternately, each once over new data; return minimum and median, ns for each item, and the error."""
    found: dict[str, list[float]] = {work.name: [] for work in works}
    for _ in range(rounds):
        for work in works:
            work.call()
            work.renew()
            start = time.perf_counter_ns()
            work.call()
            found[work.name].append((time.perf_counter_ns() - start) / work.items)
    times = {name: {"min": min(ns), "median": float(np.median(ns))} for name, ns in found.items()}
    return {
        work.name: times[work.name] | ({} if work.error is None else {"error": work.error})
        for work in works
    }


def run(*command: str | Path) -> str:
    """Run a program and return its output."""
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def measure_native(rounds: int) -> dict[str, Any]:
    """Compile native.cpp with the options of the CMake target, and run it; each row has the bytes of its state, too."""
    compiler = os.environ.get("CXX", "c++")
    flags = [
        "-O3",
        "-std=c++17",
        "-ffp-contract=off",
        "-DPALPATE_CONTRACTION_OFF",
        f"-I{palpate.get_include()}",
    ]
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "native"
        run(compiler, *flags, NATIVE, "-o", program)
        rows = json.loads(run(program, str(rounds)))
    return {"compiler": f"{run(compiler, '--version').splitlines()[0]}, -O3", **rows}


def press(size: int) -> tuple[Array, Array]:
    """Return a held press with tremor and converter noise, as in native.cpp."""
    regressor = 0.25 * (1 + 0.03 * np.sin(1.3 * np.arange(size)))
    noise = np.random.default_rng(1).uniform(-0.7e-4, 0.7e-4, size)
    return TRUTH * regressor + noise, regressor


def readings(size: int) -> tuple[NDArray[Any], ...]:
    """Return times, ns, and readings of a long hold, pF, as in native.cpp."""
    k = np.arange(size)
    t_hard = 26_000_000 * k + k % 7 * 50_000
    t_soft = t_hard + 13_000_000
    noise = np.random.default_rng(1).uniform(-0.7e-4, 0.7e-4, (2, size))
    hard, soft = (
        np.where(k < 60, 0.0, 0.25 * (1 + 0.03 * np.sin(50e-9 * t) + 0.01 * np.sin(27e-9 * t)))
        for t in (t_hard, t_soft)
    )
    return t_hard, t_soft, 0.6 + TRUTH * hard + noise[0], soft - 0.4 + noise[1]


def error_of(ratio: Any) -> float:
    """Return the rms of ratio / truth - 1 over the second half."""
    half = np.asarray(ratio)[len(ratio) // 2 :]
    return float(np.sqrt(np.mean((half / TRUTH - 1) ** 2)))


def repeated(call: Callable[[float, Any], Any], b: Any = 0.25) -> Callable[[], None]:
    """Return a loop of 2,000 calls with a float and b: the cost of a call from Python, with its share of the loop."""

    def loop() -> None:
        a = 0.625
        for _ in range(200):
            call(a, b), call(a, b), call(a, b), call(a, b), call(a, b)
            call(a, b), call(a, b), call(a, b), call(a, b), call(a, b)

    return loop


def call_work() -> Iterator[Work]:
    """Yield functions with single calls."""
    checked = palpate.AdaptiveRls().update
    error = error_of(
        [checked(a, b) for a, b in zip(*(values.tolist() for values in press(500)), strict=True)]
    )
    yield Work("Python update", 2000, repeated(palpate.AdaptiveRls().update), error=error)
    yield Work("math.hypot", 2000, repeated(math.hypot))
    for name, row in (("a tuple", (0.25, 1.0)), ("an array", np.array([0.25, 1.0]))):
        yield Work(
            f"Python VectorRls update, {name}", 2000, repeated(palpate.VectorRls(2).update, row)
        )


def block_work() -> Iterator[Work]:
    """Yield functions that process blocks, and the readings of one long touch."""
    y, x = press(BLOCK * CHUNKS)

    def block(name: str, estimator: Any, size: int = BLOCK) -> Work:
        chunks = Chunks(size, y, x)
        out = np.empty(size)
        error = error_of(type(estimator)().process(y[:size], x[:size]))
        return Work(
            f"Python {name}", size, lambda: estimator.process(*chunks.now, out), chunks.renew, error
        )

    yield block("process, 2000", palpate.AdaptiveRls())
    yield block("process, 250", palpate.AdaptiveRls(), 250)
    yield block("Rls process, 2000", palpate.Rls())
    one: Any = palpate.AdaptiveRls()
    traced = Chunks(BLOCK, y, x)
    out = one.trace(*traced.now)
    yield Work("Python trace, 2000", BLOCK, lambda: one.trace(*traced.now, out), traced.renew)
    shape = (156, 64)
    size = 156 * 64

    def streams(estimator: Any) -> Work:
        bank = palpate.Bank(estimator, 64)
        chunks = Chunks(size, y, x)
        ratios = np.empty(shape)
        error = error_of(bank.copy().process(*(a[:size].reshape(shape) for a in (y, x))))

        def update() -> None:
            output, regressor = (a.reshape(shape) for a in chunks.now)
            bank.process(output, regressor, ratios)

        return Work(
            f"Python Bank of 64 {type(estimator).__name__}", size, update, chunks.renew, error
        )

    yield streams(palpate.AdaptiveRls())
    yield streams(palpate.HandoverRls())
    tracker = palpate.Tracker("handheld", samples=None, seconds=None)
    held = Chunks(BLOCK, *readings(BLOCK * 240))
    held.renew()  # each block is seen once: a tracker takes no time twice

    def track() -> None:
        tracker.process(*held.now)
        held.renew()

    yield Work("Python Tracker.process, 2000", BLOCK, track)


def ring_work() -> Iterator[Work]:
    """Yield functions that copy 250 samples from a numpy array through a queue into another array."""
    ring = palpate.SampleRing(512)
    queue = deque[Any]()
    rows = np.zeros(250, ring.dtype)
    out = np.empty(250, ring.dtype)
    rows["seq"] = range(250)

    def by_ring() -> None:
        ring.push_many(rows)
        ring.pop_many(out)

    def by_deque() -> None:
        queue.extend(rows.tolist())
        for i in range(250):
            out[i] = queue.popleft()

    for name, work in (("ring", by_ring), ("deque", by_deque)):
        out["seq"] = -1
        work()
        assert np.array_equal(out["seq"], rows["seq"])
        yield Work(f"Python {name}, 250", 250, work)


def library_work() -> Iterator[Work]:
    """Yield the same task in other libraries, and with the equations of the paper in numpy scalars."""
    y, x = press(500)
    numpy_loop = {"numpy loop": lambda y, x: reference.adaptive_rls(y, x).ratio}
    for name, estimate in (numpy_loop | rivals.installed()).items():
        yield Work(name, 500, lambda run=estimate: run(y, x), error=error_of(estimate(y, x)))  # type: ignore[misc]
    if "simdkalman" in rivals.installed():
        shape = (20, 64)
        output, regressor = (a.reshape(shape) for a in press(math.prod(shape)))
        yield Work(
            "simdkalman, 64 streams", math.prod(shape), lambda: rivals.simdkalman(output, regressor)
        )


def measure_python(rounds: int) -> dict[str, Any]:
    """Time all functions; the slow ones a tenth of the rounds."""
    fast = [*call_work(), *block_work(), *ring_work()]
    return timed(fast, rounds) | timed(list(library_work()), max(3, rounds // 10))
