"""Times of tables that are numbers: their unit by name, by size and by pace; steps, stamps and counters."""

from datetime import datetime
from typing import Any

import numpy as np
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from palpate import RecordingError
from palpate.tables.formats import read_table
from palpate.tables.times.steps import typical_step
from palpate.tables.times.time_units import CANDIDATES
from palpate.tables.times.times import times
from palpate.tables.units import SECONDS
from project import ROOT
from time_tables import ROWS, STEP_US, column, moments, read_times

ROW = np.arange(ROWS)
SECOND = ROW * STEP_US / 1e6
DATE = 1_763_726_400  # s since 1970: 2025-11-21T12:00:00Z


@pytest.mark.parametrize(
    ("name", "cells", "said"),
    [
        ("time", [f"{t:.3f}" for t in SECOND], "s (by its steps)"),
        ("timeA", [f"{t:.3f}" for t in SECOND], "s (by its steps)"),
        ("timestamp", [f"{1e3 * t:.0f}" for t in SECOND], "ms (by its steps)"),
        ("t", [f"{1e6 * t:.0f}" for t in SECOND], "us (by its steps)"),
        ("", [f"{1e9 * t:.0f}" for t in SECOND], "ns (by its steps)"),
        ("time", [f"{0.4 + t / 86400:.10f}" for t in SECOND], "d (by its steps)"),
        ("t_ms", [f"{1e3 * t:.0f}" for t in SECOND], "ms"),
        ("Time (s)", [f"{t:.3f}" for t in SECOND], "s"),
        ("Zeit [ms]", [f"{1e3 * t:.0f}" for t in SECOND], "ms"),
        ("millis", [f"{1e3 * t:.0f}" for t in SECOND], "ms"),
        ("Time (milliseconds)", [f"{1e3 * t:.0f}" for t in SECOND], "ms"),
        ("micros", [f"{1e6 * t:.0f}" for t in SECOND], "us"),
        ("seconds", [f"{t:.3f}" for t in SECOND], "s"),
        ("lsl_timestamp", [f"{54_321 + t:.6f}" for t in SECOND], "s"),
        ("time_ns", [f"{1e9 * t:.0f}" for t in SECOND], "ns"),
        ("minutes", [f"{t / 60:.7f}" for t in SECOND], "min"),
        ("unix", [f"{DATE + t:.6f}" for t in SECOND], "s since 1970 (UTC)"),
        ("time", [str(DATE * 1000 + int(1e3 * t)) for t in SECOND], "ms since 1970 (UTC)"),
        ("time_ms", [str(DATE * 1000 + int(1e3 * t)) for t in SECOND], "ms since 1970 (UTC)"),
        ("time", [str(DATE * 10**6 + int(1e6 * t)) for t in SECOND], "us since 1970 (UTC)"),
        ("time", [str(DATE * 10**9 + int(1e9 * t)) for t in SECOND], "ns since 1970 (UTC)"),
        ("time", [f"{DATE + 2_082_844_800 + t:.6f}" for t in SECOND], "s since 1904 (UTC)"),
        ("time", [f"{45_982.5 + t / 86400:.10f}" for t in SECOND], "Excel days"),
        ("time", [f"{739_942.5 + t / 86400:.10f}" for t in SECOND], "MATLAB days"),
    ],
)
def test_units_by_name_by_size_and_by_pace(name: str, cells: list[str], said: str) -> None:
    found = read_times(cells, name)
    assert found.said == said
    resolution = 1.1e-3 if "ms" in said or "s (" in said or said == "s" else 2e-5  # of the cells
    assert np.abs(found.seconds - found.seconds[0] - SECOND).max() < resolution
    if "UTC" in said:
        assert found.zero_utc_ns is not None
        assert abs(found.zero_utc_ns - DATE * 10**9) < 1000
        assert found.seconds[0] == 0
    else:
        assert found.zero_utc_ns is None


