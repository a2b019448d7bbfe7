"""The tracker's blocks and times: the same bits as single readings, at any start, in any thread."""

import sys
import threading
import time
from itertools import pairwise
from typing import Any

import numpy as np
import palpate
import pytest
from hypothesis import given
from hypothesis import strategies as st
from measure import bits
from numeric import SCENES, process
from palpate.simulation import scenarios


@pytest.mark.parametrize("scene", SCENES)
@given(
    cuts=st.lists(st.integers(0, 403), max_size=4),
    name=st.sampled_from(["tremor", "dropouts", "drift-hard"]),
)
def test_readings_and_blocks_give_the_same_bits(scene: Any, cuts: list[int], name: str) -> None:
    run = scenarios.run(name, 3)
    columns = run.t_hard_s, run.t_soft_s, run.hard, run.soft
    whole, rows = process(scene, run)
    split = palpate.Tracker(scene)
    edges = [0, *sorted(cuts), len(run.hard)]
    parts = [split.process(*(c[a:b] for c in columns)) for a, b in pairwise(edges)]
    split.finish()
    assert bits(np.concatenate(parts)) == bits(rows)
    taken = palpate.Tracker(scene)
    for a, b in pairwise(edges):
        taken.take(*(c[a:b] for c in columns))
    taken.finish()
    single = palpate.Tracker(scene)
    ended = [
        t
        for t in (single.feed(*map(float, row)) for row in zip(*columns, strict=True))
        if t is not None
    ]
    last = single.finish()
    for tracker in (split, taken, single):
        assert (tracker.touches, tracker.revisions_since(0)) == (
            whole.touches,
            whole.revisions_since(0),
        )
    assert (taken.readings, taken.retaken) == (whole.readings, whole.retaken)
    at_once = ended + ([last] if last else [])
    assert [t.first_ratio for t in at_once] == [t.first_ratio for t in single.touches]
    assert [t for t in single.touches if not t.revised] == [
        t for t, later in zip(at_once, single.touches, strict=True) if not later.revised
    ]


@pytest.mark.parametrize("start_ns", [-(2**50), -5_000_000_000, 0, 2**50])
def test_seconds_become_the_nearest_nanosecond(start_ns: int) -> None:
    """A half goes away from zero, as of std::llround; of doubles below 2^52 the fraction is exact."""
    run = scenarios.run("tremor", 1)
    part = np.arange(len(run.hard)) % 4 / 4
    seconds = [(np.round(t * 1e9) + start_ns + part) * 1e-9 for t in (run.t_hard_s, run.t_soft_s)]
    exact = [s * 1e9 for s in seconds]
    nearest, cut = (
        [np.trunc(ns + d * np.sign(ns)).astype(np.int64) for ns in exact] for d in (0.5, 0)
    )
    rows, expected, others = (
        palpate.Tracker().process(hard, soft, run.hard, run.soft)
        for hard, soft in (seconds, nearest, cut)
    )
    assert bits(rows) == bits(expected)
    assert bits(rows) != bits(others)  # a nanosecond more or less is seen


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -9e9, 9e9])
@pytest.mark.parametrize("method", ["process", "take"])
def test_a_block_with_a_wrong_time_is_not_taken(method: str, wrong: float) -> None:
    run = scenarios.run("tremor", 1)
    columns = run.t_hard_s, run.t_soft_s, run.hard, run.soft
    for place, name in enumerate(("t_hard", "t_soft")):
        spoilt = [column.copy() for column in columns]
        spoilt[place][-1] = wrong
        tracker = palpate.Tracker()
        with pytest.raises(
            ValueError, match=f"{name}: got {wrong}, allowed: finite times, s, within 9e9 of 0"
        ):
            getattr(tracker, method)(*spoilt)
        assert (tracker.readings, tracker.touch_count, tracker.state) == (0, 0, "baseline")
        assert bits(tracker.process(*columns)) == bits(palpate.Tracker().process(*columns))


def test_columns_of_any_stride_and_type() -> None:
    run = scenarios.run("tremor", 1)
    columns = run.t_hard_s, run.t_soft_s, run.hard, run.soft
    expected = palpate.Tracker().process(*columns)
    others: list[Any] = [np.stack(columns, 1).T, [column[::-1].copy()[::-1] for column in columns]]
    others += [
        [column.tolist() for column in columns],
        [column.astype(">f8") for column in columns],
    ]
    for other in others:
        assert bits(palpate.Tracker().process(*other)) == bits(expected)


@pytest.mark.parametrize(("size", "lets"), [(255, False), (256, True)])
def test_blocks_from_256_readings_on_let_other_threads_run(size: int, *, lets: bool) -> None:
    """With a switch interval that never ends a thread runs only while another one gives the lock away."""
    run = scenarios.run("tremor", 1)
    columns = [column[:size] for column in (run.t_hard_s, run.t_soft_s, run.hard, run.soft)]
    # the first one in a process gives the lock away once, of any size
    palpate.Tracker().take(*columns)
    ended = threading.Event()
    turns = 0

    def count() -> None:
        nonlocal turns
        while not ended.is_set():
            turns += 1
            time.sleep(0)

    before = sys.getswitchinterval()
    seen = False
    sys.setswitchinterval(1000)
    worker = threading.Thread(target=count)
    try:
        worker.start()
        for _ in range(1_000_000 if lets else 300):
            tracker = palpate.Tracker()
            at = turns
            tracker.take(*columns)
            if seen := turns != at:
                break
            time.sleep(0)
    finally:
        ended.set()
        worker.join()
        sys.setswitchinterval(before)
    assert seen is lets
