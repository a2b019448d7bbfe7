"""A recording at a prompt: its length, its duration, parts of it, its marks, its touches."""

import json
from datetime import timedelta
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from hypothesis import given
from hypothesis import strategies as st
from palpate.recording.recording import Mark, Recording
from palpate.recording.sidecar import marks_of
from project import ROOT

FOUR = ROOT / "tests" / "data" / "four-specimens.csv"


WHOLE = palpate.read(FOUR)


@pytest.fixture
def whole() -> Recording:
    return WHOLE


def test_length_and_duration(whole: Recording) -> None:
    assert len(whole) == len(whole.hard) == 1411
    assert whole.duration == timedelta(seconds=float(whole.t_soft_s[-1] - whole.t_hard_s[0]))
    assert Recording(*np.zeros((4, 0))).duration == timedelta(0)
    untimed = Recording(*np.full((2, 3), np.nan), *np.ones((2, 3)))
    assert len(untimed) == 3
    with pytest.raises(ValueError, match="duration: got a recording without times"):
        _ = untimed.duration
    with pytest.raises(ValueError, match="duration: got a recording without times"):
        _ = untimed[0.0:1.0]


@given(st.floats(0, 40) | st.none(), st.floats(0, 40) | st.none())
def test_a_part_has_the_rows_between_two_times(begin: float | None, end: float | None) -> None:
    whole = WHOLE
    kept = (whole.t_hard_s >= (begin or 0.0)) & (whole.t_hard_s < (np.inf if end is None else end))
    if not kept.any():
        with pytest.raises(ValueError, match=r"got no pair, allowed: times from 0\.000 to 36\.673 s"):
            _ = whole[begin:end]
        return
    part = whole[begin:end]
    for name in ("t_hard_s", "t_soft_s", "hard", "soft"):
        assert np.array_equal(getattr(part, name), getattr(whole, name)[kept])
    assert (part.full_scale_pF, part.host_stamps, part.zero_utc_ns) == (
        whole.full_scale_pF, whole.host_stamps, whole.zero_utc_ns,
    )  # fmt: skip


def test_a_touch_in_a_part_is_the_touch_of_the_whole(whole: Recording) -> None:
    second = whole.touches()[1]
    [alone] = whole[9.0:18.5].touches()
    assert (alone.start_s, alone.samples) == (second.start_s, second.samples)
    assert abs(alone.ratio - second.ratio) < 3 * second.standard_error


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        (slice(2, 5), "recording[2:5]: got 2, allowed: seconds with a point, as recording[2.0:5.0]"),
        (slice(2.0, 5), "recording[2.0:5]: got 5, allowed: seconds with a point"),
        (slice("2", None), "allowed: seconds with a point"),
        (slice(2.0, 5.0, 0.5), "allowed: seconds, as recording[2.0:5.0]"),
        (3, "recording: got [3], allowed: seconds, as recording[2.0:5.0]"),
        (2.5, "recording: got [2.5], allowed: seconds"),
    ],
)
def test_rows_are_not_taken_for_seconds(whole: Recording, asked: Any, told: str) -> None:
    with pytest.raises(TypeError) as error:
        _ = whole[asked]
    assert told in str(error.value)


def test_the_last_seconds_are_not_a_negative_time(whole: Recording) -> None:
    with pytest.raises(ValueError, match=r"recording\[-5.0:\]: got no pair, allowed: times from 0.000 to 36.673 s"):
        _ = whole[-5.0:]
    early = Recording(whole.t_hard_s - 10, whole.t_soft_s - 10, whole.hard, whole.soft)
    assert len(early[-10.0:0.0]) == 385


@given(st.sets(st.integers(1, 99)), st.integers(0, 99), st.integers(1, 100))
def test_gaps_and_marks_stay_at_their_rows(gaps: set[int], begin: int, length: int) -> None:
    t = np.arange(100.0)
    marks = tuple(Mark(float(gap), f"at {gap}") for gap in sorted(gaps))
    whole = Recording(t, t, t, t, gap_rows=tuple(sorted(gaps)), marks=(*marks, Mark(float("nan"), "early")))
    part = whole[float(begin) : float(begin + length)]
    assert [part.hard[row] for row in part.gap_rows] == [gap for gap in sorted(gaps) if begin < gap < begin + length]
    assert [mark.t_s for mark in part.marks] == [gap for gap in sorted(gaps) if begin <= gap < begin + length]


def test_marks_come_from_the_sidecar(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    with palpate.Stream("sim:stiff-steady?seed=1", record=path) as stream:
        for number, estimate in enumerate(stream):
            if number == 100:
                stream.mark("second specimen")
                wanted = estimate.sample
    marks = palpate.read(path).marks
    assert [mark.text for mark in marks] == ["second specimen"]
    assert marks[0].t_s >= wanted.t_hard_ns / 1e9  # of the last sample that was read
    assert palpate.read(FOUR).marks == ()


@pytest.mark.parametrize("t_s", ["12", True, None, [1], 10**400, 1e300, -1e300])
def test_a_mark_with_a_wrong_time_has_none(t_s: Any) -> None:
    [(time_s, text)] = marks_of({"marks": [{"t_s": t_s, "text": "x" * 1000}]})
    assert np.isnan(time_s)
    assert len(text) < 550
    assert marks_of({"marks": [3, "a", None]}) == []
    assert marks_of(json.loads('{"marks": [{"t_s": 2}]}')) == [(2.0, "")]


def test_touches_are_those_of_the_function(whole: Recording) -> None:
    assert whole.touches() == palpate.touches(whole)
    assert whole.touches(scene="paper", samples=100) == palpate.touches(whole, scene="paper", samples=100)
