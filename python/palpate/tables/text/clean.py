"""A text table whose lines are clean but for its first and last ones: its cells are read natively, block by block.

What its columns mean is found by the reader of all tables in the first lines and the last ones. It sees the same in them
as in the whole file: lines of plain numbers in between change nothing of its choice. Where that is not sure, or a line is
not clean, there is no clean table.
"""

import re
from array import array
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise
from operator import itemgetter
from pathlib import Path
from typing import Any, BinaryIO, Literal

import numpy as np
from numpy.typing import NDArray

from palpate._core import CleanRows
from palpate.errors import RecordingError
from palpate.tables.cell.decimals import is_plain
from palpate.tables.cell.kinds import TIME, kind
from palpate.tables.clean_cells import NumberCells, ShapedCells
from palpate.tables.packed import opened
from palpate.tables.table import CHANGED, Cells, Column, Table
from palpate.tables.text.parsing import Gap, cells_of, delimiter_of, parse
from palpate.tables.text.rows import MOST_HEADER_ROWS

HEADS = (1 << 13, 1 << 15, 1 << 18)
"""Bytes of the first lines, that the reader of all tables sees; more where so many have too few samples."""
PART = 1 << 20
FIRST = 1 << 15
"""Rows of a long table that are understood."""
SAMPLES = 200
"""Lines of samples, more than others, with which the lines in the middle are samples."""
MOST_BELOW = 50  # lines after the clean ones
Mark = Literal[".", ","]
_LOOKED_AT = 20  # lines, to find the columns
_DIGIT = re.compile("[0-9]")


def clean_table(path: Path, file: BinaryIO) -> Table | None:
    """Return the table of a text file that is open at its beginning; None: `parse` has to read it.

    The numbers, notes and messages are those of `parse`; columns of dates and times are read if all cells have one shape.

    Raises
    ------
    OSError
        As `palpate.tables.packed.opened`.
    """
    found = _read(path, file, None)
    return None if found is None else found[1]


def clean_stream(path: Path, file: BinaryIO) -> "CleanStream | None":
    """Return such a table as `clean_table` does, but only its first rows, and the way to all rows.

    Raises
    ------
    OSError
        As `palpate.tables.packed.opened`.
    """
    found = _read(path, file, FIRST)
    return None if found is None else CleanStream(found[1], found[0])


def _read(path: Path, file: BinaryIO, keep: int | None) -> "tuple[_Clean, Table] | None":
    head = b""
    for size in HEADS:
        head += file.read(size - len(head))
        begun = _begun(path, head, keep) if len(head) == size else None
        if begun is not None and begun.samples >= begun.others + SAMPLES + MOST_BELOW:
            tail = begun.read_on(head[begun.end :], file)
            table = None if tail is None else begun.table(head, tail)
            return None if table is None else (begun, table)
    return None


