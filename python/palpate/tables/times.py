"""The times of the rows of a table: their unit, dates, times of day; what is no time is refused, what is open is asked."""

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.errors import RecordingError, listed, quoted
from palpate.extras import need
from palpate.tables.table import Array, Asked, Table, numbers
from palpate.tables.text import NUMBER, kind
from palpate.tables.units import SECONDS, last_word, unit_in

GUESSED = (9.9, 499.0)  # pairs a second, of a unit that nobody named; hundredths of a second look like 500
POSSIBLE = (0.2, 20_000.0)
_CANDIDATES = ("s", "ms", "us", "ns", "d")
_LONGEST_S = 10 * 365.25 * 86400  # a logger that counts from its start
_LATEST_S = 2**63 / 1e9
_EPOCH = (946_684_800.0, 3_155_760_000.0)  # s since 1970: 2000 to 2070
_UNITS = {
    "second": "s", "seconds": "s", "secs": "s", "lsl_timestamp": "s", "msec": "ms", "millis": "ms", "milliseconds": "ms",
    "usec": "us", "micros": "us", "microseconds": "us", "nanos": "ns", "nanoseconds": "ns", "minutes": "min", "days": "d",
}  # fmt: skip
_JITTER_S = 1.0  # host stamps go back by less than this
_LITTLE_BACK = 0.2  # of the way forward: a part of a time, as milliseconds, goes back as far as forward
_WINDOW = 256  # rows; longer than the bursts of a USB or serial port, shorter than a file
_FEWEST = 8  # rows of which anything can be said
_LEAST = 1e-30  # of any unit; smaller steps are none
_CLOCK = r"\d{1,4}:[0-5]?\d:[0-5]?\d(?:\.\d+)?"
_MINUTES = r"[0-5]?\d:[0-5]?\d\.\d+"
_DATE = r"^\d{4}[-/]\d\d[-/]\d\d"
_ZONE = r"(?:Z|[+-]\d\d:?\d\d)$"


@dataclass(frozen=True, eq=False)
class Times:
    """Times of the rows, s, of dates since `zero_ns`, ns since 1970 (None: no dates), and how their cells were understood."""

    seconds: Array
    said: str
    zero_ns: int | None = None
    is_utc: bool = False