@pytest.mark.parametrize(
    ("name", "cells", "message"),
    [
        (
            "time",
            ["0", "1"],
            "got a median step of 1 in column 1 (time): 1 pair a second if s, 1,000 pairs a second if ms;",
        ),
        ("t", ["0", "1"], "; allowed: time_unit s or ms, or another (--time-unit)"),
        ("index", list(map(str, range(50))), "1 pair a second if s"),
        ("t_ms", [f"{t:.3f}" for t in SECOND], "got ms in the name of column 1 (t_ms), but a median step of 0.026: "),
        (
            "t_ms",
            [f"{t:.3f}" for t in SECOND],
            ": 38,401 pairs a second if ms, 38 pairs a second if s; allowed: time_unit ms or",
        ),
        ("Time (s)", [f"{1e3 * t:.0f}" for t in SECOND], "0.038 pairs a second if s, 38 pairs a second if ms"),
        ("ticks", [str(638 * 10**15 + 10**5 * row) for row in ROW], "allowed: time_unit us or ns, or another"),
        ("time", [f"{row * 1e-4:.4f}" for row in ROW], "10,000 pairs a second if s"),
        ("t", [str(200 * row) for row in ROW], "5 pairs a second if ms, 5,000 pairs a second if us"),  # 0.1 ms
        ("t", [str(2 * row) for row in ROW], "500 pairs a second if ms"),  # 10 ms
    ],
)
def test_an_open_unit_is_asked_for_with_the_pairs_a_second(name: str, cells: list[str], message: str) -> None:
    with pytest.raises(ValueError, match="time_unit: got") as caught:
        read_times(cells, name)
    assert message in str(caught.value)
    assert read_times(cells, name, unit="ns").said == "ns"


