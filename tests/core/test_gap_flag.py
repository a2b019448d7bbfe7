"""The flag of a touch that ended at a gap, or whose baseline was measured after one, until a release confirms it."""

from typing import Any

import numpy as np
import palpate
import pytest
from palpate import Tracker


def press(ends: int, height: float = 0.25, begin: int = 60, size: int = 700) -> tuple[np.ndarray, ...]:
    """Return times and readings of a press from row `begin` to row `ends`."""
    rows = np.arange(size)
    depth = height * np.clip(np.minimum(rows - begin, ends - rows) / 10, 0, 1)
    noise = np.random.default_rng(5).normal(0, 4e-5, (2, size))
    return rows * 0.026, rows * 0.026 + 0.013, 9 + 2.5 * depth + noise[0], 8 + depth + noise[1]


def run(tracker: Tracker, columns: tuple[np.ndarray, ...], begin: int, end: int | None = None) -> None:
    tracker.process(*(column[begin:end] for column in columns))


def test_a_touch_that_runs_at_a_gap_ends_there_with_the_flag() -> None:
    tracker, columns = Tracker(), press(400)
    run(tracker, columns, 0, 200)
    tracker.gap()
    [touch] = tracker.touches
    assert touch.flags[0] == "short"
    assert touch.flags[-1] == "gap"
    assert abs(touch.ratio - 2.5) < 0.01
    assert "lift the probe, and touch again" in palpate.advice(touch)[-1]
    assert tracker.state == "baseline"


def test_a_baseline_of_a_contact_is_flagged_until_the_release_shows_it() -> None:
    """Held at the gap, then pressed deeper: the touch is flagged; lifted: the baseline was that of the contact."""
    tracker = Tracker(seconds=2.0)
    hold, deeper = press(600, 0.2), press(400, 0.1, begin=250)
    columns = *hold[:2], hold[2] + deeper[2] - 9, hold[3] + deeper[3] - 8
    run(tracker, columns, 0, 200)
    tracker.gap()
    run(tracker, columns, 200, 390)
    assert [("gap" in touch.flags) for touch in tracker.touches] == [False, True]  # one before, one after
    tracker = Tracker(seconds=2.0)
    columns = *hold[:2], hold[2] + press(605, 0.1, begin=250)[2] - 9, hold[3] + press(605, 0.1, begin=250)[3] - 8
    run(tracker, columns, 0, 200)
    tracker.gap()
    run(tracker, columns, 200, 590)
    assert "gap" in tracker.touches[-1].flags
    run(tracker, columns, 590)
    assert tracker.touches[-1].revised
    assert tracker.touches[-1].flags[-1] == "baseline"


@pytest.mark.parametrize("scene", ["handheld", "sliding", "paper"])
def test_a_release_confirms_the_baseline_and_a_tare_does(scene: Any) -> None:
    columns = press(300)
    tracker = Tracker(scene)
    tracker.gap()
    run(tracker, columns, 0, 290 if scene != "sliding" else 302)
    tracker.finish()
    assert tracker.touches[-1].flags[-1] == "gap"
    tracker = Tracker(scene)
    tracker.gap()
    run(tracker, columns, 0)
    run(tracker, columns, 0)
    first, second = tracker.touches
    assert ("gap" in first.flags) == (scene == "paper")  # it has no revised result
    assert "gap" not in second.flags
    tracker = Tracker(scene)
    tracker.gap()
    tracker.tare()
    run(tracker, columns, 0, 290)
    tracker.finish()
    assert "gap" not in tracker.touches[-1].flags


def test_the_next_touch_before_a_new_baseline_is_measured_has_the_flag_too() -> None:
    """It uses the old baseline, which may be that of the contact."""
    tracker, (t_hard, t_soft, hard, soft) = Tracker(seconds=1.0), press(150, size=165)
    tracker.gap()
    again = press(180, begin=25, size=400)
    tracker.process(t_hard, t_soft, hard, soft)
    tracker.process(again[0] + t_hard[-1] + 0.026, again[1] + t_hard[-1] + 0.026, *again[2:])
    first = tracker.touches[0]
    assert "gap" in first.flags or first.revised
    assert len(tracker.touches) == 2
