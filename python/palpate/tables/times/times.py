"""Times of the rows of a table."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.errors import RecordingError, quoted
from palpate.tables.cell.clock import DAY_NS, clock
from palpate.tables.cell.kinds import NUMBER, kind
from palpate.tables.cell.numbers import OVERLOAD, are_below, numbers
from palpate.tables.clean_cells import NumberCells, are_clean
from palpate.tables.table import Table
from palpate.tables.times.steps import Coarse, coarse, continued, counted
from palpate.tables.times.time_units import time_unit

LATEST_S = 2**63 / 1e9
_TOO_LATE = "this time is more than 292 years after the first one: too large for 64-bit nanoseconds"
_JITTER_S = 1.0  # host stamps go back by less than this
_FEW_BACK = 0.02  # of the rows
_LITTLE_BACK = 0.2  # of the way forward: a part of a time, as milliseconds, goes back as far as forward
_TURNS: dict[str, dict[float, float]] = {
    "d": {1: 0.5},
    "s": {2**32 * 1e-6: 0, 2**32 * 1e-3: 0, 86_400: 0},
    "ms": {2**32: 0, 2**16: 0, 2**32 * 1e-3: 0},
    "us": {2**32: 0},
}
"""Where numbers begin again, as in `continued`: times of day, and counters like millis() and micros(), also divided."""


@dataclass(frozen=True, eq=False)
class Times:
    """The times of the rows.

    Attributes
    ----------
    seconds : numpy.ndarray, shape (n,)
        Since the first row where the table has dates, else as in the table.
    said : str
        How the cells were understood, as in the line that a user reads: "ms", "dates", "times of day".
    zero_utc_ns : int or None
        UTC of second 0, ns since 1970; None: unknown.
    notes : list of str
    date_ns : int or None
        Date of second 0 by the clock of the table, UTC or not, ns since 1970; None: the times are no dates.
    """

    seconds: NDArray[np.float64]
    said: str
    zero_utc_ns: int | None = None
    notes: list[str] = field(default_factory=list)
    date_ns: int | None = None

    def since(self, other: "Times") -> "Times":
        """Return the same times on the axis of other times: second 0 is that of the other ones.

        Raises
        ------
        ValueError
            One has dates, or a time zone, and the other one has not.
        """
        if (self.date_ns is None, self.zero_utc_ns is None) != (other.date_ns is None, other.zero_utc_ns is None):
            raise ValueError(
                f"time: got {other.described} for the hard and {self.described} for the soft channel, allowed: the same kind"
            )
        if self.date_ns is None or other.date_ns is None:
            return self
        moved = np.rint(self.seconds * 1e9) + (self.date_ns - other.date_ns)  # whole ns: equal dates stay equal
        return replace(self, seconds=moved / 1e9, zero_utc_ns=other.zero_utc_ns, date_ns=other.date_ns)

    @property
    def described(self) -> str:
        """What they are, with their range, for messages."""
        if not len(self.seconds):
            return "no times"
        if self.date_ns is None:
            return f"{self.seconds[0]:.6g} to {self.seconds[-1]:.6g} s ({self.said})"
        begin, end = (
            np.datetime64(self.date_ns + round(float(s) * 1e9), "ns").astype("M8[ms]") for s in self.seconds[[0, -1]]
        )
        return f"{begin} to {end} ({self.said})"


def times(table: Table, column: int, unit: str | None = None, decimal: str | None = None) -> Times:
    """Return the times in a column.

    Parameters
    ----------
    table : Table
    column : int
        From 0.
    unit : str, optional
        Unit of the numbers; default: that in the name of the column, else the only one that makes sense.
    decimal : str, optional
        As in `numbers`.

    Raises
    ------
    RecordingError
        A cell is neither a number nor a time, or time goes back: with its line and column.
    ValueError
        The cells leave the unit open, or are too coarse; the message has what fits, and the option that settles it.
    """
    found = coarse_times(table, column, unit, decimal)
    _require_fine(table, column, found.seconds)
    return found


def coarse_times(table: Table, column: int, unit: str | None = None, decimal: str | None = None) -> Times:
    """Return the times in a column as `times` does, but coarse ones, too."""
    if not len(table):
        return Times(np.empty(0), "")
    _require_cells(table, column, unit, decimal)
    cells: Any = table.columns[column].cells
    if isinstance(cells, np.ndarray) and cells.dtype.kind in "mM":
        found = _of_spans(table, column, cells)
    elif isinstance(cells, np.ndarray | NumberCells) or kind(cells[0] or "") == NUMBER:
        found = _of_numbers(table, column, unit, decimal)
    else:
        found = _of_clock(table, column)
    _require_range(table, column, found.seconds)
    _require_forward(table, column, found.seconds)
    return found


def _require_cells(table: Table, column: int, unit: str | None, decimal: str | None) -> None:
    """Refuse a column that is blank in most rows, with the rate counted."""
    cells = table.columns[column].cells
    if are_clean(cells):
        return
    given = np.flatnonzero([cell != "" for cell in cells]) if table.columns[column].kind == "T" else ()
    if not 2 < len(given) < len(table) / 2:
        return
    rows_a_second = counted(coarse_times(table.take(np.asarray(given)), column, unit, decimal).seconds)
    hint = f" (--rate {rows_a_second * float(np.diff(given).mean()):.3g} from the count)" if rows_a_second else ""
    raise ValueError(
        f"time: got {len(given)} times in {len(table)} rows in column {column + 1} ({table.name(column)}), allowed: a time "
        f"in each row, or rate, pairs a second{hint or ' (--rate)'}"
    )


def _of_spans(table: Table, column: int, cells: NDArray[Any]) -> Times:
    """Return the times of a column of datetime64 or timedelta64."""
    _refuse(table, column, np.isnat(cells), "no time")
    dated = cells.dtype.kind == "M"
    spans = cells - cells[0] if dated else cells
    seconds = spans / np.timedelta64(1, "s")
    if not dated:
        return Times(seconds, "durations")
    first_ns = int(cells[0].astype("M8[us]").astype(np.int64)) * 1000
    first_ns += int((cells[0] - cells[0].astype("M8[us]")) / np.timedelta64(1, "ns"))
    zoned = table.columns[column].unit == "UTC"
    return Times(seconds, "dates (UTC)" if zoned else "dates", first_ns if zoned else None, date_ns=first_ns)


def _of_clock(table: Table, column: int) -> Times:
    """Return the times of a column of text."""
    found = clock(table, column)
    if found.days is not None:
        days = found.days - found.days[0]
        _refuse(table, column, np.abs(days) * 86400.0 >= LATEST_S, _TOO_LATE)
        seconds = (days * DAY_NS + found.ns - found.ns[0]) / 1e9
        first_ns = int(found.days[0]) * DAY_NS + int(found.ns[0])
        return Times(seconds, found.said, first_ns if found.zoned else None, found.notes, first_ns)
    seconds, turn, rows = continued(found.ns / 1e9, found.turns)
    return Times(seconds, found.said, notes=[*found.notes, *_turned(table, turn, "s", rows)])


def _of_numbers(table: Table, column: int, unit: str | None, decimal: str | None) -> Times:
    """Return the times of a column of numbers."""
    cells: Any = table.columns[column].cells
    values = cells if isinstance(cells, np.ndarray) and cells.dtype.kind in "iu" else numbers(table, column, decimal)
    if not are_below(values, OVERLOAD):
        _refuse(table, column, ~(np.abs(np.asarray(values, float)) < OVERLOAD), "no time")
    kind = time_unit(table, column, np.asarray(values, float), unit)
    if kind.epoch:
        first_ns = kind.date_ns(values[0])
        said = f"{kind.said} (UTC)" if kind.epoch.utc else kind.said
        seconds = kind.seconds((values - values[0]).astype(float))
        if values.dtype.kind == "f":
            _require_range(table, column, seconds)
            seconds = kind.since_ns(values) / 1e9
        return Times(seconds, said, first_ns if kind.epoch.utc else None, date_ns=first_ns)
    continuous, turn, rows = continued(np.asarray(values, float), _TURNS.get(kind.unit, {}))
    return Times(kind.seconds(continuous), kind.said, notes=_turned(table, turn, kind.unit, rows))


def _turned(table: Table, turn: float, unit: str, rows: list[int]) -> list[str]:
    if not rows:
        return []
    return [f"time begins again after {turn:.10g} {unit} in line {table.lines[rows[0]]}: continued there"]


def _require_range(table: Table, column: int, seconds: NDArray[np.float64]) -> None:
    if not are_below(seconds, LATEST_S):
        _refuse(table, column, np.abs(seconds) >= LATEST_S, _TOO_LATE)


def _require_fine(table: Table, column: int, seconds: NDArray[np.float64]) -> None:
    found = coarse(seconds)
    if found is None:
        return
    place = f"column {column + 1} ({table.name(column)})"
    if found.rows is None:
        raise ValueError(f"time: the stamps in {place} are all the same, allowed: rate, pairs a second (--rate)")
    raise ValueError(
        f"time: the stamps in {place} are {_unit_of(found)}, {found.rows:.2g} rows share one; allowed: rate, pairs a second "
        f"(--rate {found.rows / found.unit:.3g} from the count)"
    )


def _unit_of(found: Coarse) -> str:
    words = {1.0: "whole seconds", 60.0: "whole minutes"}
    return words.get(round(found.unit, 3), f"multiples of {found.unit:.3g} s")


def _require_forward(table: Table, column: int, seconds: NDArray[np.float64]) -> None:
    """Allow jitter of host stamps; refuse a restarted logger, a reversed file, numbers that are no times."""
    steps = np.diff(seconds)
    if (steps >= 0).all():
        return
    back = steps < 0
    count = int(np.count_nonzero(back))
    little = -steps[back].sum() <= _LITTLE_BACK * steps[~back].sum()
    if little and count <= max(1, _FEW_BACK * len(seconds)) and (steps > -_JITTER_S).all():
        return
    far = steps <= -_JITTER_S
    row = int(np.argmax(far if far.any() else back)) + 1
    place = f"column {column + 1} ({table.name(column)})"
    if count == len(steps) > 1:
        raise RecordingError(
            table.path, f"the times in {place} fall: newest row first; sort the rows by time", table.lines[row]
        )
    often = count > 2 and -2 * steps[back].sum() > steps[~back].sum()
    why = "is it a part of a time, as the milliseconds?" if often else "was the logger restarted?"
    reason = (
        f"the time in {place} goes back by {-steps[row - 1]:.3g} s, and so in {count} rows in all: {why} "
        "allowed: one measurement in a file, or rate, pairs a second (--rate)"
    )
    raise RecordingError(table.path, reason, table.lines[row])


def _refuse(table: Table, column: int, wrong: NDArray[np.bool_], why: str) -> None:
    if wrong.any():
        row = int(np.argmax(wrong))
        cell = quoted(str(table.columns[column].cells[row]))
        raise RecordingError(
            table.path, f"{cell} in column {column + 1} ({table.name(column)}): {why}", table.lines[row]
        )
