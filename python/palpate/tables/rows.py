"""Which rows of the tables of two channels are readings: repeated rows, and channels that alternate in rows."""

from collections.abc import Collection
from operator import eq

import numpy as np
from numpy.typing import NDArray

from palpate.tables.clean_cells import NumberCells, ShapedCells
from palpate.tables.roles import Side
from palpate.tables.table import Column, Table

Array = NDArray[np.float64]

_FEW = 0.1  # of the readings of a channel: rows with both channels, where they alternate


def without_repeats(hard: Side, soft: Side) -> tuple[Side, Side, list[str]]:
    """Return the channels without rows that repeat the row before, and notes.

    A row repeats another one if all its cells are equal, the time too. Where other rows have the time of the row before
    and other values, the stamps are coarse, or there are two measurements in the table: then all rows stay.
    """
    first, told = _kept(hard.table, {*hard.times, *(soft.times if soft.table is hard.table else ())})
    if soft.table is hard.table:
        return hard._replace(table=first), soft._replace(table=first), told
    second, more = _kept(soft.table, soft.times)
    return hard._replace(table=first), soft._replace(table=second), [*told, *more]


def _kept(table: Table, times: Collection[int]) -> tuple[Table, list[str]]:
    equal = np.full(max(len(table) - 1, 0), bool(times))
    for column in times:
        equal &= _repeats(table.columns[column])
    same_time = int(np.count_nonzero(equal))
    if not same_time:
        return table, []
    for each in table.columns:
        equal &= _repeats(each)
    repeats = int(np.count_nonzero(equal))
    if repeats == same_time:
        kept = np.flatnonzero(np.r_[True, ~equal])
        return table.take(kept, repeats=True), [f"{repeats} rows repeat the row before: left out"]
    said = f"{same_time} of {len(table)} rows have the time of the row before, and other values"
    return table, [f"{said}: rows that came at once, or two measurements in one file?"]


def _repeats(column: Column) -> NDArray[np.bool_]:
    """Return for each row but the first whether its cell is that of the row before."""
    cells = column.cells
    if isinstance(cells, NumberCells | ShapedCells):
        return cells.same_as_before()
    if isinstance(cells, np.ndarray):
        before, after = cells[:-1], cells[1:]
        same: NDArray[np.bool_] = before == after
        return same | (np.isnan(before) & np.isnan(after)) if column.kind in "fmM" else same
    return np.fromiter(map(eq, cells, cells[1:]), bool, len(cells) - 1)


def in_turn(hard: Side, soft: Side, raw: tuple[Array, Array]) -> tuple[Side, Side, tuple[Array, Array], list[str]]:
    """Return each channel with the rows of its own, if one is blank where the other one is not; and a note.

    Parameters
    ----------
    hard, soft : Side
    raw : tuple of numpy.ndarray
        Their values, nan where a cell is blank.
    """
    given = tuple(np.isfinite(each) for each in raw)
    if hard.table is not soft.table or np.count_nonzero(given[0] & given[1]) > _FEW * min(map(np.count_nonzero, given)):
        return hard, soft, raw, []
    rows = tuple(np.flatnonzero(each) for each in given)
    if not (len(rows[0]) and len(rows[1])):
        return hard, soft, raw, []
    first, second = (side._replace(table=side.table.take(at)) for side, at in zip((hard, soft), rows, strict=True))
    values = raw[0][rows[0]], raw[1][rows[1]]
    return first, second, values, ["the channels alternate in rows: each has its own times"]
