"""Times of the rows: their unit, dates, times of day; what is no time is refused, what is open is asked."""

from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from palpate.errors import RecordingError
from palpate.importers.table import ColumnData, Table
from palpate.importers.table_checks import typical_step
from palpate.importers.times import Times, read_times

ROW = np.arange(200)
STEP_US = 26_041
SECOND = ROW * STEP_US / 1e6
DATE = 1_763_726_400
BEGUN = datetime(2025, 11, 21, 12, 0, 0, 0, UTC)


def read(cells: Any, name: str = "time", *, unit: str = "", time_unit: str | None = None) -> Times:
    cells = cells if isinstance(cells, np.ndarray) else np.array(cells, object)
    data = ColumnData(name, cells, unit)
    table = Table(Path("t.csv"), [data], range(2, 2 + len(cells)))
    return read_times(table.columns[0], time_unit)


def stamps(form: str, begun: datetime = BEGUN) -> list[str]:
    return [(begun + timedelta(seconds=float(t))).strftime(form) for t in SECOND]


@pytest.mark.parametrize(
    ("cells", "name", "notation", "utc"),
    [
        (SECOND, "t_s", "s", False),
        (SECOND * 1e3, "t [ms]", "ms", False),
        (ROW * STEP_US, "micros", "us", False),
        (SECOND, "time", "s (by its steps)", False),
        (ROW * STEP_US * 1000, "time", "ns (by its steps)", False),
        (DATE + SECOND, "time", "s since 1970 (UTC)", True),
        (DATE * 10**9 + ROW * STEP_US * 1000, "time", "ns since 1970 (UTC)", True),
        (stamps("%Y-%m-%d %H:%M:%S,%fZ"), "time", "dates (UTC)", True),
        (stamps("%Y/%m/%d %H:%M:%S.%f"), "time", "dates", False),
        (stamps("%H:%M:%S.%f"), "time", "times of day", False),
        ([f"{int(t // 60):02}:{t % 60:09.6f}" for t in SECOND + 50], "elapsed", "mm:ss", False),
        (
            [f"{30 + int(t // 3600)}:00:{t % 60:09.6f}" for t in SECOND],
            "elapsed",
            "times of day",
            False,
        ),
        ((ROW * STEP_US).astype("m8[us]"), "time", "durations", False),
        (np.datetime64(DATE, "s") + (ROW * STEP_US).astype("m8[us]"), "time", "dates", False),
    ],
)
def test_times_in_any_notation(cells: Any, name: str, notation: str, utc: bool) -> None:
    texts = (
        [repr(cell) for cell in cells.tolist()] if np.asarray(cells).dtype.kind in "if" else cells
    )
    for each in (cells, texts):
        found = read(each, name)
        assert found.seconds - found.seconds[0] == pytest.approx(SECOND, rel=0, abs=1e-6)
        assert (found.notation, found.is_utc) == (notation, utc)
        assert not utc or found.zero_ns == DATE * 10**9


@pytest.mark.parametrize(
    ("cells", "name", "notation", "note"),
    [
        (
            (2**32 - 50 * STEP_US + ROW * STEP_US) % 2**32,
            "micros",
            "us",
            "a counter of 32 bits in us began again 1 time: the times go on",
        ),
        (
            (2**16 - 50 + ROW * 26) % 2**16,
            "t_ms",
            "ms",
            "a counter of 16 bits in ms began again 1 time: the times go on",
        ),
        (
            stamps("%H:%M:%S.%f", BEGUN.replace(hour=23, minute=59, second=58)),
            "time",
            "times of day",
            "the time of day began again 1 time: the times go on",
        ),
        (
            stamps("%m/%d/%Y %I:%M:%S.%f %p", BEGUN.replace(hour=23, minute=59, second=58)),
            "time",
            "dates",
            "",
        ),
        (stamps("%d.%m.%Y %H:%M:%S.%f", BEGUN.replace(day=2)), "time", "dates", ""),
        (
            stamps("%m/%d/%y %I:%M:%S.%f %p", BEGUN.replace(day=2)),
            "time",
            "times of day",
            "11/2/25 is a day of November or of February: only the time of day is used",
        ),
        (stamps("%I:%M:%S.%f %p"), "time", "times of day", ""),
        ([f"{t:.6f} sec" for t in SECOND + 7], "Time", "durations in s", ""),
        ([f"{1e3 * t:.3f} ms" for t in SECOND + 7], "Time", "durations in ms", ""),
        ([f"{t / 10:.8f}D+01" for t in SECOND], "t_s", "s", ""),
    ],
)
def test_times_that_go_on_or_are_written_in_a_way_of_their_own(
    cells: Any, name: str, notation: str, note: str
) -> None:
    found = read(cells, name)
    step = 26_000 if "16 bits" in note else STEP_US
    assert found.seconds - found.seconds[0] == pytest.approx(ROW * step / 1e6, rel=0, abs=2e-6)
    assert (found.notation, found.note) == (notation, note)


def test_whole_numbers_and_dates_lose_no_nanosecond() -> None:
    found = read(DATE * 10**9 + 123_456_789 + ROW * STEP_US * 1000)
    assert (found.seconds.tolist(), found.zero_ns) == (SECOND.tolist(), DATE * 10**9 + 123_456_789)
    assert read(SECOND + 7, "t_s").seconds.tolist() == (SECOND + 7).tolist()
    found = read(np.datetime64(DATE, "s") + (ROW * STEP_US).astype("m8[us]"), unit="UTC")
    assert (found.seconds.tolist(), found.zero_ns, found.is_utc) == (
        SECOND.tolist(),
        DATE * 10**9,
        True,
    )


