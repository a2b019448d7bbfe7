"""Dates and times of day in the cells of a text column, read with integers: no nanosecond is lost."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.errors import RecordingError, quoted
from palpate.tables.cell.clock_layout import LONGEST, Layout, layout_of
from palpate.tables.cell.date_order import Order, order_of
from palpate.tables.clean_cells import ShapedCells
from palpate.tables.table import Table

DAY_NS = 86_400_000_000_000
_BLOCK = 1 << 16  # rows at once, so that a block stays in the cache
_DTYPE = np.dtype([("year", "i4"), ("month", "i4"), ("day", "i4"), ("ns", "i8"), ("layout", "i4")])

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Clock:
    """The cells of a column of dates or times.

    Attributes
    ----------
    days : numpy.ndarray of int64, shape (n,), or None
        Days since 1970; None: times without dates.
    ns : numpy.ndarray of int64, shape (n,)
        Since the midnight of the day in UTC if `zoned`; else of the clock of the logger; or elapsed.
    said : str
    zoned : bool
        Whether the cells have a time zone, and the order of day and month is known: UTC is known.
    turns : dict
        As in `continued`: after so many seconds the clock begins again, at midnight for example.
    notes : list of str
    """

    days: Ints | None
    ns: Ints
    said: str
    zoned: bool = False
    turns: dict[float, float] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def clock(table: Table, column: int) -> Clock:
    """Read a text column of dates, times of day, or elapsed times.

    Raises
    ------
    RecordingError
        A cell is not such a time, or not of the same kind as the first one: with its line and column.
    ValueError
        The cells leave their meaning open.
    """
    rows, layouts = _rows(table, column)
    first = layouts[0]
    kinds = np.array([layout.kind != first.kind for layout in layouts])
    _refuse(
        table, column, kinds[rows["layout"]], f"is another kind of time than {_cell(table, column, 0)} in the first row"
    )
    if first.dated:
        return _dates(table, column, rows, layouts)
    return _without_dates(table, column, rows, layouts)


def _dates(table: Table, column: int, rows: NDArray[np.void], layouts: list[Layout]) -> Clock:
    if not any(layout.timed for layout in layouts) and len(rows) > 1:
        raise ValueError(
            f"time: got {_cell(table, column, 0)} in column {column + 1} ({table.name(column)}), dates without a time of day; "
            "allowed: time=COL with the times, or rate, pairs a second (--rate)"
        )
    order = _order(rows, np.array([layout.order_open for layout in layouts]))
    months = (rows["year"].astype(np.int64) - 1970) * 12 + order.month - 1
    days = months.astype("M8[M]").astype("M8[D]") + (order.day - 1)
    outside = (
        (order.month < 1) | (order.month > 12) | (order.day < 1) | (days.astype("M8[M]") != months.astype("M8[M]"))
    )
    _refuse(table, column, outside | (rows["year"] < 1700) | (rows["year"] > 2250), "is not a date")
    zoned = layouts[0].zoned
    said = "dates" + order.said + (" (UTC)" if zoned else "")
    return Clock(days.astype(np.int64), rows["ns"], said, zoned and order.known, notes=order.notes)


def _order(rows: NDArray[np.void], order_open: NDArray[np.bool_]) -> Order:
    """Return days and months; the order may be open in all rows or in none."""
    if order_open.all():
        return order_of(rows["year"], rows["month"], rows["day"])
    return Order("", rows["month"], rows["day"], known=True)


def _without_dates(table: Table, column: int, rows: NDArray[np.void], layouts: list[Layout]) -> Clock:
    if not any(layout.fraction or layout.hours for layout in layouts):
        raise ValueError(
            f"time: got {_cell(table, column, 0)} in column {column + 1} ({table.name(column)}), hours and minutes or minutes "
            "and seconds? allowed: times with a fraction of a second, or rate, pairs a second (--rate)"
        )
    fourths = {layout.fourth for layout in layouts} - {0}
    if fourths and 3 not in fourths:
        raise ValueError(
            f"time: got {_cell(table, column, 0)} in column {column + 1} ({table.name(column)}), frames or milliseconds after "
            "the last colon? allowed: 12:00:00.500, 12:00:00:500, or rate, pairs a second (--rate)"
        )
    if not any(layout.hours for layout in layouts):
        return Clock(None, rows["ns"], "mm:ss", turns={3600: 0})
    if any(layout.elapsed for layout in layouts) or int(rows["ns"].max()) >= DAY_NS:
        return Clock(None, rows["ns"], "elapsed h:mm:ss")
    twelve_hours: dict[float, float] = {} if layouts[0].half else {43_200: 0}
    return Clock(None, rows["ns"], "times of day", turns={86_400: 43_200, **twelve_hours})


def _rows(table: Table, column: int) -> tuple[NDArray[np.void], list[Layout]]:
    """Return the fields of all cells, and the layouts that they have."""
    cells = table.columns[column].cells
    found = np.zeros(len(cells), _DTYPE)
    layouts: dict[str, tuple[int, Layout]] = {}
    for begin in range(0, len(cells), _BLOCK):
        characters = _characters(table, column, range(begin, min(begin + _BLOCK, len(cells))))
        for shape, rows in _by_shape(characters):
            if shape not in layouts:
                layouts[shape] = (len(layouts), _layout(table, column, begin + int(rows[0]), shape))
            index, layout = layouts[shape]
            digits = np.subtract(characters[rows], ord("0"), dtype=np.uint8)
            ns, fits = layout.time_ns(digits)
            if not fits.all():
                why = "is not a time: hours, minutes or seconds are out of range"
                raise _error(table, column, begin + int(rows[np.argmin(fits)]), why)
            at = begin + rows
            found["year"][at], found["month"][at], found["day"][at] = layout.date(digits)
            found["ns"][at], found["layout"][at] = ns, index
    return found, [layout for _, layout in layouts.values()]


def _layout(table: Table, column: int, row: int, shape: str) -> Layout:
    layout = layout_of(shape)
    if layout is None:
        raise _error(table, column, row, "is neither a number nor a time")
    return layout


def _characters(table: Table, column: int, rows: range) -> NDArray[np.uint8]:
    """Return the characters of some cells, shape (rows, longest cell)."""
    whole: Any = table.columns[column].cells
    if isinstance(whole, ShapedCells) and whole.characters.itemsize <= LONGEST:
        return _as_bytes(whole.characters[rows.start : rows.stop])
    cells = whole[rows.start : rows.stop]
    try:
        fits = min(map(len, cells)) > 0 and max(map(len, cells)) <= LONGEST
        array = np.array(cells if fits else [], dtype="S")
    except (TypeError, UnicodeEncodeError):
        fits = False
    if not fits:
        row = next(
            row for row, cell in zip(rows, cells, strict=True) if not cell or not cell.isascii() or len(cell) > LONGEST
        )
        raise _error(table, column, row, "is neither a number nor a time")
    return _as_bytes(array)


def _as_bytes(array: NDArray[np.bytes_]) -> NDArray[np.uint8]:
    return array.view(np.uint8).reshape(len(array), -1)


def _by_shape(characters: NDArray[np.uint8]) -> Iterator[tuple[str, NDArray[np.intp]]]:
    """Yield each shape, a cell with all its digits 0, and the rows that have it."""
    digit = (characters >= ord("0")) & (characters <= ord("9"))
    shapes = np.where(digit, np.uint8(ord("0")), characters)
    left = np.arange(len(shapes))
    while len(left):
        same = (shapes[left] == shapes[left[0]]).all(axis=1)
        yield bytes(shapes[left[0]]).rstrip(b"\0").decode("ascii"), left[same]
        left = left[~same]


def _refuse(table: Table, column: int, wrong: NDArray[np.bool_], why: str) -> None:
    if wrong.any():
        raise _error(table, column, int(np.argmax(wrong)), why)


def _error(table: Table, column: int, row: int, why: str) -> RecordingError:
    place = f"column {column + 1} ({table.name(column)})"
    cell = table.columns[column].cells[row]
    reason = f"the row ends before {place}" if cell is None else f"{quoted(cell)} in {place} {why}"
    return RecordingError(table.path, reason, table.lines[row])


def _cell(table: Table, column: int, row: int) -> str:
    return quoted(table.columns[column].cells[row])
