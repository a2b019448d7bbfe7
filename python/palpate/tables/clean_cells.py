"""Cells of a clean table: numbers, and texts of one shape, as compact arrays that look like sequences of texts."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, overload

import numpy as np
from numpy.typing import NDArray


class Texts(Protocol):
    """Where the text of a number is."""

    def cell(self, row: int, column: int) -> str:
        """Return the text of a cell, both from 0."""


class _Cells(Sequence[str]):
    """A sequence of texts, of which a subclass gives one at a time."""

    def _text(self, row: int) -> str:
        raise NotImplementedError

    @overload
    def __getitem__(self, at: int) -> str: ...

    @overload
    def __getitem__(self, at: slice) -> list[str]: ...

    def __getitem__(self, at: int | slice) -> str | list[str]:
        """Return a text, or several."""
        rows = range(len(self))[at]
        return self._text(rows) if isinstance(rows, int) else [self._text(row) for row in rows]

    def __iter__(self) -> Iterator[str]:
        """Yield the texts."""
        return map(self._text, range(len(self)))


@dataclass(frozen=True, eq=False)
class NumberCells(_Cells):
    """Plain numbers: equal bits of neighbours are equal texts.

    Attributes
    ----------
    values : numpy.ndarray, shape (n,)
    texts : Texts
        The file: a text is read again when someone wants it.
    column : int
        From 0.
    mark : str
        "point" or "comma", if a number has this decimal mark; "" if none has one.
    sure : bool
        Whether one has it where no mark of groups of digits can be.
    rows : numpy.ndarray, shape (n,), optional
        Numbers of the rows in the file; default: all.
    known : bool
        Whether `mark` and `sure` hold of these rows.
    """

    values: NDArray[np.float64]
    texts: Texts
    column: int
    mark: str
    sure: bool
    rows: NDArray[np.intp] | None = None
    known: bool = True

    def __len__(self) -> int:
        """Return the number of cells."""
        return len(self.values)

    def _text(self, row: int) -> str:
        return self.texts.cell(row if self.rows is None else int(self.rows[row]), self.column)

    def take(self, rows: NDArray[np.intp], *, repeats: bool) -> "NumberCells":
        """Return some cells; `repeats`: the others repeat them."""
        known = self.known and (repeats or not self.mark)
        inner = rows if self.rows is None else self.rows[rows]
        return replace(self, values=self.values[rows], rows=inner, known=known)

    def same_as_before(self) -> NDArray[np.bool_]:
        """Return for each cell but the first whether its text is that of the one before."""
        bits = self.values.view(np.int64)
        same: NDArray[np.bool_] = bits[1:] == bits[:-1]
        return same


@dataclass(frozen=True, eq=False)
class ShapedCells(_Cells):
    """Dates or times with their digits at the same places.

    Attributes
    ----------
    characters : numpy.ndarray of bytes, shape (n,)
    """

    characters: NDArray[np.bytes_]

    def __len__(self) -> int:
        """Return the number of cells."""
        return len(self.characters)

    def _text(self, row: int) -> str:
        return bytes(self.characters[row]).decode("ascii")

    def take(self, rows: NDArray[np.intp], *, repeats: bool) -> "ShapedCells":
        """Return some cells."""
        return ShapedCells(self.characters[rows])

    def same_as_before(self) -> NDArray[np.bool_]:
        """Return for each cell but the first whether its text is that of the one before."""
        same: NDArray[np.bool_] = self.characters[1:] == self.characters[:-1]
        return same


def are_clean(cells: Any) -> bool:
    """Return whether cells are compact arrays: all are numbers, or all are dates or times."""
    return isinstance(cells, NumberCells | ShapedCells)
