"""The Python part of `python -m bench.speed`: calls, blocks and the ring, and the same with other libraries."""

import math
import time
from collections import deque
from collections.abc import Callable, Iterable
from importlib.util import find_spec
from queue import SimpleQueue
from typing import Any

import numpy as np
import palpate
from numpy.typing import NDArray

from bench.peers import PEERS, lfilter_ratio, numba_step, numpy_loop

TRUTH = 2.5
Array = NDArray[np.float64]
Work = tuple[str, int, Callable[[], Any]]


def press(size: int) -> tuple[Array, Array]:
    """Return a held press with tremor and converter noise, as in blocks.cpp."""
    regressor = 0.25 * (1 + 0.03 * np.sin(1.3 * np.arange(size)))
    noise = np.random.default_rng(1).uniform(-0.7e-4, 0.7e-4, size)
    return TRUTH * regressor + noise, regressor


def error_of(ratio: Any) -> float:
    """Return the rms of ratio / truth - 1 over the second half."""
    half = np.asarray(ratio)[len(ratio) // 2 :]
    return float(np.sqrt(np.mean((half / TRUTH - 1) ** 2)))


def repeated(call: Callable[[float, float], Any], count: int = 2000) -> Callable[[], None]:
    """Return a loop of calls with two floats: the cost of a call from Python, with its share of the loop."""

    def loop() -> None:
        a, b = 0.625, 0.25
        for _ in range(count // 10):
            call(a, b), call(a, b), call(a, b), call(a, b), call(a, b)
            call(a, b), call(a, b), call(a, b), call(a, b), call(a, b)

    return loop


def numba_loop(step: Any, state: Array) -> Callable[[], None]:
    """Return the same loop for a function with its state as arguments."""

    def loop() -> None:
        a, b = 0.625, 0.25
        for _ in range(200):
            step(state, a, b), step(state, a, b), step(state, a, b), step(state, a, b), step(state, a, b)
            step(state, a, b), step(state, a, b), step(state, a, b), step(state, a, b), step(state, a, b)

    return loop


def ring_work() -> list[Work]:
    """Return functions that copy 250 samples from a numpy array through a queue into another array."""
    ring, queue, simple = palpate.SampleRing(512), deque[Any](), SimpleQueue[Any]()
    rows, out = np.zeros(250, ring.dtype), np.empty(250, ring.dtype)
    rows["seq"] = range(250)

    def by_ring() -> None:
        ring.push_many(rows)
        ring.pop_many(out)

    def by_deque() -> None:
        queue.extend(rows.tolist())
        for i in range(250):
            out[i] = queue.popleft()

    def by_simple_queue() -> None:
        for row in rows.tolist():
            simple.put(row)
        for i in range(250):
            out[i] = simple.get()

    for work in (by_ring, by_deque, by_simple_queue):
        out["seq"] = -1
        work()
        assert np.array_equal(out["seq"], rows["seq"])
    return [
        ("Python ring, 250", 250, by_ring),
        ("Python deque, 250", 250, by_deque),
        ("Python SimpleQueue, 250", 250, by_simple_queue),
    ]


def block_work() -> tuple[list[Work], dict[str, float]]:
    """Return functions that process blocks with the estimators, and the error of each."""
    (y, x), (y250, x250) = press(10000), press(250)
    out, out250, rows = np.empty(10000), np.empty(250), palpate.AdaptiveRls().trace(y, x)
    adaptive, fixed, handover, bank = (
        palpate.AdaptiveRls(),
        palpate.Rls(),
        palpate.HandoverRls(),
        palpate.AdaptiveRlsBank(64),
    )
    many_y, many_x = (a[:9984].reshape(156, 64) for a in (y, x))
    many_out = np.empty_like(many_y)
    work: list[Work] = [
        ("Python process, 10000", 10000, lambda: adaptive.process(y, x, out)),
        ("Python process, 250", 250, lambda: adaptive.process(y250, x250, out250)),
        ("Python trace, 10000", 10000, lambda: adaptive.trace(y, x, rows)),
        ("Python Rls process, 10000", 10000, lambda: fixed.process(y, x, out)),
        ("Python HandoverRls process, 10000", 10000, lambda: handover.process(y, x, out)),
        ("Python HandoverRls trace, 10000", 10000, handover_trace(y, x)),
        ("Python AdaptiveRlsBank(64), 156 rows", 9984, lambda: bank.process(many_y, many_x, many_out)),
    ]
    errors = {
        "error, Python process, 10000": error_of(palpate.AdaptiveRls().process(y, x)),
        "error, Python Rls process, 10000": error_of(palpate.Rls().process(y, x)),
        "error, Python HandoverRls process, 10000": error_of(palpate.HandoverRls().process(y, x)),
        "error, Python AdaptiveRlsBank(64), 156 rows": error_of(palpate.AdaptiveRlsBank(64).process(many_y, many_x)),
    }
    return work, errors


def handover_trace(y: Array, x: Array) -> Callable[[], Any]:
    """Return a function that computes a trace with standard errors."""
    estimator = palpate.HandoverRls()
    rows = estimator.trace(y, x)
    return lambda: estimator.trace(y, x, rows)


def peer_work() -> tuple[list[Work], dict[str, float]]:
    """Return functions for the same task with other installed libraries, and the error of each."""
    y, x = press(500)
    work: list[Work] = [("numpy loop", 500, lambda: numpy_loop(y, x))]
    errors = {"error, numpy loop": error_of(numpy_loop(y, x)[0])}
    for name in (n for n in PEERS if find_spec(n)):
        work.append((name, 500, lambda estimate=PEERS[name]: estimate(y, x)))  # type: ignore[misc]
        errors[f"error, {name}"] = error_of(PEERS[name](y, x)[0])
    long_y, long_x = press(10000)
    if find_spec("scipy"):
        work.append(("scipy lfilter", 10000, lambda: lfilter_ratio(long_y, long_x)))
        errors["error, scipy lfilter"] = error_of(lfilter_ratio(long_y, long_x)[0])
    if find_spec("numba"):
        step, state = numba_step(), np.array([1.0, 1e-12, 0.0])
        found = [step(state, a, b) for a, b in zip(y.tolist(), x.tolist(), strict=True)]
        errors["error, numba, a call"] = error_of(found)
        work.append(("numba, a call", 2000, numba_loop(step, state)))
    return work, errors


def call_work() -> tuple[list[Work], dict[str, float]]:
    """Return functions with single calls."""
    y, x = press(500)
    estimators = {"Python update": palpate.AdaptiveRls, "Python HandoverRls update": palpate.HandoverRls}
    work: list[Work] = [(name, 2000, repeated(make().update)) for name, make in estimators.items()]
    errors = {}
    for name, make in estimators.items():
        update = make().update
        errors[f"error, {name}"] = error_of([update(a, b) for a, b in zip(y.tolist(), x.tolist(), strict=True)])
    return [*work, ("math.hypot", 2000, repeated(math.hypot))], errors


def timed(work: Iterable[Work], rounds: int) -> dict[str, dict[str, float]]:
    """Time all functions alternately; return minimum, 10th percentile and median, ns for each item."""
    pieces = list(work)
    found: dict[str, list[float]] = {name: [] for name, _, _ in pieces}
    for _ in range(rounds):
        for name, items, call in pieces:
            call()
            for _ in range(3):
                start = time.perf_counter_ns()
                call()
                found[name].append((time.perf_counter_ns() - start) / items)
    quantiles = {name: np.quantile(ns, [0, 0.1, 0.5]) for name, ns in found.items()}
    return {name: dict(zip(("min", "p10", "median"), map(float, q), strict=True)) for name, q in quantiles.items()}


def measure_python(rounds: int) -> dict[str, Any]:
    """Time all functions."""
    blocks, block_errors = block_work()
    calls, call_errors = call_work()
    peers, peer_errors = peer_work()
    slow = timed(peers, max(3, rounds // 10))
    return timed([*calls, *blocks, *ring_work()], rounds) | slow | block_errors | call_errors | peer_errors
