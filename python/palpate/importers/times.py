"""Times in a column of a table: numbers in some unit, dates, times of day, or durations."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.errors import RecordingError, need
from palpate.importers.counter_wraps import continued
from palpate.importers.date_order import ordered, with_24_hours
from palpate.importers.rounded_times import even_times
from palpate.importers.table import Array, Column, Option, OptionError
from palpate.importers.table_checks import typical_step
from palpate.importers.units import (
    SECONDS,
    CellKind,
    cell_kind,
    duration_parts,
    time_unit_in,
    to_number,
)
from palpate.messages import listed, quoted

# Pairs a second with a unit that nobody named: hundredths of a second look like 500.
_PROBABLE_RATES = (9.9, 499.0)
_POSSIBLE_RATES = (0.2, 20_000.0)
_DATE_UNITS = ("s", "ms", "us", "ns")
_LATEST_S = 2**63 / 1e9
_EARLIEST_DATE_S = 946_684_800.0  # since 1970: the year 2000
_LATEST_DATE_S = 3_155_760_000.0  # 2070
_JITTER_S = 1.0  # stamps of a computer go back by less
_SMALL_RETURN = 0.2  # of the way forward; a part of a time, as milliseconds, returns all of it
_FEWEST_STEPS = 8
_SMALLEST_STEP = 1e-30  # of any unit; smaller ones are none
_DATE = re.compile(r"\d+[-/.]\d+[-/.]")
_DATE_IN_ORDER = r"\d{4}[-/]\d\d[-/]\d\d"
_ZONE = r"(?:Z|[+-]\d\d:?\d\d)$"
_CLOCK = r"\d{1,4}:[0-5]?\d:[0-5]?\d(?:\.\d+)?"
_MINUTES = r"[0-5]?\d:[0-5]?\d\.\d+"
_TIMES_OF_DAY = "times of day"
_DATE_ADVICE = "write it as 2026-11-21 12:00:00.5, as 12:00:00.5, or minutes as 12:00.5"
_RATE_ADVICE = "rate, pairs a second (--rate"


@dataclass(frozen=True)
class Times:
    """Times of the rows of a table.

    Attributes
    ----------
    seconds : numpy.ndarray, shape (n,)
    notation : str
        Their unit or form, for the line that says how the table was understood.
    zero_ns : int or None
        Of dates: the date of second 0, ns since 1970. None: not dates.
    is_utc : bool
        Whether the dates are known to be in UTC.
    note : str
        On times with few decimals, on a counter that began again; "" without one.
    """

    seconds: Array
    notation: str
    zero_ns: int | None = None
    is_utc: bool = False
    note: str = ""


def read_times(column: Column, time_unit: str | None = None) -> Times:
    """Return the times in a column.

    Parameters
    ----------
    column : Column
    time_unit : str, optional
        Unit of times that are numbers. Default: the unit of the column, else the one with which
        the numbers are dates or have a probable rate.

    Returns
    -------
    Times
        On the even grid that they came from, if they have few decimals: see `even_times`.

    Raises
    ------
    OptionError
        The unit is ambiguous, or most times are equal.
    RecordingError
        A cell is no time, or the times go back.
    """
    times = _times_of_cells(column, time_unit)
    whole = continued(times.seconds, of_day=times.notation == _TIMES_OF_DAY)
    even = even_times(whole.seconds)
    _require_forward(column, even.seconds)
    notes = filter(None, [times.note, whole.note, even.note])
    return replace(times, seconds=even.seconds, note="; ".join(notes))


def _times_of_cells(column: Column, time_unit: str | None) -> Times:
    cells = column.cells
    kind = column.kind
    is_text = kind == "O"
    is_number = is_text and cell_kind(str(cells[0]).strip()) is CellKind.NUMBER
    if is_number or kind in "biuf":
        return _times_of_numbers(column, time_unit)
    if is_text:
        return _times_of_texts(column)
    if kind == "M":
        return _times_of_dates(_nanoseconds(column, cells), is_utc=column.unit == "UTC")
    return Times(_nanoseconds(column, cells) / 1e9, "durations")


def _nanoseconds(column: Column, cells: NDArray[Any]) -> NDArray[np.int64]:
    """Return dates or durations in ns; refuse the first cell that is none."""
    column.refuse(np.isnat(cells), f"is no time; {_DATE_ADVICE}")
    in_ns: NDArray[np.int64] = cells.astype(f"{cells.dtype.kind}8[ns]").astype(np.int64)
    return in_ns


def _times_of_dates(dates_ns: NDArray[np.int64], *, is_utc: bool, unit: str = "") -> Times:
    """Return the times since the first one of some dates, ns since 1970.

    Differences of whole numbers are exact.
    """
    notation = "dates"
    if unit:
        notation = f"{unit} since 1970"
    if is_utc:
        notation += " (UTC)"
    return Times((dates_ns - dates_ns[0]) / 1e9, notation, int(dates_ns[0]), is_utc)


def _times_of_numbers(column: Column, time_unit: str | None) -> Times:
    values = column.numbers()
    advice = "a time in each row, or rate, pairs a second (--rate)"
    column.refuse(~np.isfinite(values), f"is no time: {advice}")
    step = typical_step(values)
    named = time_unit or time_unit_in(column.unit or column.name)
    units: Sequence[str] = _DATE_UNITS
    rates = _PROBABLE_RATES
    if named:
        units = [named]
        rates = _POSSIBLE_RATES
    of_dates = []
    of_times = []
    for unit in units:
        if _can_be_dates(values[0], unit, step):
            of_dates.append(unit)
        if time_unit or _has_rate(step, unit, rates):
            of_times.append(unit)
    if not of_dates and not of_times:
        raise _ambiguous_unit(column, step)
    unit = (of_dates or of_times)[0]
    factor = SECONDS[unit]
    too_late = ~(np.abs(values) * factor < _LATEST_S)
    column.refuse(too_late, "is no time, or more than 292 years after the first one")
    if of_dates:
        dates_ns = _dates_of_numbers(column, values, round(factor * 1e9))
        return _times_of_dates(dates_ns, is_utc=True, unit=unit)
    notation = unit if named or not step else f"{unit} (by its steps)"
    return Times(_in_seconds(values, factor), notation)


def _can_be_dates(first: float, unit: str, step: float) -> bool:
    """Return whether numbers in a unit are possible dates, from the first one and the step."""
    if unit not in _DATE_UNITS:
        return False
    is_recent = _EARLIEST_DATE_S <= first * SECONDS[unit] < _LATEST_DATE_S
    return is_recent and _has_rate(step, unit, _POSSIBLE_RATES)


def _has_rate(step: float, unit: str, rates: tuple[float, float]) -> bool:
    """Return whether a step in a unit gives a rate in a range; True if there is no step."""
    lowest, highest = rates
    return not step or lowest <= 1 / (step * SECONDS[unit]) <= highest


def _ambiguous_unit(column: Column, step: float) -> OptionError:
    rates = []
    for unit in (*_DATE_UNITS, "d"):
        rates.append(f"{unit} ({1 / (step * SECONDS[unit]):,.3g} pairs a second)")
    got = f"a median step of {step:.3g} in {column.place}"
    return OptionError(Option.TIME_UNIT, got, f"{listed(rates)} (--time-unit)")


def _dates_of_numbers(column: Column, values: Array, unit_ns: int) -> NDArray[np.int64]:
    """Return dates in ns; whole numbers are multiplied as such, to keep each nanosecond."""
    whole = np.trunc(values)
    if column.kind in "iu":
        whole = column.cells
    fraction_ns = np.rint((values - whole) * unit_ns)
    dates_ns: NDArray[np.int64] = whole.astype(np.int64) * unit_ns + fraction_ns.astype(np.int64)
    return dates_ns


def _in_seconds(values: Array, factor: float) -> Array:
    if factor == 1:
        return values
    if factor < 1:  # 1000 is exact, 0.001 is not
        return values / round(1 / factor)
    return values * factor


def _times_of_texts(column: Column) -> Times:
    """Return the times of texts: durations, as 0.37 sec, dates, or times of day, as 12:00:00.5."""
    if duration_parts(str(column.cells[0]).strip()):
        return _times_of_durations(column)
    pandas = need("pandas", "tables")
    texts = pandas.Series(column.cells, dtype=object).astype(str).str.strip()
    texts = texts.str.replace(",", ".")
    note = ""
    if _DATE.match(texts.iloc[0]) and not texts.str.match(_DATE_IN_ORDER).all():
        in_order = ordered(texts)
        if in_order is not None:
            texts = pandas.Series(in_order.texts, dtype=object)
            note = in_order.note
    if not _DATE.match(texts.iloc[0]):
        return replace(_times_of_clocks(column, texts), note=note)
    return _times_of_date_texts(column, texts)


def _times_of_durations(column: Column) -> Times:
    """Return the times of numbers with their unit, as 0.37 sec."""
    mark = column.table.decimal_mark
    seconds = np.full(len(column.cells), np.nan)
    units = set()
    for row, cell in enumerate(column.cells):
        parts = duration_parts(str(cell).strip())
        if parts:
            number, unit = parts
            seconds[row] = to_number(number, mark) * SECONDS[unit]
            units.add(unit)
    column.refuse(np.isnan(seconds), f"is no time; {_DATE_ADVICE}")
    return Times(seconds, f"durations in {listed(sorted(units))}")


def _times_of_clocks(column: Column, texts: Any) -> Times:
    """Return the times of texts as 12:00:00.5, 2:22:10.4 PM, or of minutes as 12:00.5."""
    pandas = need("pandas", "tables")
    notation = _TIMES_OF_DAY
    if texts.str.fullmatch(_MINUTES).all():
        texts = "00:" + texts
        notation = "mm:ss"
    elif not texts.str.fullmatch(_CLOCK).all():
        texts = texts.map(with_24_hours)
    clocks = texts.where(texts.str.fullmatch(_CLOCK))
    durations = pandas.to_timedelta(clocks).to_numpy("m8[ns]")
    return Times(_nanoseconds(column, durations) / 1e9, notation)


def _times_of_date_texts(column: Column, texts: Any) -> Times:
    """Return the times of dates, as 2026-11-21 12:00:00.5."""
    pandas = need("pandas", "tables")
    zoned = texts.str.contains(_ZONE).to_numpy()
    first = quoted(texts.iloc[0])
    column.refuse(zoned != zoned[0], f"is another kind of time than {first} in the first row")
    in_order = texts.where(texts.str.match(_DATE_IN_ORDER), "").str.replace("/", "-")
    stamps = pandas.to_datetime(in_order, format="ISO8601", errors="coerce", utc=True)
    dates = stamps.dt.tz_convert(None).to_numpy("M8[ns]")
    return _times_of_dates(_nanoseconds(column, dates), is_utc=bool(zoned[0]))


def _require_forward(column: Column, seconds: Array) -> None:
    """Refuse times that go back by more than jitter, and times of which most are equal."""
    steps = np.diff(seconds)
    backward = steps < 0
    far_backward = steps <= -_JITTER_S
    if far_backward.any():
        raise _goes_back(column, steps, int(np.argmax(far_backward)))
    if -steps[backward].sum() > _SMALL_RETURN * steps[~backward].sum():
        raise _goes_back(column, steps, int(np.argmax(backward)))
    later = int(np.count_nonzero(steps > _SMALLEST_STEP))
    if len(steps) >= _FEWEST_STEPS and 2 * later < len(steps):
        got = f"{later + 1} different stamps in {len(seconds)} rows of {column.place}"
        count = ""
        if later:
            count = f" {len(steps) / (seconds[-1] - seconds[0]):.3g} from the count"
        raise OptionError(Option.TIME, got, f"{_RATE_ADVICE}{count})")


def _goes_back(column: Column, steps: Array, index: int) -> RecordingError:
    """Return the error for a step back, of a logger that restarted or a reversed file."""
    count = np.count_nonzero(steps < 0)
    found = f"goes back by {-steps[index]:.3g} s, and so in {count} rows in all"
    allowed = f"one measurement in a file, the oldest row first, or {_RATE_ADVICE})"
    message = f"the time in {column.place} {found}: allowed: {allowed}"
    return RecordingError(column.table.path, message, column.table.lines[index + 1])
