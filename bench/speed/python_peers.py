"""The same task with other libraries: what each takes for a sample, and the error of its ratio."""

import math
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np

from bench.peers import (
    PEERS,
    lfilter_ratio,
    numba_block,
    numba_step,
    numpy_loop,
    simdkalman_streams,
    spline_block,
)
from bench.speed.works import CHUNKS, TRUTH, Array, Chunks, Errors, Work, error_of, press

BLOCK = 2000


def numba_loop(step: Any, state: Array) -> Callable[[], None]:
    """Return a loop of calls of a function with its state as arguments, as `repeated` for a method."""

    def loop() -> None:
        a, b = 0.625, 0.25
        for _ in range(200):
            step(state, a, b), step(state, a, b), step(state, a, b), step(state, a, b), step(state, a, b)
            step(state, a, b), step(state, a, b), step(state, a, b), step(state, a, b), step(state, a, b)

    return loop


def sample_work() -> tuple[list[Work], Errors]:
    """Return the libraries that take sample after sample in Python."""
    y, x = press(500)
    peers: dict[str, Any] = {"numpy loop": numpy_loop} | {name: PEERS[name] for name in PEERS if find_spec(name)}
    work, errors = [], {}
    for name, estimate in peers.items():
        work.append(Work(name, 500, lambda estimate=estimate: estimate(y, x)))  # type: ignore[misc]
        errors[f"error, {name}"] = error_of(estimate(y, x)[0])
    return work, errors


def block_work() -> tuple[list[Work], Errors]:
    """Return what takes a whole block at once: scipy's filter, numba, many streams by simdkalman."""
    y, x = press(BLOCK * CHUNKS)
    peers: dict[str, tuple[Callable[..., Any], tuple[int, ...]]] = {}
    if find_spec("scipy"):
        peers["scipy lfilter"] = lfilter_ratio, (BLOCK,)
    if find_spec("numba"):
        peers["numba, block"] = numba_block(), (BLOCK,)
    if find_spec("simdkalman"):
        peers["simdkalman, 64 streams"] = simdkalman_streams, (20, 64)
    work, errors = [], {}
    for name, (estimate, shape) in peers.items():
        work.append(shaped_work(name, estimate, shape, Chunks(math.prod(shape), y, x)))
        first = estimate(*(a[: 10 * math.prod(shape)].reshape(-1, *shape[1:]) for a in (y, x)))[0]
        errors[f"error, {name}"] = error_of(first)
    return work, errors


def shaped_work(name: str, estimate: Callable[..., Any], shape: tuple[int, ...], chunks: Chunks) -> Work:
    """Return a function that estimates block after block."""
    return Work(name, math.prod(shape), lambda: estimate(*(a.reshape(shape) for a in chunks.now)), chunks.renew)


def spline_work() -> tuple[list[Work], Errors]:
    """Return a spline with least squares, offline, on channels of which one is read half a pair after the other."""
    k = np.arange(float(BLOCK * CHUNKS))
    hard, _ = press(BLOCK * CHUNKS)
    chunks = Chunks(BLOCK, k, hard, k + 0.5, 0.25 * (1 + 0.03 * np.sin(1.3 * (k + 0.5))))
    name = "spline and least squares, offline"
    error = abs(spline_block(*chunks.now) / TRUTH - 1)
    return [Work(name, BLOCK, lambda: spline_block(*chunks.now), chunks.renew)], {f"error, {name}": error}


def numba_call_work() -> tuple[list[Work], Errors]:
    """Return numba's step, called for each sample."""
    y, x = press(500)
    step, state = numba_step(), np.array([1.0, 1e-12, 0.0])
    found = [step(state, a, b) for a, b in zip(y.tolist(), x.tolist(), strict=True)]
    return [Work("numba, a call", 2000, numba_loop(step, state))], {"error, numba, a call": error_of(found)}


def peer_work() -> tuple[list[Work], Errors]:
    """Return functions for the same task with other installed libraries, and the error of each."""
    found = [sample_work(), block_work()]
    if find_spec("scipy"):
        found.append(spline_work())
    if find_spec("numba"):
        found.append(numba_call_work())
    work = [piece for pieces, _ in found for piece in pieces]
    return work, {name: error for _, errors in found for name, error in errors.items()}
