"""Times with few decimals come back to the even grid that they were printed from."""

from io import StringIO
from pathlib import Path

import numpy as np
import palpate
import pytest
from hypothesis import given
from hypothesis import strategies as st
from palpate.importers.rounded_times import even_times
from serial_lines import Sent

RECORDING = palpate.read(Path(__file__).parent.parent / "data" / "four-specimens.csv")
NOTE = "times have steps of 10 ms: smoothed"


@given(rate=st.floats(18, 70), phase=st.floats(0, 1), is_cut=st.booleans())
def test_rounded_times_are_smoothed(*, rate: float, phase: float, is_cut: bool) -> None:
    times = (np.arange(600) + phase) / rate
    rounded = np.floor(times * 100) / 100 if is_cut else np.round(times, 2)
    even = even_times(rounded)
    steps = np.diff(even.seconds)
    assert np.abs(even.seconds - rounded).max() < 0.0051
    # A line within half a step of 600 times: its slope is off by a step in all of them at most.
    assert np.abs(steps - 1 / rate).max() < 0.0101 / 599
    assert even.note in ("", NOTE)


@pytest.mark.parametrize("rate", [115.0, 250.0, 380.0])
def test_equal_times_are_smoothed(rate: float) -> None:
    times = np.arange(500) / rate
    even = even_times(np.round(times, 2))
    assert (np.abs(even.seconds - times).max() < 0.0051, even.note) == (True, NOTE)
    assert (np.diff(even.seconds) > 0).all()


def test_missing_rows_pauses_and_late_stamps() -> None:
    rng = np.random.default_rng(3)
    times = np.arange(3000) / 38
    times[2000:] += 7.4321
    times = times[rng.random(3000) > 0.03]
    late = times + rng.uniform(0, 0.004, len(times))
    for measured in (times, late):
        even = even_times(np.round(measured, 2))
        errors = even.seconds - times
        assert even.note == NOTE
        assert np.abs(errors - np.median(errors)).max() < 0.003


@pytest.mark.parametrize(
    ("times", "note"),
    [
        (np.arange(300) / 38, ""),
        (np.round(np.arange(300) / 38, 3), ""),  # steps are small against the period
        (np.delete(np.arange(300), [9, 50, 99]) / 100, ""),  # the period is a step
        (np.arange(300) * 0.02, ""),
        (
            np.round(np.arange(3000) / 380, 1),
            "",
        ),  # 38 equal times: nothing shows that they are even
        (
            np.round(np.cumsum(np.random.default_rng(1).normal(0.026, 0.004, 300)), 2),
            "times have steps of 10 ms, too coarse for pairs 25.",
        ),
    ],
)
def test_other_times_stay(times: np.ndarray, note: str) -> None:
    even = even_times(times)
    assert even.seconds is times
    assert even.note.startswith(note)
    assert bool(note) == bool(even.note)


def test_touches_with_rounded_times_are_as_with_exact_ones(tmp_path: Path) -> None:
    exact = palpate.touches(RECORDING)
    hard_s = np.round(RECORDING.t_hard_s, 2)
    soft_s = np.round(RECORDING.t_soft_s, 2)
    columns = np.column_stack([hard_s, soft_s, RECORDING.hard, RECORDING.soft])
    text = StringIO()
    np.savetxt(
        text, columns, "%.2f,%.2f,%.6f,%.6f", header="t_s,t_soft_s,hard_pF,soft_pF", comments=""
    )
    path = tmp_path / "rounded.csv"
    path.write_text(text.getvalue())
    later_s = float(np.median(RECORDING.t_soft_s - RECORDING.t_hard_s))
    arrays = palpate.touches(RECORDING.hard, RECORDING.soft, times_s=hard_s, soft_later_s=later_s)
    for touches in (palpate.touches(palpate.read(path)), arrays):
        assert NOTE in touches.notes
        for touch, expected in zip(touches, exact, strict=True):
            assert touch.ratio == pytest.approx(expected.ratio, rel=1e-4)
            assert touch.flags == expected.flags


@pytest.mark.parametrize("rate", [38.0, 115.0])
def test_a_serial_board_with_two_decimals(rate: float) -> None:
    times = np.arange(600) / rate
    lines = [f"t_hard_s={t:.2f},t_soft_s={t + 0.0156:.2f},hard=1.25,soft=2.25" for t in times]
    sent = Sent(lines, times.tolist())
    assert (len(sent.samples), sent.source.counters["errors"]) == (600, 0)
    assert sent.said[-1] == f"tty: {NOTE}"
    hard_s = np.array([sample.t_hard_ns for sample in sent.samples]) / 1e9
    soft_s = np.array([sample.t_soft_ns for sample in sent.samples]) / 1e9
    errors = (hard_s - times)[200:]
    assert np.ptp(errors) < 0.1 / rate  # rounding alone: 0.01, a third of a period and more
    # The mean of 400 rounded differences, each off by 10 ms at most.
    assert np.abs((soft_s - hard_s)[200:] - 0.0156).max() < 0.001


def test_a_line_that_comes_twice_is_still_an_error() -> None:
    lines = [f"t_s={k / 38:.2f},hard=1.25,soft=2.25" for k in range(60)]
    sent = Sent([*lines[:40], lines[39], *lines[40:]], [k / 38 for k in range(61)])
    assert (len(sent.samples), sent.refusals[-1]) == (60, "its time is equal to the one before")