def typical_step(times: Array) -> float:
    """Return the median step over windows of rows, robust to bursts, gaps and equal stamps; 0 if no time is later."""
    rows = len(times)
    window = max(2, min(_WINDOW, (rows - 1) // 4)) if rows > 2 else 1
    steps = times[window:] - times[:-window]
    later = steps[steps > _LEAST]
    return float(np.median(later)) / window if len(later) else 0.0


def times(table: Table, column: int, asked: Asked, zero_ns: int | None = None) -> Times:
    """Return the times in a column, dates from `zero_ns` or the first one on; errors as of `channels`."""
    cells = table.columns[column].cells
    if not len(cells):
        return Times(np.empty(0), "")
    if cells.dtype.kind in "iufb" or (cells.dtype.kind not in "mM" and kind(str(cells[0]).strip()) == NUMBER):
        found = _of_numbers(table, column, asked, zero_ns)
    else:
        zoned, said = table.columns[column].unit == "UTC", "durations"
        if cells.dtype.kind not in "mM":
            cells, zoned, said = _of_text(table, column, cells)
        advice = "is no time; write it as 2026-11-21 12:00:00.5, as 12:00:00.5, or minutes as 12:00.5"
        table.refuse(column, np.isnat(cells), advice)
        if cells.dtype.kind == "m":
            found = Times(cells / np.timedelta64(1, "s"), said)
        else:
            said = "dates (UTC)" if zoned else "dates"
            found = _since(cells.astype("M8[ns]").astype(np.int64), said, zero_ns, is_utc=zoned)
    _require_forward(table, column, found.seconds)
    return found


def _since(stamps_ns: NDArray[np.int64], said: str, zero_ns: int | None, *, is_utc: bool) -> Times:
    """Return the times of stamps in ns since 1970: differences of whole numbers are exact."""
    zero = int(stamps_ns[0]) if zero_ns is None else zero_ns
    return Times((stamps_ns - zero) / 1e9, said, zero, is_utc)


def _of_numbers(table: Table, column: int, asked: Asked, zero_ns: int | None) -> Times:
    """Return the times of a column of numbers: since a start, or since 1970."""
    cells = table.columns[column].cells
    values = cells if cells.dtype.kind in "iu" else numbers(table, column)
    floats = np.asarray(values, float)
    table.refuse(column, ~np.isfinite(floats), "is no time: a time in each row, or rate, pairs a second (--rate)")
    unit, said = _unit(table, column, floats, asked.time_unit)
    factor = SECONDS[unit]
    late = ~(np.abs(floats) * factor < _LATEST_S)
    table.refuse(column, late, "is no time, or more than 292 years after the first one")
    if "1970" not in said:
        return Times(floats if factor == 1 else floats / round(1 / factor) if factor < 1 else floats * factor, said)
    ns = round(factor * 1e9)
    whole = values if values.dtype.kind in "iu" else np.trunc(values)
    rest = np.rint((values - whole) * ns).astype(np.int64)
    return _since(whole.astype(np.int64) * ns + rest, f"{said} (UTC)", zero_ns, is_utc=True)


def _unit(table: Table, column: int, values: Array, asked: str | None) -> tuple[str, str]:
    """Return the unit of times that are numbers, and how it was found: named, as dates by their size, or by their pace."""
    text, step = table.columns[column].unit or table.columns[column].name, typical_step(values)
    named = asked or unit_in(text, SECONDS) or _UNITS.get(last_word(text).casefold()) or _UNITS.get(text.casefold())
    rates = {unit: 1 / (step * factor) for unit, factor in SECONDS.items()} if step else {}
    fitting = {unit for unit, rate in rates.items() if POSSIBLE[0] <= rate <= POSSIBLE[1]}
    for unit in [named] if named else _CANDIDATES[:4]:
        since_1970 = unit in _CANDIDATES[:4] and _EPOCH[0] <= values[0] * SECONDS[unit] < _EPOCH[1]
        if since_1970 and (not rates or unit in fitting):
            return unit, f"{unit} since 1970"
    if asked or not rates or named in fitting:
        return named or "s", named or "s"
    size = max(abs(float(values[0])), abs(float(values[-1])))
    for unit in () if named else _CANDIDATES:
        if GUESSED[0] < rates[unit] < GUESSED[1] and size * SECONDS[unit] < _LONGEST_S:
            return unit, f"{unit} (by its steps)"  # the rest are 1000 times as far away
    paces = listed([f"{unit} ({rates[unit]:,.3g} pairs a second)" for unit in _CANDIDATES])
    raise ValueError(
        f"time_unit: got a median step of {step:.3g} in {table.place(column)}, allowed: {paces} (--time-unit)"
    )


def _of_text(table: Table, column: int, cells: NDArray[Any]) -> tuple[NDArray[Any], bool, str]:
    """Return dates or times of day, NaT for what is none; whether they are in UTC; and what they are."""
    pandas = need("pandas", "tables")
    text = pandas.Series(cells, dtype=object).astype(str).str.strip().str.replace(",", ".")
    if not re.match(r"\d+[-/.]\d+[-/.]", text.iloc[0]):
        minutes = text.str.fullmatch(_MINUTES).all()
        text = "00:" + text if minutes else text
        spans = pandas.to_timedelta(text.where(text.str.fullmatch(_CLOCK)))
        return spans.to_numpy("m8[ns]"), False, "mm:ss" if minutes else "times of day"
    zoned = text.str.contains(_ZONE).to_numpy()
    table.refuse(column, zoned != zoned[0], f"is another kind of time than {quoted(text.iloc[0])} in the first row")
    written = text.where(text.str.match(_DATE), "").str.replace("/", "-")
    stamps = pandas.to_datetime(written, format="ISO8601", errors="coerce", utc=True)
    return stamps.dt.tz_convert(None).to_numpy("M8[ns]"), bool(zoned[0]), ""


def _require_forward(table: Table, column: int, seconds: Array) -> None:
    """Allow jitter of host stamps; refuse a restarted logger and a reversed file; ask for the rate if most stamps are equal."""
    steps = np.diff(seconds)
    back, far, later = steps < 0, steps <= -_JITTER_S, int(np.count_nonzero(steps > _LEAST))
    if far.any() or -steps[back].sum() > _LITTLE_BACK * steps[~back].sum():
        row = int(np.argmax(far if far.any() else back)) + 1
        said = f"goes back by {-steps[row - 1]:.3g} s, and so in {np.count_nonzero(back)} rows in all"
        allowed = "allowed: one measurement in a file, the oldest row first, or rate, pairs a second (--rate)"
        raise RecordingError(table.path, f"the time in {table.place(column)} {said}: {allowed}", table.lines[row])
    if len(steps) >= _FEWEST and 2 * later < len(steps):
        rate = f" {len(steps) / (seconds[-1] - seconds[0]):.3g} from the count" if later else ""
        said = f"{len(seconds)} rows have {later + 1} different stamps in {table.place(column)}"
        raise ValueError(f"time: {said}, allowed: rate, pairs a second (--rate{rate})")
