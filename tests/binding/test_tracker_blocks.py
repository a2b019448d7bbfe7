"""The tracker's blocks and times: the same bits as single readings, at any start, in any thread."""

import sys
import threading
import time
from itertools import count, pairwise
from typing import Any

import numpy as np
import palpate
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from measure import bits
from palpate.simulation import scenarios
from tracking import SCENES, process


@pytest.mark.parametrize("scene", SCENES)
@given(cuts=st.lists(st.integers(0, 403), max_size=4), name=st.sampled_from(["tremor", "dropouts", "spikes"]))
def test_readings_and_blocks_give_the_same_bits(scene: Any, cuts: list[int], name: str) -> None:
    run = scenarios.run(name, 3)
    columns = run.t_hard_s, run.t_soft_s, run.hard, run.soft
    whole, rows = process(scene, run)
    split = palpate.Tracker(scene)
    edges = [0, *sorted(cuts), len(run.hard)]
    parts = [split.process(*(c[a:b] for c in columns)) for a, b in pairwise(edges)]
    split.finish()
    assert bits(np.concatenate(parts)) == bits(rows)
    single = palpate.Tracker(scene)
    ended = [t for t in (single.feed(*map(float, row)) for row in zip(*columns, strict=True)) if t is not None]
    last = single.finish()
    assert whole.touches == split.touches == single.touches
    at_once = ended + ([last] if last else [])
    assert [t.first_ratio for t in at_once] == [t.first_ratio for t in single.touches]
    assert [t for t in single.touches if not t.revised] == [
        t for t, later in zip(at_once, single.touches, strict=True) if not later.revised
    ]


@pytest.mark.parametrize("scene", SCENES)
def test_nanoseconds_are_seconds(scene: Any) -> None:
    run = scenarios.run("tremor", 1)
    hard, soft = (np.round(t * 1e9).astype(np.int64) for t in (run.t_hard_s, run.t_soft_s))
    _, rows = process(scene, run)
    assert bits(palpate.Tracker(scene).process(hard, soft, run.hard, run.soft)) == bits(rows)


@pytest.mark.parametrize("start", [0.0, 1e5, 1.7e9])
def test_it_does_not_matter_when_a_recording_began(start: float) -> None:
    """Times are integer ticks and only differences become floats: a start of whole seconds changes no bit."""
    run = scenarios.run("tremor", 1)
    hard, soft = (np.round(t * 1e9).astype(np.int64) for t in (run.t_hard_s, run.t_soft_s))
    rows = palpate.Tracker().process(hard, soft, run.hard, run.soft)
    shift = int(start * 1e9)
    later = palpate.Tracker().process(hard + shift, soft + shift, run.hard, run.soft)
    assert bits(rows) == bits(later)


def test_times_that_cannot_be_used_give_no_ratio() -> None:
    run = scenarios.run("tremor", 1)
    standing = np.zeros(len(run.hard))
    [touch] = palpate.touches(palpate.Recording(standing, standing, run.hard, run.soft))
    assert touch.samples == 0
    assert np.isnan(touch.ratio)
    assert touch.refused > 200
    assert {"short", "refused"} <= set(touch.flags)


def test_times_beyond_int64_are_refused() -> None:
    tracker = palpate.Tracker()
    good, late = np.array([0, 26_000_000], np.uint64), np.array([0, 2**63], np.uint64)
    for times, name in (((late, good), "t_hard"), ((good, late), "t_soft")):
        with pytest.raises(ValueError, match=f"{name}: got 9223372036854775808, allowed: times below 2\\*\\*63 ns"):
            tracker.process(*times, [9.0, 9.0], [8.0, 8.0])
    assert tracker.readings == 0
    tracker.process(good, good, [9.0, 9.0], [8.0, 8.0])
    assert tracker.readings == 2


@pytest.mark.parametrize("scene", SCENES)
@examples(20)
@given(cuts=st.lists(st.integers(0, 403), max_size=4), name=st.sampled_from(["tremor", "dropouts", "spikes"]))
def test_blocks_without_rows_give_the_same_touches(scene: Any, cuts: list[int], name: str) -> None:
    run = scenarios.run(name, 3)
    columns = run.t_hard_s, run.t_soft_s, run.hard, run.soft
    whole, rows = process(scene, run)
    split = palpate.Tracker(scene)
    for a, b in pairwise([0, *sorted(cuts), len(run.hard)]):
        split.take(*(c[a:b] for c in columns))
    assert bits(np.array([split.ratio, split.standard_error])) == bits(
        np.array([rows["ratio"][-1], rows["standard_error"][-1]])
    )
    split.finish()
    assert (split.touches, split.readings, split.retaken) == (whole.touches, whole.readings, whole.retaken)