@examples(60)
@given(
    st.sampled_from(CANDIDATES),
    st.floats(2, 2000),
    st.sampled_from(["even", "jitter", "bursts", "gap", "equal"]),
    st.integers(0, 2**32 - 1),
)
def test_a_unit_found_by_pace_is_never_wrong(unit: str, rate: float, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    seconds = np.arange(400) / rate
    if kind == "jitter":
        seconds += rng.uniform(0, 0.4 / rate, 400)
    elif kind == "bursts":  # a port hands out some rows at once
        seconds = np.arange(400) // 8 * 8 / rate + np.arange(400) % 8 * 0.1 / rate
    elif kind == "gap":
        seconds[rng.integers(400) :] += rng.uniform(0, 3600)
    elif kind == "equal":
        seconds = np.arange(400) // 2 * 2 / rate + rng.integers(0, 2, 400).cumsum() * 1e-3 / rate
    try:
        found = read_times(seconds / SECONDS[unit], "time")
    except ValueError as asked:
        assert "time_unit" in str(asked)  # noqa: PT017 - either is right
        assert kind in {"bursts", "equal"} or not 10.5 < rate < 480
    else:
        assert found.said.startswith(f"{unit} ")


def test_the_typical_step_holds_with_bursts_gaps_and_equal_stamps() -> None:
    rng = np.random.default_rng(19)
    even = np.arange(1000.0) * 0.01
    assert typical_step(even) == pytest.approx(0.01)
    assert typical_step(np.floor(even)) == pytest.approx(0.01, rel=0.2)
    assert typical_step(np.floor(even / 0.08) * 0.08) == pytest.approx(0.01, rel=0.05)
    assert typical_step(even + rng.uniform(-0.05, 0.05, 1000)) == pytest.approx(0.01, rel=0.05)
    paused = even.copy()
    paused[300:] += 1e4
    assert typical_step(paused) == pytest.approx(0.01)
    assert typical_step(np.array([1.0])) == typical_step(np.array([1.0, 1, 1])) == 0


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        ([DATE + int(t) for t in SECOND], r"whole seconds, 38 rows share one.*--rate 38\.5 from the count"),
        ([int(t) * 1000 for t in SECOND], r"whole seconds.*--rate 38\.5"),
        ([DATE * 1000 + int(t * 10) * 100 for t in SECOND], r"multiples of 0\.1 s, 3\.8 rows share one.*--rate 38\.4"),
        ([7] * 20, r"are all the same, allowed: rate"),
    ],
)
def test_stamps_that_many_rows_share_are_refused_with_the_rate_counted(cells: list[int], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        read_times([str(cell) for cell in cells])


def test_times_in_some_rows_only_are_refused_with_the_rate_counted() -> None:
    cells = [f"{row / 50:.2f}" if row % 10 == 0 else "" for row in range(1650)]
    with pytest.raises(
        ValueError, match=r"got 165 times in 1650 rows in column 1 \(t_s\).*\(--rate 50 from the count\)"
    ):
        read_times(cells, "t_s")


def test_bursts_of_host_stamps_are_no_coarse_stamps() -> None:
    rng = np.random.default_rng(8)
    bursts = np.repeat(np.cumsum(rng.integers(90, 110, 50)), 8) / 1000  # 8 rows come at once, in whole milliseconds
    assert read_times(bursts, "Time (s)").seconds.tolist() == bursts.tolist()


@pytest.mark.parametrize(
    ("name", "turn", "step", "divisor"),
    [
        ("micros", 2**32, 26_041, 1),
        ("millis", 2**32, 26, 1),
        ("t_ms", 2**16, 26, 1),
        ("t_s", 2**32, 26_041, 1e6),
        ("t_s", 2**32, 26, 1e3),
        ("t_ms", 2**32, 26_041, 1e3),
    ],
)
def test_a_counter_that_overflows_is_continued_with_a_note(name: str, turn: int, step: int, divisor: float) -> None:
    counts = (turn - 50 * step - 7 + ROW * step) % turn / divisor
    found = read_times([repr(count) for count in counts.tolist()], name)
    assert np.diff(found.seconds) == pytest.approx(np.diff(found.seconds)[0], rel=1e-4)
    [note] = found.notes
    assert "in line 53: continued there" in note


def test_a_restart_is_no_overflow() -> None:
    counts = np.r_[57_000 + ROW * 26, ROW * 26]  # back from 62.2 s to 0: an overflow at 2**16 ms would be 3.4 s later
    with pytest.raises(RecordingError, match=r"line 202: .* goes back by 62\.2 s"):
        read_times(counts, "t_ms")


def test_seconds_since_midnight_go_on_after_it() -> None:
    found = read_times([f"{(86_398 + t) % 86_400:.3f}" for t in SECOND], "t_s")
    assert found.seconds == pytest.approx(86_398 + SECOND, abs=1e-3)
    assert "after 86400 s" in found.notes[0]


def test_times_of_excel_go_on_after_midnight() -> None:
    days = (0.999977 + SECOND / 86400) % 1
    found = read_times([f"{day:.11f}" for day in days])
    assert np.abs(found.seconds - found.seconds[0] - SECOND).max() < 1e-5
    assert "after 1 d" in found.notes[0]


@pytest.mark.parametrize(
    ("cells", "line", "reason"),
    [
        ([t % 2.6 + 5 for t in SECOND], 102, "goes back by 2.57 s, and so in 1 rows in all: was the logger restarted?"),
        (SECOND[::-1], 3, "fall: newest row first"),
        ([t % 0.5 for t in SECOND], 22, "goes back by 0.474 s, and so in 10 rows"),
        (np.arange(1650) % 60 * 0.016, 62, "and so in 27 rows in all: is it a part of a time, as the milliseconds?"),
        ([0.0, 0.026, float("nan"), 0.078], 4, "'nan' in column 1 (t_s): no time"),
        ([0.0, 0.026, float("inf"), 0.078], 4, "no time"),
        ([0.0, 0.026, 1e10, 1e10], 4, "more than 292 years"),
    ],
)
def test_times_that_are_none_are_blamed_by_line(cells: Any, line: int, reason: str) -> None:
    with pytest.raises(RecordingError) as caught:
        read_times(np.array(cells, float), "t_s")
    assert (caught.value.line, reason in caught.value.reason) == (line, True), caught.value.reason


@pytest.mark.parametrize("cell", ["", "x", "OL", None])
def test_an_empty_or_wrong_cell_is_blamed_by_line(cell: str | None) -> None:
    with pytest.raises(RecordingError) as caught:
        read_times(["0", "26", cell, "78"], "t_ms")
    assert caught.value.line == 4
    assert "column 1 (t_ms)" in caught.value.reason


def test_jitter_of_host_stamps_is_kept_as_it_is() -> None:
    stamps = SECOND.copy()
    stamps[[50, 120]] -= 0.12
    assert read_times(stamps, "Time (s)").seconds.tolist() == stamps.tolist()


@pytest.mark.parametrize("dtype", ["M8[us]", "M8[ns]", "M8[ms]"])
def test_dates_of_data_frames(dtype: str) -> None:
    cells = np.array([row.isoformat() for row in moments()], dtype)
    found = times(column(cells), 0)
    assert np.abs(found.seconds - SECOND).max() <= (1e-3 if "ms" in dtype else 0)
    assert (found.said, found.zero_utc_ns) == ("dates", None)
    zoned = times(column(cells, unit="UTC"), 0)
    assert zoned.zero_utc_ns == (datetime(2026, 11, 21, 23, 59, 58) - datetime(1970, 1, 1)).total_seconds() * 1e9
    cells[7] = "NaT"
    with pytest.raises(RecordingError, match=r"line 9.*NaT.*no time"):
        times(column(cells), 0)


@pytest.mark.parametrize("cells", [[], np.empty(0), np.empty(0, "M8[us]")])
def test_no_rows_have_no_times(cells: Any) -> None:
    assert len(read_times(cells).seconds) == 0


def test_durations_and_whole_numbers_of_data_frames() -> None:
    spans = (ROW * STEP_US).astype("m8[us]")
    assert read_times(spans).seconds.tolist() == SECOND.tolist()
    exact = read_times(DATE * 10**9 + 123_456_789 + ROW * STEP_US * 1000)
    assert exact.seconds.tolist() == SECOND.tolist()
    assert exact.zero_utc_ns == DATE * 10**9 + 123_456_789


def test_both_channels_are_put_on_one_axis() -> None:
    hard = read_times([f"{DATE + t:.3f}" for t in SECOND])
    soft = read_times([f"{DATE + 0.013 + t:.3f}" for t in SECOND]).since(hard)
    assert soft.seconds[0] == pytest.approx(0.013, abs=1e-6)
    assert soft.zero_utc_ns == hard.zero_utc_ns
    relative = read_times([f"{t:.3f}" for t in SECOND])
    assert relative.since(relative) is relative
    for one, other in [(hard, relative), (relative, hard)]:
        with pytest.raises(ValueError, match=r"2025-11-21T12:00:00\.000 to .* allowed: the same kind"):
            one.since(other)


@pytest.mark.parametrize("first", [1, 37, 100, 130])
def test_equal_stamps_of_two_files_are_equal_seconds(first: int) -> None:
    stamps = [f"{1_741_944_413.2 + row / 50:.4f}" for row in range(1650)]
    hard, soft = read_times(stamps), read_times(stamps[first:])
    assert soft.since(hard).seconds.tolist() == hard.seconds[first:].tolist()


@examples(60)
@given(
    st.lists(st.floats(), min_size=1, max_size=12)
    | st.lists(st.integers(-(2**63), 2**63 - 1), min_size=1, max_size=12),
    st.sampled_from(["time", "t_s", "t_ms", "micros"]),
)
def test_any_numbers_are_times_or_an_error(values: list[float] | list[int], name: str) -> None:
    for cells in (np.array(values), [str(value) for value in values]):
        try:
            found = read_times(cells, name)
        except (RecordingError, ValueError):
            continue
        assert np.isfinite(found.seconds).all()


def test_real_recordings_are_read_bit_for_bit(recordings: Any) -> None:
    files = sorted((recordings / "cord").glob("*.csv"))
    assert len(files) == 60
    for path in files:
        table = read_table(path)
        found = times(table, 0)
        assert found.seconds.tolist() == [float(str(cell)) for cell in table.columns[0].cells]
        assert (found.said, found.notes) == ("s", [])


def test_own_recordings_keep_their_times() -> None:
    table = read_table(ROOT / "tests" / "data" / "four-specimens.csv")
    for name in ("t_hard_s", "t_soft_s"):
        index = table.column(name)
        assert times(table, index).seconds.tolist() == [float(str(cell)) for cell in table.columns[index].cells]
