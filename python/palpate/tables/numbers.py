"""Numbers in the cells of a table."""

import math
import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.errors import RecordingError, quoted
from palpate.tables.table import Table

_MARKS = """
    OL +OL -OL OVL OVLD OVER OVERLOAD OVERFLOW OVFL OPEN ERR ERROR NAN NA N/A NULL NONE - -- ---
    INF +INF -INF #N/A #NUM! #VALUE! #DIV/0!
"""
NO_VALUE = frozenset({"", *_MARKS.split()})
"""Cells (upper case) that mean "no value" in the files of loggers and spreadsheets."""

OVERLOAD = 1e30
"""Numbers of this magnitude mean "no value": SCPI instruments send 9.9E+37."""

_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?$")


def numbers(table: Table, column: int, decimal: str | None = None) -> NDArray[np.float64]:
    """Return the numbers of a column, shape (n,); nan for a cell without a value.

    A column that is an array of float64 is returned as it is, without a copy.

    Parameters
    ----------
    table : Table
    column : int
        From 0.
    decimal : str, optional
        Decimal mark, "point" or "comma", if the cells leave it open.

    Raises
    ------
    RecordingError
        A cell is neither a number nor one of `NO_VALUE`: with its line and column.
    ValueError
        The cells leave the decimal mark open.
    """
    cells = table.columns[column].cells
    if isinstance(cells, np.ndarray):
        return _of_array(table, column, cells)
    values = np.empty(len(cells))
    for row, cell in enumerate(cells):
        if cell is None:
            raise RecordingError(
                table.path, f"the row ends before column {column + 1} ({table.name(column)})", table.lines[row]
            )
        try:
            values[row] = to_number(cell)
        except ValueError:
            reason = (
                f"{quoted(cell)} in column {column + 1} ({table.name(column)}) is neither a number nor an overload mark"
            )
            raise RecordingError(table.path, reason, table.lines[row]) from None
    return values


def _of_array(table: Table, column: int, cells: NDArray[Any]) -> NDArray[np.float64]:
    if cells.dtype.kind in "mM":
        raise RecordingError(table.path, f"column {column + 1} ({table.name(column)}): got times, allowed: numbers")
    values = np.asarray(cells, float)
    over = np.abs(values) >= OVERLOAD
    return np.where(over, math.nan, values) if over.any() else values


def is_number(cell: str) -> bool:
    """Return whether a cell is a number."""
    try:
        return not math.isnan(to_number(cell))
    except ValueError:
        return False


def to_number(cell: str) -> float:
    """Return the value of a cell; nan if it is one of `NO_VALUE`.

    Raises
    ------
    ValueError
        Neither a number nor one of `NO_VALUE`.
    """
    if cell.upper() in NO_VALUE:
        return math.nan
    if "_" in cell:
        raise ValueError(cell)
    cell = cell.replace("\u2212", "-")
    value = float(cell.replace(",", ".") if _DECIMAL_COMMA.match(cell) else cell)
    return value if abs(value) < OVERLOAD else math.nan


def is_data(cells: list[str]) -> bool:
    """Return whether more than half of the filled cells are numbers or "no value", and at least one is a number."""
    filled = [cell for cell in cells if cell]
    marks = sum(cell.upper() in NO_VALUE for cell in filled)
    numbers = sum(map(is_number, filled))
    return numbers > 0 and 2 * (numbers + marks) > len(filled)
