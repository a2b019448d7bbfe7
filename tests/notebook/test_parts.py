"""A recording at a prompt: its length, its duration, parts of it, its marks, its touches."""

from datetime import timedelta
from typing import Any

import numpy as np
import palpate
import pytest
from hypothesis import given
from hypothesis import strategies as st
from palpate.recording.recording import Mark, Recording
from palpate.recording.sidecar import Sidecar
from project import FOUR

WHOLE = palpate.read(FOUR)


def test_length_and_duration() -> None:
    assert len(WHOLE) == len(WHOLE.hard) == 1411
    assert WHOLE.duration == timedelta(seconds=float(WHOLE.t_soft_s[-1] - WHOLE.t_hard_s[0]))
    assert Recording(*np.zeros((4, 0))).duration == timedelta(0)
    untimed = Recording(*np.full((2, 3), np.nan), *np.ones((2, 3)))
    assert len(untimed) == 3
    with pytest.raises(ValueError, match="duration: got a recording without times"):
        _ = untimed.duration


@given(st.floats(0, 40) | st.none(), st.floats(0, 40) | st.none())
def test_a_part_has_the_rows_between_two_times(begin: float | None, end: float | None) -> None:
    kept = (WHOLE.t_hard_s >= (begin or 0.0)) & (WHOLE.t_hard_s < (np.inf if end is None else end))
    if not kept.any():
        with pytest.raises(
            ValueError, match=r"got no pair, allowed: times from 0\.000 to 36\.673 s"
        ):
            _ = WHOLE[begin:end]
        return
    part = WHOLE[begin:end]
    for name in ("t_hard_s", "t_soft_s", "hard", "soft"):
        assert np.array_equal(getattr(part, name), getattr(WHOLE, name)[kept])
    for name in ("full_scale_pF", "host_stamps", "zero_utc_ns"):
        assert getattr(part, name) == getattr(WHOLE, name)


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        (
            slice(2, 5),
            "recording: got [slice(2, 5, None)], allowed: seconds with a point, as recording[2.0:5.0]",
        ),
        (slice(2.0, 5.0, 0.5), "allowed: seconds with a point"),
        (2.5, "recording: got [2.5], allowed: seconds"),
    ],
)
def test_rows_are_not_taken_for_seconds(asked: Any, told: str) -> None:
    with pytest.raises(TypeError) as error:
        _ = WHOLE[asked]
    assert told in str(error.value)


@given(st.sets(st.integers(1, 99)), st.integers(0, 99), st.integers(1, 100))
def test_gaps_and_marks_stay_at_their_rows(gaps: set[int], begin: int, length: int) -> None:
    t = np.arange(100.0)
    marks = tuple(Mark(float(gap), f"at {gap}") for gap in sorted(gaps))
    whole = Recording(
        t, t, t, t, gap_rows=tuple(sorted(gaps)), marks=(*marks, Mark(float("nan"), "early"))
    )
    part = whole[float(begin) : float(begin + length)]
    assert [part.hard[row] for row in part.gap_rows] == [
        gap for gap in sorted(gaps) if begin < gap < begin + length
    ]
    assert [mark.t_s for mark in part.marks] == [
        gap for gap in sorted(gaps) if begin <= gap < begin + length
    ]


def test_a_mark_with_a_wrong_time_has_none() -> None:
    wrong: list[Any] = ["12", True, None, [1], 10**400, 1e300]
    marks = Sidecar(
        {"marks": [3, "a", *({"t_s": t_s, "text": "x" * 1000} for t_s in wrong), {"t_s": 2}]}
    ).marks
    assert [np.isnan(mark.t_s) for mark in marks] == [True] * len(wrong) + [False]
    assert (len(marks[0].text) < 550, marks[-1].t_s, marks[-1].text) == (True, 2.0, "")
