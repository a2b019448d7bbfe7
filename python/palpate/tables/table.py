"""A table with named columns, of any format."""

from array import array
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from palpate.errors import listed, nearest, quoted, shortened
from palpate.tables.clean_cells import NumberCells, ShapedCells
from palpate.tables.units import bare_name, unit_in

CHANGED = "has changed while it was read: read it again"
Cells = Sequence[str | None] | NDArray[Any]
"""The cells of a column: text, None where a row is too short; or an array of numbers, datetime64 or timedelta64."""


@dataclass(frozen=True, eq=False)
class Column:
    """A column of a table.

    Attributes
    ----------
    names : tuple of str
        All its names: the cells above it, from top to bottom, then all of them joined; empty without a header.
    cells : sequence of str, or numpy.ndarray, shape (n,)
        Text as in the file; or numbers, datetime64, timedelta64.
    unit : str
        Unit that the format has apart from the name; "" if none.
    """

    names: tuple[str, ...]
    cells: Cells
    unit: str = ""

    @property
    def kind(self) -> str:
        """That of the numpy dtype of the cells, as "f", "M" or "m"; "T" for text, "O" for what no column can be."""
        return self.cells.dtype.kind if isinstance(self.cells, np.ndarray) else "T"

    def take(self, rows: NDArray[np.intp], *, repeats: bool = False) -> "Column":
        """Return the column of some rows; `repeats`: the others repeat them."""
        cells = self.cells
        if isinstance(cells, np.ndarray):
            return replace(self, cells=cells[rows])
        if isinstance(cells, NumberCells | ShapedCells):
            return replace(self, cells=cells.take(rows, repeats=repeats))
        return replace(self, cells=[cells[row] for row in rows.tolist()])


@dataclass(frozen=True, eq=False)
class Table:
    """A table with named columns, all of the same length.

    Attributes
    ----------
    path : pathlib.Path
        The file, for messages; of a data frame the name of its type.
    columns : list of Column
    lines : sequence of int
        Number of the line of each row in the file, from 1.
    header : list of list of str
        The rows above the first row of numbers.
    notes : list of str
        What was left out: comments, summary rows, an incomplete last row.
    header_fits : bool
        Whether the lowest header row has as many cells as the rows; if not, names may belong to other columns.
    header_rate : str
        Samples a second, as the lines above the rows say; "" if they do not.
    """

    path: Path
    columns: list[Column]
    lines: Sequence[int]
    header: list[list[str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    header_fits: bool = True
    header_rate: str = ""

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.lines)

    @property
    def width(self) -> int:
        """The number of columns."""
        return len(self.columns)

    def take(self, rows: NDArray[np.intp], *, repeats: bool = False) -> "Table":
        """Return the table of some rows (from 0), with the numbers of their lines; `repeats`: the others repeat them."""
        lines = np.asarray(self.lines, np.int64)[rows] if len(rows) else ()
        columns = [column.take(rows, repeats=repeats) for column in self.columns]
        return replace(self, columns=columns, lines=array("q", lines))

    def names(self, column: int) -> tuple[str, ...]:
        """Return all names of a column (from 0)."""
        return self.columns[column].names

    def name(self, column: int) -> str:
        """Return the name of a column (from 0) as a message says it: the lowest of its header, or its position."""
        names = self.names(column)
        return shortened(names[-1]) if names else f"column {column + 1}"

    def unit(self, column: int, units: Collection[str]) -> str | None:
        """Return the unit of a column: its own, or that of its lowest name that has one; "%" or None."""
        texts = [self.columns[column].unit, *reversed(self.names(column))]
        return next((unit for text in texts if text and (unit := unit_in(text, units))), None)

    @cached_property
    def _columns(self) -> list[dict[str, list[int]]]:
        """The columns of each name, stripped, and bare."""
        found: list[dict[str, list[int]]] = []
        for simplify in _SIMPLER:
            columns: dict[str, list[int]] = {}
            for column in range(self.width):
                for name in {simplify(name) for name in self.names(column)}:
                    columns.setdefault(name, []).append(column)
            found.append(columns)
        return found

    def column(self, wanted: str | int) -> int:
        """Return the index (from 0) of the column with this name, or at this position (from 1).

        A text that is exactly one column's name is no position.

        Raises
        ------
        ValueError
            No column, or several columns have this name.
        """
        text = str(wanted).strip()
        if isinstance(wanted, str) and len(exact := self._of_name(text)) == 1:
            self._require_header_that_fits()
            return exact[0]
        if text.isdecimal() and len(text) < 10:
            if not 1 <= int(text) <= self.width:
                raise ValueError(f"column: got position {text}, allowed: 1 to {self.width}")
            return int(text) - 1
        for simplify, columns in zip(_SIMPLER, self._columns, strict=True):
            found = columns.get(simplify(text), [])
            if len(found) == 1:
                self._require_header_that_fits()
                return found[0]
            if found:
                positions = listed([str(column + 1) for column in found])
                raise ValueError(
                    f"column: got {quoted(text)}, the name of several columns, allowed: one of the positions {positions}"
                )
        names = [name for column in self.columns for name in column.names]
        raise ValueError(f"column: got {quoted(text)}, allowed: {self.describe()}{nearest(text, names)}")

    def _of_name(self, text: str) -> list[int]:
        return [number for number, column in enumerate(self.columns) if column.names and column.names[-1] == text]

    def require_clear(self, wanted: str | int) -> None:
        """Refuse a whole number that is one column's position and another one's label, as of a frame with integer labels.

        Raises
        ------
        ValueError
            It is both.
        """
        if isinstance(wanted, str):
            return
        labelled = self._of_name(str(wanted))
        if labelled and 1 <= wanted <= self.width and labelled != [wanted - 1]:
            raise ValueError(
                f"column: got {wanted}, a position and the label of another column, allowed: a label as text, "
                f'"{wanted}" for column {labelled[0] + 1} of {self.describe()}'
            )

    def _require_header_that_fits(self) -> None:
        if not self.header_fits:
            raise ValueError(
                f"column: the header has {len(self.header[-1])} cells, but the rows have {self.width}: a name may belong "
                "to another column; allowed: positions, counted from 1"
            )

    def describe(self) -> str:
        """Return positions and names of the columns as text; of many columns those of the first ones."""
        return listed([f"{c} ({self.name(c - 1)})" if self.names(c - 1) else str(c) for c in range(1, self.width + 1)])


_SIMPLER: tuple[Callable[[str], str], ...] = (str.strip, bare_name)
"""A name is compared as it is, then as its bare name."""


class Stream(Protocol):
    """A table that is read in parts, as often as wanted."""

    @property
    def first(self) -> Table:
        """Its first rows; its notes are on all rows."""

    @property
    def rows(self) -> int:
        """All rows."""

    def parts(self, columns: list[int]) -> Iterator[list[NDArray[np.float64]]]:
        """Yield the numbers of some columns (from 0), of all rows."""
