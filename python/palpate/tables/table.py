"""A table with named columns, of any format, and the numbers in its columns."""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.errors import RecordingError, listed, nearest, quoted, shortened
from palpate.tables.units import NO_VALUE, OVERLOAD, bare, simple_name

Array = NDArray[np.float64]
DECIMALS = {"point": ".", "comma": ","}
_NUMBERS = {mark: re.compile(rf"[+-]?(?:\d+\{mark}?\d*|\{mark}\d+)(?:[eE][+-]?\d+)?") for mark in ".,"}


@dataclass(frozen=True, eq=False)
class Column:
    """A column: its name, "" without one; its cells, which are numbers, datetime64, timedelta64 or text; its unit."""

    name: str
    cells: NDArray[Any]
    unit: str = ""


@dataclass(frozen=True, eq=False)
class Table:
    """A table whose columns have the same length.

    `path` is the file, or the type of a data frame, for messages. `lines` has the line number of each row, from 1.
    `decimal` is the decimal mark of the text.
    """

    path: Path
    columns: list[Column]
    lines: Sequence[int]
    notes: list[str] = field(default_factory=list)
    decimal: str = "."

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.lines)

    def place(self, column: int) -> str:
        """Return position and name of a column (from 0), for messages."""
        return f"column {column + 1} ({self.name(column)})"

    def name(self, column: int) -> str:
        """Return the name of a column (from 0), or its position."""
        return shortened(self.columns[column].name) or f"column {column + 1}"

    def label(self, column: int) -> str:
        """Return the name of a column without its unit, or its position."""
        return bare(self.name(column)) or self.name(column)

    def named(self, names: Collection[str]) -> list[int]:
        """Return the columns (from 0) that have one of these simple names."""
        return [at for at, each in enumerate(self.columns) if simple_name(each.name) in names]

    def describe(self) -> str:
        """Return positions and names of the columns."""
        return listed([f"{at} ({each.name})" if each.name else str(at) for at, each in enumerate(self.columns, 1)])

    def column(self, wanted: str | int) -> int:
        """Return the index (from 0) of the column with this name, or at this position (from 1).

        Raises
        ------
        ValueError
            No column, or several columns are meant: with the columns that there are.
        """
        text, names = str(wanted).strip(), [each.name.strip() for each in self.columns]
        like = [at for at, name in enumerate(names) if bare(name).casefold() == bare(text).casefold()]
        found = {at for at, name in enumerate(names) if name == text} or {*like}
        if text.isdecimal() and len(text) < 10 and 0 < int(text) <= len(names):
            found.add(int(text) - 1)
        if len(found) != 1:
            what = f"the name or position of {len(found)} columns" if found else "no column"
            raise ValueError(
                f"column: got {quoted(wanted)}, {what}, allowed: one of {self.describe()}{nearest(text, names)}"
            )
        return found.pop()

    def refused(self, column: int, row: int, why: str) -> RecordingError:
        """Return the error for a cell."""
        cell = self.columns[column].cells[row]
        shown = "an empty cell" if cell is None or cell == "" else quoted(str(cell))
        return RecordingError(self.path, f"{shown} in {self.place(column)} {why}", self.lines[row])

    def refuse(self, column: int, wrong: NDArray[np.bool_], why: str) -> None:
        """Raise the error for the first of some wrong cells, if there is one."""
        if wrong.any():
            raise self.refused(column, int(np.argmax(wrong)), why)


def numbers(table: Table, column: int) -> Array:
    """Return the numbers of a column, shape (n,); nan for a cell without a value.

    Raises
    ------
    RecordingError
        A cell is neither a number nor one of `NO_VALUE`: with its line and column.
    """
    cells = table.columns[column].cells
    if cells.dtype.kind in "bmM":
        what = "True and False" if cells.dtype.kind == "b" else "times"
        raise RecordingError(table.path, f"{table.place(column)}: got {what}, allowed: numbers")
    if cells.dtype.kind in "iuf":
        values = np.asarray(cells, float)
    else:
        values = np.array([_number(table, column, row, cell) for row, cell in enumerate(cells)], float)
    if len(values) and not (values.min() > -OVERLOAD and values.max() < OVERLOAD):  # also of a nan
        return np.where(np.abs(values) < OVERLOAD, values, np.nan)
    return values


def _number(table: Table, column: int, row: int, cell: Any) -> float:
    text = "" if cell is None else str(cell).strip()
    if text.upper() in NO_VALUE:
        return np.nan
    if not _NUMBERS[table.decimal].fullmatch(text):
        mark = next(name for name, sign in DECIMALS.items() if sign == table.decimal)
        raise table.refused(column, row, f"is neither a number with a decimal {mark} nor an overload mark")
    return float(text.replace(",", "."))
