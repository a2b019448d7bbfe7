"""Times of tables that are dates, times of day, and elapsed times."""

from collections.abc import Callable
from datetime import UTC, datetime, timedelta, timezone
from fractions import Fraction

import numpy as np
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from palpate import RecordingError
from palpate.tables.table import Table
from palpate.tables.times.times import times
from time_tables import BEGUN, ROWS, STEP_US, column, moments, read_times, texts

EXACT = np.arange(ROWS) * STEP_US / 1e6
MILLISECONDS = np.array([(BEGUN.microsecond + row * STEP_US) // 1000 for row in range(ROWS)]) / 1e3
AFTER_MIDNIGHT = 77  # rows

FORMATS = [
    "%Y-%m-%dT%H:%M:%S.%f",
    "%Y-%m-%d %H:%M:%S.%f",
    "%Y/%m/%d %H:%M:%S,%f",
    "%Y-%m-%dT%H:%M:%S.%fZ",
    "%Y-%m-%d %H:%M:%S.%f UTC",
    "%Y-%m-%dT%H:%M:%S.%f+05:30",
    "%Y-%m-%dT%H:%M:%S.%f-0800",
    "%d.%m.%Y %H:%M:%S,%f",
    "%d.%m.%y %H:%M:%S.%f",
    "%m/%d/%Y %I:%M:%S.%f %p",
    "%d/%m/%Y, %H:%M:%S.%f",
    "%d-%m-%Y %H:%M:%S.%f",
    "%d-%b-%Y %H:%M:%S.%f",
    "%d %b %Y %I:%M:%S.%f%p",
]


@pytest.mark.parametrize("form", FORMATS)
def test_dates_in_many_forms_are_seconds_since_the_first_row(form: str) -> None:
    found = read_times(texts(form))
    assert found.seconds.tolist() == EXACT.tolist()
    assert found.said.startswith("dates")
    assert found.notes == []
    zones = {"Z": 0.0, "UTC": 0.0, "+05:30": 5.5, "-0800": -8.0}
    hours = next((hours for end, hours in zones.items() if form.endswith(end)), None)
    if hours is None:
        assert found.zero_utc_ns is None
    else:
        utc = BEGUN.replace(tzinfo=timezone(timedelta(hours=hours)))
        assert found.zero_utc_ns == int(utc.timestamp()) * 10**9
        assert found.said == "dates (UTC)"


@pytest.mark.parametrize(
    ("form", "first", "said"),
    [
        ("%H:%M:%S.%f", 86_398.0, "times of day"),
        ("%H:%M:%S,%f", 86_398.0, "times of day"),
        ("%I:%M:%S.%f %p", 86_398.0, "times of day"),
        ("%I:%M:%S.%f p.m.", None, ""),
        ("%M:%S.%f", 3598.0, "mm:ss"),
    ],
)
def test_times_of_day_go_on_after_midnight_with_a_note(form: str, first: float | None, said: str) -> None:
    if first is None:  # 11:59:59 p.m. and then 12:00:00 p.m.: twelve hours back
        with pytest.raises(RecordingError, match=r"line 79.* goes back by 4\.32e\+04 s"):
            read_times(texts(form))
        return
    found = read_times(texts(form))
    assert np.abs(found.seconds - first - EXACT).max() < 1e-9
    assert (found.said, found.zero_utc_ns) == (said, None)
    [note] = found.notes
    assert f"in line {2 + AFTER_MIDNIGHT}: continued" in note


def test_a_pause_over_midnight_may_be_long() -> None:
    evening = [text for text in texts("%H:%M:%S.%f", moments(100, datetime(2026, 11, 21, 22)))]
    morning = [text for text in texts("%H:%M:%S.%f", moments(100, datetime(2026, 11, 22, 6)))]
    found = read_times(evening + morning)
    assert found.seconds[100] - found.seconds[0] == 8 * 3600


@pytest.mark.parametrize(
    ("cells", "seconds"),
    [
        (["12:00:00", "12:00:00.5"], [43_200, 43_200.5]),
        (["9:59:59.5", "10:00:00.25"], [35_999.5, 36_000.25]),
        (["59:59.5", "1:00:00.5"], [3599.5, 3600.5]),
        (["75:12.5", "75:13.25"], [4512.5, 4513.25]),
        (["27:00:00.5", "27:00:01.25"], [97_200.5, 97_201.25]),
        (["00:01:02:500", "00:01:02:525", "00:01:03:025"], [62.5, 62.525, 63.025]),
        (["0:1:2:5", "0:1:2:50", "0:1:2:125"], [62.005, 62.05, 62.125]),
        (["0 days 00:00:01.5", "0 days 00:00:02"], [1.5, 2]),
        (["23:59:59.5", "1 day, 0:00:00.25"], [86_399.5, 86_400.25]),
        (["-0:00:00.5", "0:00:00.25"], [-0.5, 0.25]),
        (["12:00:00.123456789", "12:00:00.123456790"], [43_200.123456789, 43_200.12345679]),
        (["2026-11-21", "2026-11-21 00:00:01.5"], [0, 1.5]),
        (["2026-11-21 12:00", "2026-11-21 12:00:00.5"], [0, 0.5]),
        (["11/21/2026 12:59:59.5 AM", "11/21/2026 1:00:00.5 AM"], [0, 1]),
        (["2028-02-29 23:59:59.5", "2028-03-01 00:00:00.5"], [0, 1]),
        (["2026-10-25T02:59:59.5+02:00", "2026-10-25T02:00:00.25+01:00"], [0, 0.75]),
    ],
)
def test_cells_of_a_column_may_differ_in_their_length(cells: list[str], seconds: list[float]) -> None:
    assert read_times(cells).seconds.tolist() == pytest.approx(seconds, abs=1e-11)


def test_nanoseconds_are_kept() -> None:
    found = read_times(["2026-11-21T12:00:00.000000001Z", "2026-11-21T12:00:00.000000004Z"])
    assert found.seconds.tolist() == [0, 3e-9]
    assert found.zero_utc_ns == int(datetime(2026, 11, 21, 12, tzinfo=UTC).timestamp()) * 10**9 + 1


def test_twelve_hours_without_am_and_pm() -> None:
    found = read_times(texts("%I:%M:%S.%f", moments(begun=datetime(2026, 11, 21, 12, 59, 58))))
    assert np.abs(np.diff(found.seconds) - STEP_US / 1e6).max() < 1e-9
    assert "after 43200 s" in found.notes[0]


@pytest.mark.parametrize(
    ("begun", "form", "said", "notes"),
    [
        (datetime(2026, 11, 21, 12), "%d/%m/%Y %H:%M:%S.%f", "dates day/month", 0),
        (datetime(2026, 11, 21, 12), "%m/%d/%Y %H:%M:%S.%f", "dates month/day", 0),
        (datetime(2026, 11, 3, 12), "%m/%d/%Y %H:%M:%S.%f", "dates", 0),  # one day: either order
        (datetime(2026, 11, 3, 23, 59, 58), "%m/%d/%Y %H:%M:%S.%f", "dates month/day", 1),
        (datetime(2026, 11, 3, 23, 59, 58), "%d/%m/%Y %H:%M:%S.%f", "dates day/month", 1),
        (datetime(2026, 11, 12, 23, 59, 58), "%d/%m/%Y %H:%M:%S.%f", "dates day/month", 0),
        (datetime(2026, 11, 3, 23, 59, 58), "%d/%m/%Y %H:%M:%S.%fZ", "dates day/month (UTC)", 1),
    ],
)
def test_day_and_month_are_told_apart_or_it_is_said(begun: datetime, form: str, said: str, notes: int) -> None:
    found = read_times(texts(form, moments(begun=begun)))
    assert found.seconds.tolist() == EXACT.tolist()
    assert (found.said, len(found.notes), found.zero_utc_ns) == (said, notes, None)


@pytest.mark.parametrize(
    ("cells", "line", "reason"),
    [
        (["12:00:00.5", "", "12:00:01"], 3, "'' in column 1 (time) is neither a number nor a time"),
        (["12:00:00.5", None], 3, "the row ends before column 1 (time)"),
        (["12:00:00.5", "noon"], 3, "'noon' in column 1 (time) is neither"),
        (["12:00:00.5", "12:00:00.6\u00b5"], 3, "neither a number nor a time"),
        (["12:00:00.5", "1" * 65], 3, "neither a number nor a time"),
        (["12:00:00.5", "12:60:00.0"], 3, "hours, minutes or seconds are out of range"),
        (["12:00:00.5", "12:00:60.0"], 3, "out of range"),
        (["2026-11-21 24:00:00.5", "2026-11-21 24:00:00.6"], 2, "out of range"),
        (["1:00:00.5 PM", "13:00:00.6 PM"], 3, "out of range"),
        (["2026-02-28T12:00:00.5", "2026-02-29T12:00:00.6"], 3, "is not a date"),
        (["2026-13-01T12:00:00.5", "2026-13-01T12:00:00.6"], 2, "is not a date"),
        (["0000-01-01T12:00:00.5", "0000-01-01T12:00:00.6"], 2, "is not a date"),
        (["13/13/2026 12:00:00", "13/13/2026 12:00:01"], 2, "is not a date"),
        (
            ["2026-11-21T12:00:00.5", "2026-11-21T12:00:00.6Z"],
            3,
            "is another kind of time than '2026-11-21T12:00:00.5'",
        ),
        (["2026-11-21T12:00:00.5", "12:00:00.6"], 3, "is another kind of time"),
        (["1:00:00.5 PM", "1:00:00.6"], 3, "is another kind of time"),
        (["12:00:00.5 CET", "12:00:00.6 CET"], 2, "neither a number nor a time"),
        (["21-Mai-2026 12:00:00", "21-Mai-2026 12:00:01"], 2, "neither a number nor a time"),
        (["1700-01-01", "2026-01-01 00:00:00"], 3, "more than 292 years"),
    ],
)
def test_a_wrong_cell_is_blamed_by_line_and_column(cells: list[str | None], line: int, reason: str) -> None:
    with pytest.raises(RecordingError) as caught:
        read_times(cells)
    assert (caught.value.line, reason in caught.value.reason) == (line, True), caught.value.reason


@pytest.mark.parametrize(
    ("cells", "reason"),
    [
        (["12:00", "12:01"], "hours and minutes or minutes and seconds"),
        (["00:01:02:05", "00:01:02:07"], "frames or milliseconds"),
        (["2026-11-21"] * 20, "dates without a time of day"),
        (texts("%H:%M:%S"), r"whole seconds, 38 rows share one; allowed: .*\(--rate 38\.5 from the count\)"),
        (texts("%Y-%m-%d %H:%M"), "are all the same"),
        (texts("%Y-%m-%d %H:%M", moments(6000)), r"whole minutes, 2\.3e\+03 rows share one"),
        (texts("%M:%S.0"), r"whole seconds"),
    ],
)
def test_what_is_open_or_useless_is_refused_with_what_settles_it(cells: list[str], reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        read_times(cells)


def test_a_fraction_without_zeros_in_front_goes_back_and_is_refused() -> None:
    cells = [f"{row:%H:%M:%S}.{row.microsecond // 1000}" for row in moments()]  # 12:00:00.5 is 5 ms
    with pytest.raises(RecordingError, match=r"line 6.*goes back"):
        read_times(cells)


_FORMS: list[Callable[[datetime], str]] = [
    datetime.isoformat,
    str,
    lambda at: at.strftime("%d.%m.%Y %H:%M:%S,%f"),
    lambda at: at.strftime("%d-%b-%Y %I:%M:%S.%f %p"),
    lambda at: f"{at:%Y/%m/%d} {at.hour}:{at.minute}:{at.second}.{at.microsecond:06d}000",
    lambda at: at.isoformat() + "Z",
]


@given(
    st.lists(st.datetimes(datetime(1990, 1, 1), datetime(2100, 1, 1)), min_size=2, max_size=6, unique=True).map(sorted),
    st.sampled_from(_FORMS),
)
def test_any_dates_are_as_far_apart_as_in_python(at: list[datetime], form: Callable[[datetime], str]) -> None:
    found = read_times([form(row) for row in at])
    for row, seconds in zip(at, found.seconds.tolist(), strict=True):
        exact = Fraction((row - at[0]) // timedelta(microseconds=1), 10**6)
        assert abs(Fraction(seconds) - exact) <= exact * Fraction(1, 2**52)
    if form is _FORMS[-1]:
        assert found.zero_utc_ns == (at[0] - datetime(1970, 1, 1)) // timedelta(microseconds=1) * 1000


@examples(150)
@given(
    st.lists(
        st.text("0123456789:.,-/ TZAPMamp+dys", max_size=30)
        | st.from_regex(
            r"[0-9]{1,4}[:/.-][0-9]{1,2}[:/.-][0-9]{1,4}[ T:.][0-9:.]{0,12}(Z|\+0100| PM)?", fullmatch=True
        ),
        min_size=1,
        max_size=5,
    )
)
def test_any_cells_are_times_or_an_error(cells: list[str]) -> None:
    _times_or_an_error(column([cell.strip() for cell in cells]))


@examples(50)
@given(st.lists(st.none() | st.text(max_size=5), min_size=1, max_size=3))
def test_any_text_is_times_or_an_error(cells: list[str | None]) -> None:
    _times_or_an_error(column(["12:00:00.5", *cells]))


def _times_or_an_error(table: Table) -> None:
    try:
        found = times(table, 0)
    except (RecordingError, ValueError):
        return
    assert np.isfinite(found.seconds).all()
    assert len(found.seconds) == len(table)
