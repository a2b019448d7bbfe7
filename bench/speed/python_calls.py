"""The Python part of `python -m bench.speed`: calls, blocks, trackers and the ring."""

import math
from collections import deque
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

import numpy as np
import palpate
from numpy.typing import NDArray

from bench.speed.python_peers import peer_work
from bench.speed.works import CHUNKS, TRUTH, Chunks, Errors, Work, error_of, press, timed


def repeated(call: Callable[[float, float], Any], count: int = 2000) -> Callable[[], None]:
    """Return a loop of calls with two floats: the cost of a call from Python, with its share of the loop."""

    def loop() -> None:
        a, b = 0.625, 0.25
        for _ in range(count // 10):
            call(a, b), call(a, b), call(a, b), call(a, b), call(a, b)
            call(a, b), call(a, b), call(a, b), call(a, b), call(a, b)

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
        Work("Python ring, 250", 250, by_ring),
        Work("Python deque, 250", 250, by_deque),
        Work("Python SimpleQueue, 250", 250, by_simple_queue),
    ]


def block_work() -> tuple[list[Work], Errors]:
    """Return functions that process blocks with the estimators, and the error of each."""
    y, x = press(2000 * CHUNKS)
    work, errors = [], {}

    def add(name: str, estimator: Any, size: int) -> None:
        chunks, out = Chunks(size, y, x), np.empty(size)
        work.append(Work(name, size, lambda: estimator.process(*chunks.now, out), chunks.renew))
        errors[f"error, {name}"] = error_of(type(estimator)().process(y[:size], x[:size]))

    add("Python process, 2000", palpate.AdaptiveRls(), 2000)
    add("Python process, 250", palpate.AdaptiveRls(), 250)
    add("Python Rls process, 2000", palpate.Rls(), 2000)
    add("Python HandoverRls process, 2000", palpate.HandoverRls(), 2000)
    for name, traced in (
        ("Python trace, 2000", palpate.AdaptiveRls()),
        ("Python HandoverRls trace, 2000", palpate.HandoverRls()),
    ):
        work.append(trace_work(name, traced, Chunks(2000, y, x)))
    for name, bank in (
        ("AdaptiveRlsBank", palpate.AdaptiveRlsBank(64)),
        ("HandoverRlsBank", palpate.HandoverRlsBank(64)),
    ):
        named = f"Python {name}(64), 156 rows"
        work.append(bank_work(named, bank, Chunks(156 * 64, y, x)))
        many = (a[: 156 * 64].reshape(156, 64) for a in (y, x))
        errors[f"error, {named}"] = error_of(type(bank)(64).process(*many))
    return work, errors


def trace_work(name: str, estimator: Any, chunks: Chunks) -> Work:
    """Return a function that computes a trace: HandoverRls's has standard errors."""
    rows = estimator.trace(*chunks.now)
    return Work(name, 2000, lambda: estimator.trace(*chunks.now, rows), chunks.renew)


def bank_work(name: str, bank: Any, chunks: Chunks) -> Work:
    """Return a function that updates 64 streams by 156 rows."""
    out = np.empty((156, 64))
    return Work(name, 156 * 64, lambda: bank.process(*(a.reshape(156, 64) for a in chunks.now), out), chunks.renew)


def readings(size: int) -> tuple[NDArray[Any], ...]:
    """Return times, ns, and readings of a long hold, pF, as in series.hpp."""
    k = np.arange(size)
    t_hard = 26_000_000 * k + k % 7 * 50_000
    t_soft = t_hard + 13_000_000
    noise = np.random.default_rng(1).uniform(-0.7e-4, 0.7e-4, (2, size))
    hard, soft = (
        np.where(k < 60, 0.0, 0.25 * (1 + 0.03 * np.sin(50e-9 * t) + 0.01 * np.sin(27e-9 * t)))
        for t in (t_hard, t_soft)
    )
    return t_hard, t_soft, 0.6 + TRUTH * hard + noise[0], soft - 0.4 + noise[1]


def tracker_work() -> list[Work]:
    """Return functions that process the readings of one long touch: all of them are seen once."""
    tracker = palpate.Tracker("handheld", samples=None, seconds=None)
    chunks = Chunks(2000, *readings(2000 * 600))
    return [Work("Python Tracker.process, 2000", 2000, lambda: tracker.process(*chunks.now), chunks.renew, passes=1)]


def call_work() -> tuple[list[Work], Errors]:
    """Return functions with single calls."""
    y, x = press(500)
    estimators = {"Python update": palpate.AdaptiveRls, "Python HandoverRls update": palpate.HandoverRls}
    work = [Work(name, 2000, repeated(make().update)) for name, make in estimators.items()]
    errors = {}
    for name, make in estimators.items():
        update = make().update
        errors[f"error, {name}"] = error_of([update(a, b) for a, b in zip(y.tolist(), x.tolist(), strict=True)])
    return [*work, Work("math.hypot", 2000, repeated(math.hypot))], errors


def measure_python(rounds: int) -> dict[str, Any]:
    """Time all functions."""
    blocks, block_errors = block_work()
    calls, call_errors = call_work()
    peers, peer_errors = peer_work()
    slow = timed(peers, max(3, rounds // 10))
    fast = timed([*calls, *blocks, *tracker_work(), *ring_work()], rounds)
    return fast | slow | block_errors | call_errors | peer_errors
