"""The tracker's blocks and times: the same bits as single readings, at any start, in any thread."""

import threading
from itertools import pairwise
from typing import Any

import numpy as np
import palpate
import pytest
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


def test_a_block_lets_other_threads_run_and_refuses_a_second_one() -> None:
    run = scenarios.run("tremor", 1)
    repeats = 1000
    hard, soft = np.tile(run.hard, repeats), np.tile(run.soft, repeats)
    times = np.arange(hard.size) * 26_000_000
    tracker = palpate.Tracker()
    refused: set[str] = set()
    seen: set[int] = set()
    worker = threading.Thread(target=lambda: tracker.process(times, times, hard, soft))
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
