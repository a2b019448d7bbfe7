"""Functions that `python -m bench.speed` times alternately, with data that is seen once."""

import time
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

TRUTH = 2.5
CHUNKS = 320
Array = NDArray[np.float64]
Errors = dict[str, float]


class Work(NamedTuple):
    """A function to be timed, and how many items a call has.

    `renew` gives it data that it has not seen: before every fourth call, which then is a first pass over them, or
    before every call if `passes` is 1.
    """

    name: str
    items: int
    call: Callable[[], Any]
    renew: Callable[[], None] | None = None
    passes: int = 4


def press(size: int) -> tuple[Array, Array]:
    """Return a held press with tremor and converter noise, as in series.hpp."""
    regressor = 0.25 * (1 + 0.03 * np.sin(1.3 * np.arange(size)))
    noise = np.random.default_rng(1).uniform(-0.7e-4, 0.7e-4, size)
    return TRUTH * regressor + noise, regressor


class Chunks:
    """A block of a long series after the other, from the start again at the end."""

    def __init__(self, size: int, *series: NDArray[Any]) -> None:
        self._size, self._series, self._chunk = size, series, -1
        self.renew()

    def renew(self) -> None:
        """Go to the next block, and read it into the cache."""
        self._chunk = (self._chunk + 1) % (len(self._series[0]) // self._size)
        begin = self._chunk * self._size
        self.now = [series[begin : begin + self._size] for series in self._series]
        for block in self.now:
            block.sum()


def error_of(ratio: Any) -> float:
    """Return the rms of ratio / truth - 1 over the second half."""
    half = np.asarray(ratio)[len(ratio) // 2 :]
    return float(np.sqrt(np.mean((half / TRUTH - 1) ** 2)))


def timed(work: Iterable[Work], rounds: int) -> dict[str, dict[str, float]]:
    """Time all functions alternately; return minimum, 10th percentile and median, ns for each item.

    A name with ", again" has the passes after the first one over the same data.
    """
    pieces = list(work)
    found: dict[str, list[float]] = {}
    for _ in range(rounds):
        for piece in pieces:
            piece.call()
            for k in range(4):
                first = k % piece.passes == 0
                if piece.renew and first:
                    piece.renew()
                start = time.perf_counter_ns()
                piece.call()
                ns = (time.perf_counter_ns() - start) / piece.items
                name = piece.name if first or not piece.renew else f"{piece.name}, again"
                found.setdefault(name, []).append(ns)
    quantiles = {name: np.quantile(ns, [0, 0.1, 0.5]) for name, ns in found.items()}
    return {name: dict(zip(("min", "p10", "median"), map(float, q), strict=True)) for name, q in quantiles.items()}