@pytest.mark.parametrize("start_ns", [-(2**50), -5_000_000_000, 0, 2**50])
def test_seconds_become_the_nearest_nanosecond(start_ns: int) -> None:
    """A half goes away from zero, as of std::llround; of doubles below 2^52 the fraction is exact."""
    run = scenarios.run("tremor", 1)
    part = np.arange(len(run.hard)) % 4 / 4
    seconds = [(np.round(t * 1e9) + start_ns + part) * 1e-9 for t in (run.t_hard_s, run.t_soft_s)]
    exact = [s * 1e9 for s in seconds]
    nearest, cut = ([np.trunc(ns + d * np.sign(ns)).astype(np.int64) for ns in exact] for d in (0.5, 0))
    rows, expected, others = (
        palpate.Tracker().process(hard, soft, run.hard, run.soft) for hard, soft in (seconds, nearest, cut)
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
        with pytest.raises(ValueError, match=f"{name}: got {wrong}, allowed: finite times, s, within 9e9 of 0"):
            getattr(tracker, method)(*spoilt)
        assert (tracker.readings, tracker.touch_count, tracker.state) == (0, 0, "baseline")
        assert bits(tracker.process(*columns)) == bits(palpate.Tracker().process(*columns))


def test_columns_of_any_stride_and_type() -> None:
    run = scenarios.run("tremor", 1)
    columns = run.t_hard_s, run.t_soft_s, run.hard, run.soft
    expected = palpate.Tracker().process(*columns)
    apart = np.empty((len(run.hard), 9))
    apart[:, ::2][:, :4] = np.stack(columns, 1)
    assert bits(palpate.Tracker().process(*(apart[:, i] for i in (0, 2, 4, 6)))) == bits(expected)
    backwards = [column[::-1].copy()[::-1] for column in columns]
    assert bits(palpate.Tracker().process(*backwards)) == bits(expected)
    lists: list[Any] = [column.tolist() for column in columns]
    assert bits(palpate.Tracker().process(*lists)) == bits(expected)
    swapped = [column.astype(">f8") for column in columns]
    assert bits(palpate.Tracker().process(*swapped)) == bits(expected)


@pytest.mark.parametrize(("size", "lets"), [(255, False), (256, True)])
def test_blocks_from_256_readings_on_let_other_threads_run(size: int, *, lets: bool) -> None:
    """With a switch interval that never ends a thread runs only while another one gives the lock away."""
    run = scenarios.run("tremor", 1)
    columns = [column[:size] for column in (run.t_hard_s, run.t_soft_s, run.hard, run.soft)]
    palpate.Tracker().take(*columns)  # the first one in a process gives the lock away once, of any size
    state = {"inside": False, "seen": False, "ended": False}

    def work() -> None:
        end = time.monotonic() + (60 if lets else 0)
        for turn in count():
            if turn >= 300 and time.monotonic() > end:
                break
            tracker = palpate.Tracker()
            state["inside"] = True
            tracker.take(*columns)
            state["inside"] = False
            if state["seen"]:
                break
            time.sleep(0)
        state["ended"] = True

    before = sys.getswitchinterval()
    sys.setswitchinterval(1000)
    try:
        worker = threading.Thread(target=work)
        worker.start()
        while not state["ended"]:
            state["seen"] = state["seen"] or state["inside"]
            time.sleep(0)
        worker.join()
    finally:
        sys.setswitchinterval(before)
    assert state["seen"] is lets


@pytest.mark.parametrize("in_seconds", [False, True])
def test_a_block_lets_other_threads_run_and_refuses_a_second_one(*, in_seconds: bool) -> None:
    run = scenarios.run("tremor", 1)
    repeats = 1000
    hard, soft = np.tile(run.hard, repeats), np.tile(run.soft, repeats)
    times = np.arange(hard.size) * (0.026 if in_seconds else 26_000_000)
    refused: set[str] = set()
    seen: set[int] = set()
    end = time.monotonic() + 60
    while not refused and time.monotonic() < end:  # again, if this thread did not run during the block
        tracker = palpate.Tracker()
        worker = threading.Thread(target=tracker.process, args=(times, times, hard, soft))
        worker.start()
        while worker.is_alive():
            seen.add(tracker.readings)
            try:
                tracker.finish()
            except RuntimeError as error:
                refused.add(str(error))
        worker.join()
    assert refused == {"this tracker is processing a block in another thread: give each thread its own"}
    assert seen <= {0, hard.size}
    alone = palpate.Tracker()
    alone.process(times, times, hard, soft)
    assert alone.touches == tracker.touches
