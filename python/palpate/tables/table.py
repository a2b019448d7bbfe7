"""A table with named columns, of any format, the numbers in its columns, and what a user says about it."""

import math
import os
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.errors import RecordingError, listed, nearest, quoted, shortened, unlike
from palpate.tables.units import OVERLOAD, PICOFARADS, SECONDS, bare, simple_name, to_number

Array = NDArray[np.float64]
DECIMALS = {"point": ".", "comma": ","}


@dataclass(frozen=True, eq=False)
class Column:
    """A column: its name, "" without one; its cells, which are numbers, datetime64, timedelta64 or text; its unit."""

    name: str
    cells: NDArray[Any]
    unit: str = ""


@dataclass(frozen=True, eq=False)
class Table:
    """A table whose columns have the same length; `path` is its file, or the type of a frame, `lines` the line of each row."""

    path: Path
    columns: list[Column]
    lines: Sequence[int]
    notes: list[str] = field(default_factory=list)
    decimal: str = "."
    metadata: Mapping[bytes, bytes] = field(default_factory=dict)

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
        """Return the index (from 0) of the column with this name, or at this position (from 1); ValueError if not one."""
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
    """Return the numbers of a column, shape (n,), nan for a cell without a value; RecordingError: a cell is none of these."""
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
    try:
        return to_number("" if cell is None else str(cell).strip(), table.decimal)
    except ValueError:
        mark = next(name for name, sign in DECIMALS.items() if sign == table.decimal)
        why = f"is neither a number with a decimal {mark} nor an overload mark"
        raise table.refused(column, row, why) from None


_KEY = re.compile(r"(?:^|,)\s*(hard|soft|time|soft_time)\s*=")


def parsed_map(text: str) -> dict[str, str]:
    """Parse hard=COL,soft=COL[,time=COL][,soft_time=COL]; a name may contain commas."""
    parts = _KEY.split(text)
    if parts[0].strip() or len(parts) < 3 or len(set(parts[1::2])) < len(parts[1::2]):
        raise ValueError(f"map: got {quoted(text)}, allowed: hard=COL,soft=COL[,time=COL], each once")
    return {key: name.strip() for key, name in zip(parts[1::2], parts[2::2], strict=True)}


@dataclass(frozen=True)
class Asked:
    """What a user says about a table of another program, as in `palpate.read`; None: palpate finds it out."""

    columns: Mapping[str, str | int] | None = None
    unit: str | None = None
    time_unit: str | None = None
    rate: float | None = None
    decimal: str | None = None
    soft: str | os.PathLike[str] | None = None
    part: str | None = None

    def __post_init__(self) -> None:
        """Check the values."""
        words: dict[str, Collection[str]] = {"unit": PICOFARADS, "time_unit": SECONDS, "decimal": DECIMALS}
        for name, allowed in words.items():
            value = getattr(self, name)
            if value is not None and value not in allowed:
                raise ValueError(f"{name}: {unlike(value, allowed)}")
        if self.columns is not None:
            needed = {"hard"} if self.soft else {"hard", "soft"}
            if not needed <= set(self.columns) <= {"hard", "soft", "time", "soft_time"}:
                raise ValueError(
                    f"columns: got {listed(self.columns) or 'none'}, allowed: hard, soft and, if wanted, time, soft_time"
                )
            if self.rate is not None and {"time", "soft_time"} & set(self.columns):
                raise ValueError("rate: got it together with a column of times, allowed: one of them")
        if self.rate is not None and not (isinstance(self.rate, float | int) and 0 < self.rate < math.inf):
            raise ValueError(f"rate: got {quoted(self.rate)}, allowed: a number above 0, pairs a second")
