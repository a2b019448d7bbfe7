"""Tables in long format: a row is one reading of one channel, with the name of the channel."""

from collections.abc import Collection
from itertools import pairwise
from typing import Any

import numpy as np

from palpate.tables.cell.clock_layout import is_time
from palpate.tables.cell.kinds import NUMBER, kind
from palpate.tables.cell.numbers import NO_VALUE
from palpate.tables.clean_cells import are_clean
from palpate.tables.table import Cells, Table
from palpate.tables.units import bare_name

IDS = {"id", "channel", "channels", "ch", "chan", "sensor", "name", "tag", "series", "variable", "signal", "kanal"}
"""Names of columns that hold the names of channels."""

_MOST = 100  # channels
_NAMES = "Tiu"  # kinds of columns


def id_column(table: Table) -> int | None:
    """Return the column (from 0) with the names of channels; None: the table has a row for each pair.

    It has 2 to 100 different names: texts or whole numbers below one of the names `IDS`, or texts that change in most rows.
    """
    columns = range(table.width)
    named = [column for column in columns if IDS & {bare_name(name) for name in table.names(column)}]
    for column in named:
        if _fits(table, column, numbers=True):
            return column
    return next((column for column in columns if _fits(table, column, numbers=False) and _changes(table, column)), None)


def id_columns(table: Table, names: Collection[str]) -> list[int]:
    """Return the columns (from 0) that hold all of these names of channels, in any rows."""
    columns = [(number, column) for number, column in enumerate(table.columns) if column.kind in _NAMES]
    return [number for number, column in columns if set(names) <= set(_distinct(column.cells))]


def spread(table: Table, column: int) -> dict[str, Table]:
    """Return the rows of each channel as a table, by the name of the channel, in the order of their first rows.

    The tables keep the numbers of the lines, and all columns at their positions: messages and maps hold for the file.
    """
    cells = table.columns[column].cells
    names = list(_distinct(cells))
    numbers = {name: number for number, name in enumerate(names)}
    of_row = np.array([numbers[_text(cell)] for cell in cells], np.intp)
    order = np.argsort(of_row, kind="stable")
    parts = np.split(order, np.cumsum(np.bincount(of_row))[:-1])
    return {name: table.take(rows) for name, rows in zip(names, parts, strict=True)}


def _distinct(cells: Cells) -> dict[str, None]:
    return dict.fromkeys(map(_text, cells))


def _text(cell: Any) -> str:
    return "" if cell is None else str(cell)


def _fits(table: Table, column: int, *, numbers: bool) -> bool:
    """Return whether a column holds 2 to 100 names: texts, or whole numbers where they are allowed."""
    few: set[str] = set()
    cells = table.columns[column].cells
    if table.columns[column].kind not in _NAMES or (are_clean(cells) and not numbers):
        return False
    for cell in cells:
        few.add(_text(cell))
        if len(few) > _MOST:
            return False
    return 2 <= len(few) < len(table) and all(_is_name(cell, numbers=numbers) for cell in few)


def _is_name(cell: str, *, numbers: bool) -> bool:
    if kind(cell) == NUMBER:
        return numbers and cell.isdecimal()
    return cell.upper() not in NO_VALUE and not is_time(cell)


def _changes(table: Table, column: int) -> bool:
    """Return whether most rows have another name than the row before: a column of states has not."""
    changes = sum(bool(a != b) for a, b in pairwise(table.columns[column].cells))
    return 2 * changes > len(table)