@dataclass
class _Clean:
    """The clean lines of a file: those of the first lines, and all that follow them."""

    path: Path
    delimiter: str | None
    decimal: Mark
    shapes: list[str]
    end: int
    """Where the first lines end."""
    others: int
    """Lines above the first one."""
    rows: CleanRows
    keep: int | None
    """Rows of which the numbers are kept, and those of their block; None: all."""
    samples: int = 0
    count: int = 0
    """Rows so far."""
    blocks: list[tuple[int, int, int]] = field(default_factory=list)
    """Of each block of lines, its place in the file, its size, and the number of its first row."""
    parts: list[list[NDArray[Any]]] = field(default_factory=list)
    last: list[list[str]] = field(default_factory=list)
    """Cells of the samples below them."""
    _shown: tuple[int, list[list[str]]] = (-1, [])

    def add(self, begin: int, data: bytes) -> int:
        """Read the clean lines of data that begins there in the file; return where they end."""
        used, arrays = self.rows.read(data)
        if used:
            self.blocks.append((begin, used, self.count))
            if self.keep is None or self.count < self.keep:
                self.parts.append(arrays)
            self.count += len(arrays[0])
        return used

    def read_on(self, data: bytes, file: BinaryIO) -> bytes | None:
        """Read the lines that follow the first ones, up to the last ones, which are returned; None: they are too many."""
        most, at = self.end // 4, self.end
        while part := file.read(PART):
            data += part
            used = self.add(at, data)
            at, data = at + used, data[used:]
            if len(data) > most and (b"\n" in data or len(data) > PART):
                return None
        return data if data.count(b"\n") < MOST_BELOW else None

    def table(self, head: bytes, tail: bytes) -> Table | None:
        """Return the table, if the reader of all tables says the same of the first and the last lines."""
        last = self.others + self.samples
        try:
            seen = parse(self.path, head[: self.end] + tail, Gap(last, self.count - self.samples))
            fits = list(seen.lines[: self.samples]) == [*range(self.others + 1, last + 1)] and self._fits(seen)
            below = self._add_last(
                [[column.cells[row] for column in seen.columns] for row in range(self.samples, len(seen))]
            )
        except (RecordingError, ValueError):
            return None
        if not (fits and below):
            return None
        cells = [self._cells(column) for column in range(len(self.shapes))]
        lines: range | array[int] = range(self.others + 1, self.others + self.count - len(self.last) + 1)
        if self.keep is not None:
            lines = lines[: len(cells[0])]
        elif self.last:
            lines = array("q", lines)
            lines.extend(seen.lines[self.samples :])
        columns = [Column(column.names, each) for column, each in zip(seen.columns, cells, strict=True)]
        return replace(seen, columns=columns, lines=lines)

    def _fits(self, seen: Table) -> bool:
        """Return whether the first row and the last one of the first lines have the same cells, and no units."""
        rows = [self._lines(self.blocks[0])[row] for row in (0, -1)]
        found = [[column.cells[row] for column in seen.columns] for row in (0, self.samples - 1)]
        return rows == found and not any(column.unit for column in seen.columns)

    def _add_last(self, rows: list[list[str | None]]) -> bool:
        """Add the samples below the clean lines; return whether they are clean, too."""
        self.last = [[cell or "" for cell in row] for row in rows]
        data = self._last_lines()
        return self.add(-1, data) == len(data) if data else True

    def _last_lines(self) -> bytes:
        return "".join((self.delimiter or " ").join(row) + "\n" for row in self.last).encode("ascii")

    def again(self) -> Iterator[list[NDArray[Any]]]:
        """Yield the cells of all columns, block by block, from the file.

        Raises
        ------
        RecordingError
            The file has changed.
        """
        rows = CleanRows(self.shapes, delimiter=self.delimiter or "", decimal=self.decimal)
        with opened(self.path) as file:
            _skip(file, self.blocks[0][0])
            for (begin, size, row), (_, _, end) in pairwise([*self.blocks, (0, 0, self.count)]):
                used, arrays = rows.read(self._last_lines() if begin < 0 else file.read(size))
                if (used, len(arrays[0])) != (size, end - row):
                    raise RecordingError(self.path, CHANGED)
                yield arrays

    def _cells(self, column: int) -> Cells:
        values = np.concatenate([part[column] for part in self.parts])
        for part in self.parts:
            part[column] = values[:0]
        if self.shapes[column]:
            return ShapedCells(values)
        mark = {".": "point", ",": "comma"}[self.decimal] if self.rows.marked[column] else ""
        return NumberCells(values, self, column, mark, self.rows.sure[column])

    def cell(self, row: int, column: int) -> str:
        """Return the text of a cell, both from 0."""
        number = bisect_right(self.blocks, row, key=itemgetter(2)) - 1
        block = self.blocks[number]
        if self._shown[0] != number:
            self._shown = number, self.last if block[0] < 0 else self._lines(block)
        try:
            return self._shown[1][row - block[2]][column]
        except IndexError:
            raise RecordingError(self.path, CHANGED) from None

    def _lines(self, block: tuple[int, int, int]) -> list[list[str]]:
        """Return the cells of the lines of a block, from the file."""
        begin, size, _ = block
        with opened(self.path) as file:
            _skip(file, begin)
            data = file.read(size).decode("ascii", "replace")
        return [cells_of(line, self.delimiter) for line in data.splitlines()]


@dataclass(frozen=True, eq=False)
class CleanStream:
    """A clean table that is read in parts.

    Attributes
    ----------
    first : Table
        Its first rows; its notes are on all rows.
    """

    first: Table
    _clean: _Clean

    @property
    def rows(self) -> int:
        """All rows."""
        return self._clean.count

    def parts(self, columns: list[int]) -> Iterator[list[NDArray[Any]]]:
        """Yield the numbers of some columns (from 0), of all rows."""
        for arrays in self._clean.again():
            yield [arrays[column] for column in columns]


def _skip(file: BinaryIO, size: int) -> None:
    """Go to a place in a file that is open at its beginning."""
    if file.seekable():
        file.seek(size)
        return
    for left in range(size, 0, -PART):
        file.read(min(left, PART))


def _begun(path: Path, head: bytes, keep: int | None) -> _Clean | None:
    """Return the clean lines at the end of the first bytes of a file; None: there are none, or it is open what they are."""
    end = head.rfind(b"\n") + 1
    found = _understood(head[:end].splitlines())
    if found is None:
        return None
    delimiter, decimal, shapes = found
    at = 0
    for _ in range(MOST_HEADER_ROWS):
        others = head[:at].replace(b"\r\n", b"\n").replace(b"\r", b"\n").count(b"\n")
        rows = CleanRows(shapes, delimiter=delimiter or "", decimal=decimal)
        clean = _Clean(path, delimiter, decimal, shapes, end, others, rows, keep)
        at += clean.add(at, head[at:end])
        if at == end:
            clean.samples = clean.count
            return clean if clean.samples else None
        at = head.index(b"\n", at) + 1
    return None


def _understood(lines: list[bytes]) -> tuple[str | None, Mark, list[str]] | None:
    """Return the delimiter, the decimal mark and the shapes of the cells of the last lines; None: it is open."""
    try:
        sample = [line.decode("ascii") for line in lines[-_LOOKED_AT:]]
    except UnicodeDecodeError:
        return None
    if not sample:
        return None
    delimiter = delimiter_of([lines[0].decode("ascii", "replace"), *sample])
    cells = [cells_of(line, delimiter) for line in sample]
    shapes = [_shape(cell) for cell in cells[-1]]
    if len(shapes) < 2 or None in shapes or "" not in shapes:
        return None
    numbers = [column for column, shape in enumerate(shapes) if shape == ""]
    comma = any("," in row[column] for row in cells for column in numbers if column < len(row))
    return delimiter, "," if comma else ".", [shape or "" for shape in shapes]


def _shape(cell: str) -> str | None:
    """Return "" for a plain number, the shape of a date or time, None for other cells."""
    if is_plain(cell):
        return ""
    return _DIGIT.sub("0", cell) if kind(cell) == TIME and cell[0].isdecimal() else None
