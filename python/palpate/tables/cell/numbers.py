"""Numbers in the cells of a table."""

import math
import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.errors import RecordingError, quoted
from palpate.tables.cell.decimals import MARKS, Written, plain, sure_marks, written
from palpate.tables.clean_cells import NumberCells, ShapedCells
from palpate.tables.table import Table
from palpate.tables.units import PICOFARADS, SECONDS, unit_in

_MARKS = """
    OL +OL -OL OVL OVLD OVER OVERLOAD OVERFLOW OVFL OPEN ERR ERROR NAN NA N/A NULL NONE - -- ---
    INF +INF -INF #N/A #NUM! #VALUE! #DIV/0! #REF! #NAME? #NULL!
"""
NO_VALUE = frozenset({"", *_MARKS.split()})
"""Cells (upper case) that mean "no value" in the files of loggers and spreadsheets."""

OVERLOAD = 1e30
"""Numbers of this magnitude mean "no value": SCPI instruments send 9.9E+37."""

_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?$")
_OVERLOAD = re.compile(r"[+-]?+9[.,]9[0-9]*+[eE]\+?+3[0-9]")
_FLAGS = "*!<>~?#≈≤≥ "
UNITS = PICOFARADS | SECONDS
"""The units that a cell may have after its number."""

Array = NDArray[np.float64]


def numbers(table: Table, column: int, decimal: str | None = None) -> Array:
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
        A cell is neither a number nor one of `NO_VALUE`, or has another decimal mark than the cells above it: with
        its line and column.
    ValueError
        The cells leave the decimal mark open.
    """
    cells = table.columns[column].cells
    if isinstance(cells, np.ndarray):
        return _of_array(table, column, cells)
    if isinstance(cells, NumberCells) and cells.known and not (cells.mark and decimal not in (None, cells.mark)):
        if cells.mark and decimal is None:
            _check_mark(table, column, cells, cells.mark)
        return _in_range(cells.values)
    if None in cells:
        reason = f"the row ends before column {column + 1} ({table.name(column)})"
        raise RecordingError(table.path, reason, table.lines[cells.index(None)])
    texts: list[str] = list(cells)  # type: ignore[arg-type]
    values = _clean(table, column, texts, decimal)
    if values is None:
        filled = ["nan" if cell.upper() in NO_VALUE or _OVERLOAD.fullmatch(cell) else cell for cell in texts]
        values = _clean(table, column, filled, decimal)
    if values is None:
        values = _each(table, column, filled, decimal)
    values[~(np.abs(values) < OVERLOAD)] = math.nan
    return values


def _of_array(table: Table, column: int, cells: NDArray[Any]) -> Array:
    if table.columns[column].kind == "b":
        raise RecordingError(
            table.path, f"column {column + 1} ({table.name(column)}): got True and False, allowed: numbers"
        )
    if cells.dtype.kind in "mM":
        raise RecordingError(table.path, f"column {column + 1} ({table.name(column)}): got times, allowed: numbers")
    return _in_range(np.asarray(cells, float))


def _in_range(values: Array) -> Array:
    if are_below(values, OVERLOAD):
        return values
    over = np.abs(values) >= OVERLOAD
    return np.where(over, math.nan, values) if over.any() else values


def are_below(values: NDArray[Any], limit: float) -> bool:
    """Return whether all values are numbers of a magnitude below a limit."""
    return not len(values) or bool(-limit < values.min() and values.max() < limit)  # nan is not


def _clean(table: Table, column: int, cells: list[str], decimal: str | None) -> Array | None:
    """Return the numbers of cells with one decimal mark and no groups; None: a cell is something else."""
    mark = "comma" if any("," in cell for cell in cells) else "point"
    both = mark == "comma" and any("." in cell for cell in cells)
    if both or decimal not in (None, mark) or any("_" in cell for cell in cells):
        return None
    texts = [cell.replace(",", ".") for cell in cells] if mark == "comma" else cells
    try:
        values = np.array([*map(float, texts)])
    except ValueError:
        return None
    if decimal is None:
        _check_mark(table, column, cells, mark)
    return values


def _check_mark(table: Table, column: int, cells: Sequence[str], mark: str) -> None:
    """Refuse cells that can all be whole numbers with groups of digits, unless other columns settle it."""
    if _sure_marks(cells):
        return
    doubtful = next((cell for cell in cells if MARKS[mark] in cell), None)
    if doubtful is None:
        return
    others: set[str] = set()
    for other in table.columns:
        if other.kind == "T" and other is not table.columns[column]:
            others |= _sure_marks(other.cells)
    if others != {mark} and (others or mark == "comma"):
        raise ValueError(
            f"decimal: got {quoted(doubtful)} in column {column + 1} ({table.name(column)}), a decimal {mark} or a "
            'thousands separator? allowed: decimal "point" or "comma" (--decimal)'
        )


def _sure_marks(cells: Any) -> set[str]:
    if isinstance(cells, ShapedCells):
        return sure_marks(cells[:1])  # the shape says it
    if isinstance(cells, NumberCells) and cells.known:
        return {cells.mark} if cells.sure else set()
    return sure_marks(cells)


def _each(table: Table, column: int, cells: list[str], decimal: str | None) -> Array:
    """Return the numbers of cells one by one: some have groups of digits, or are wrong."""
    found: list[Written | None] = []
    for row, cell in enumerate(cells):
        number = None if cell == "nan" else written(cell)
        if cell != "nan" and (number is None or number.unit):
            raise _refused(table, column, row, _why(cell, number, table.columns[column].unit))
        found.append(number)
    mark = decimal or next((number.sure for number in found if number and number.sure), None)
    if mark is None:
        mark = "point" if any("." in cell for cell in cells) else "comma"
        _check_mark(table, column, cells, mark)
    groups = {number.groups for number in found if number} if decimal is None else set(MARKS.values())
    other = MARKS["comma" if mark == "point" else "point"]
    values = np.full(len(cells), math.nan)
    for row, number in enumerate(found):
        if number is None:
            continue
        value = number.value(mark)
        if value is None or (other in cells[row] and other not in groups):
            whose = "as other cells" if decimal is None else "as asked"
            raise _refused(table, column, row, f"is not a number with a decimal {mark}, {whose}")
        values[row] = value
    return values


def _why(cell: str, number: Written | None, unit: str) -> str:
    """Return why a cell is not a number."""
    if number and number.unit == "%":
        return "is in per cent, allowed: a number"
    if number and unit_in(number.unit, UNITS):
        return f"has the unit {number.unit}, other cells {'have ' + unit if unit else 'have another one, or none'}"
    if written(cell.strip(_FLAGS)) and not cell.startswith(" "):
        return "is a number with a mark, the meaning of which is not known: take the mark away, or the row"
    return "is neither a number nor an overload mark"


def _refused(table: Table, column: int, row: int, why: str) -> RecordingError:
    cell = table.columns[column].cells[row]
    reason = f"{quoted(cell)} in column {column + 1} ({table.name(column)}) {why}"
    return RecordingError(table.path, reason, table.lines[row])


def is_number(cell: str) -> bool:
    """Return whether a cell is a number, in any notation, without a unit."""
    number = written(cell)
    return number is not None and not number.unit


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
    cell = plain(cell)
    value = float(cell.replace(",", ".") if _DECIMAL_COMMA.match(cell) else cell)
    return value if abs(value) < OVERLOAD else math.nan
