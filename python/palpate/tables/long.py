"""Tables in long format: a row is one reading of one channel, with the name of the channel."""

from collections.abc import Collection
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.tables.clock_layout import is_time
from palpate.tables.numbers import NO_VALUE, is_number
from palpate.tables.table import Cells, Column, Table

_MOST = 100  # channels


def id_columns(table: Table, names: Collection[str]) -> list[int]:
    """Return the columns (from 0) that hold all of these names; without names, those that can hold names of channels.

    These have 2 to 100 different texts that are neither numbers nor times.
    """
    found = []
    for column in (n for n, each in enumerate(table.columns) if each.kind in "Tiu"):
        distinct = _distinct(table.columns[column].cells)
        if distinct.keys() >= set(names) if names else _are_names(distinct):
            found.append(column)
    return found


def spread(table: Table, column: int) -> dict[str, Table]:
    """Return the rows of each name in a column as a table, by this name, in the order of their first rows.

    The tables keep the numbers of the lines, and all columns at their positions: messages and maps hold for the file.
    """
    numbers: dict[str, int] = {}
    of_row = [numbers.setdefault(_text(cell), len(numbers)) for cell in table.columns[column].cells]
    order = np.argsort(np.array(of_row, np.intp), kind="stable")
    parts = np.split(order, np.cumsum(np.bincount(of_row))[:-1])
    return {name: _rows(table, rows) for name, rows in zip(numbers, parts, strict=True)}


def _rows(table: Table, rows: NDArray[np.intp]) -> Table:
    at = rows.tolist()
    lines = [table.lines[row] for row in at]
    return replace(table, columns=[_picked(column, rows, at) for column in table.columns], lines=lines)


def _picked(column: Column, rows: NDArray[np.intp], at: list[int]) -> Column:
    cells = column.cells
    return replace(column, cells=cells[rows] if isinstance(cells, np.ndarray) else [cells[row] for row in at])


def _distinct(cells: Cells) -> dict[str, None]:
    """Return the different cells, up to some more than there can be channels."""
    found: dict[str, None] = {}
    for cell in cells:
        found[_text(cell)] = None
        if len(found) > _MOST:
            break
    return found


def _text(cell: Any) -> str:
    return "" if cell is None else str(cell)


def _are_names(distinct: Collection[str]) -> bool:
    return 2 <= len(distinct) <= _MOST and all(map(_is_name, distinct))


def _is_name(cell: str) -> bool:
    return cell.upper() not in NO_VALUE and not is_number(cell) and not is_time(cell)