@pytest.mark.parametrize(
    ("cells", "name", "message"),
    [
        (
            ROW,
            "time",
            r"a median step of 1 in .*, allowed: s \(1 pairs a second\), ms \(1e\+03 pairs a second\)",
        ),
        (ROW * 2, "time", "time_unit: got a median step of 2"),
        (46090.5 + SECOND / 86400, "Time", "time_unit: got a median step of 3.01e-07"),
        (
            SECOND,
            "t_ms",
            r"a median step of 0.026 in .*: s \(38.4 pairs a second\), ms \(3.84e\+04",
        ),
        (
            (DATE + SECOND) // 1,
            "time",
            r"6 different stamps in 200 rows .*--rate 39\.8 from the count",
        ),
        (np.full(20, 7), "t_s", "1 different stamps in 20 rows .*--rate"),
    ],
)
def test_what_is_open_is_asked(cells: Any, name: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        read(cells, name)


def test_an_asked_unit_is_used_as_given() -> None:
    assert read(ROW * 20, time_unit="ms").seconds.tolist() == (ROW / 50).tolist()
    days = read(46090.5 + SECOND / 86400, time_unit="d").seconds
    assert np.abs(days - days[0] - SECOND).max() < 1e-5


@pytest.mark.parametrize(
    ("cells", "line", "reason"),
    [
        (SECOND % 2.6 + 5, 102, "goes back by 2.57 s, and so in 1 rows in all: allowed: one"),
        (SECOND[::-1], 3, "goes back by 0.026 s, and so in 199 rows in all"),
        ((2**32 - 50 * STEP_US + ROW * STEP_US) % 2**31 / 1e6, 52, "in 1 rows in all"),
        (np.array([0.0, 0.026, np.nan, 0.078]), 4, "'nan' in column 1 (t_s) is no time"),
        (["0", "26", "", "78"], 4, "an empty cell in column 1 (t_s) is no time"),
        (["0", "26", "x", "78"], 4, "'x' in column 1 (t_s) is neither a number"),
        (
            stamps("%H:%M:%S.%f")[::-1],
            3,
            "goes back by 0.026 s",
        ),
        (["12:00:00.1", "12:00:00.2", "12:00:60.3"], 4, "is no time; write it as"),
        (["12:00:00.1", "12:00:00.2", "0.3"], 4, "'0.3' in column 1 (t_s) is no time"),
        (["2026-01-01T12:00:00Z", "2026-01-01T12:00:01"], 3, "is another kind of time"),
        (["2026-01-30T12:00:00", "2026-02-30T12:00:01"], 3, "is no time; write it as"),
        (
            ["11/21/2026 12:00:00 PM", "21/11/2026 12:00:01 PM"],
            2,
            "is no time; write it as 2026-11-21",
        ),
        (
            ["2/3/2026 12:00:00", "2/9/2026 12:00:01"],
            2,
            "is no time; write it as 2026-11-21",
        ),
    ],
)
def test_times_that_are_none_are_blamed_by_line(cells: Any, line: int, reason: str) -> None:
    with pytest.raises(RecordingError) as caught:
        read(cells, "t_s")
    assert (caught.value.line, reason in caught.value.reason) == (line, True), caught.value


def test_jitter_and_bursts_of_host_stamps_are_kept() -> None:
    jitter = SECOND.copy()
    jitter[[50, 120]] -= 0.12
    assert read(jitter, "t_s").seconds.tolist() == jitter.tolist()
    bursts = np.cumsum(np.random.default_rng(8).integers(90, 110, 50)) / 1000
    bursts = (bursts[:, None] + np.arange(8) * 1e-6).ravel()  # 8 rows come at once
    assert read(bursts, "t_s").seconds.tolist() == bursts.tolist()
    assert typical_step(bursts) == pytest.approx(0.0125, rel=0.05)


def test_dates_of_both_channels_count_from_one_zero() -> None:
    channels = {"C1": 6 + ROW % 7, "C2": 4 + ROW % 5}
    for later in (-0.013, 0.0, 0.013, 2.5):
        found = palpate.read(
            {"time": DATE + SECOND, "t_soft": DATE + SECOND + later, **channels}, unit="pF"
        )
        assert (found.t_hard_s[0], found.zero_utc_ns) == (0, DATE * 10**9)
        assert found.t_soft_s == pytest.approx(SECOND + later, rel=0, abs=1e-6)


Values: Any = st.lists(st.floats(), min_size=1, max_size=12) | st.lists(
    st.integers(-(2**63), 2**63 - 1), min_size=1, max_size=12
)


@examples(60)
@given(Values, st.sampled_from(["time", "t_s", "t_ms", "micros"]))
def test_any_numbers_are_times_or_an_error(values: list[Any], name: str) -> None:
    cells: list[NDArray[Any]] = [
        np.array(values),
        np.array([repr(value) for value in values], object),
    ]
    for each in cells:
        try:
            found = read(each, name)
        except (RecordingError, ValueError):
            continue
        assert np.isfinite(found.seconds).all()
