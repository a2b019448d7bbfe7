"""The cells of a sheet of an Excel workbook: ECMA-376 Part 1, 18.3.1.4."""

import re
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

from palpate.errors import RecordingError, quoted
from palpate.tables.readers.package import Tags
from palpate.tables.text.parsing import MOST_COLUMNS

MOST_ROWS = 1 << 20
"""Rows of a sheet, at most, as in Excel."""
MOST_CELLS = 50_000_000
"""Cells of a sheet, at most; empty ones on the left of a value count, too."""
LONGEST_TEXT = 32_767
"""Characters of a cell, at most, as in Excel."""

_LETTERS = 26
_TEXTS = frozenset({"v", "f", "t"})


def longer(text: str, part: str) -> str:
    """Return a text with the part after it; ValueError if it is too long for a cell."""
    if len(text) + len(part) > LONGEST_TEXT:
        raise ValueError(f"a text of more than {LONGEST_TEXT:,} characters")
    return text + part


class Cells:
    """Takes the tags of a sheet, and makes rows of cells.

    Parameters
    ----------
    path : pathlib.Path
        For messages.
    text : callable
        Returns the text of a cell, from its kind, style, value, and formula or None.
    """

    def __init__(self, path: Path, text: Callable[[str, int, str, str | None], str]) -> None:
        self._path, self._text = path, text
        self._rows: list[tuple[int, list[str]]] = []
        self._count = self._size = self._row = 0
        self._column = -1
        self._cells: list[str] = []
        self._given: dict[str, str] = {}
        self._parts: dict[str, str] = {}

    def taken(self) -> list[tuple[int, list[str]]]:
        """Return the rows that are complete since the last call: those that are not empty."""
        rows, self._rows = self._rows, []
        return rows

    def begin(self, tags: Tags, given: dict[str, str]) -> None:
        """Take the begin of a tag."""
        tag = tags[-1]
        if tag == "c":
            self._given, self._parts = given, {}
        elif tag == "row":
            self._count, self._row = self._count + 1, int(given.get("r", self._row + 1))
            self._cells, self._column = [], -1
            if max(self._count, self._row) > MOST_ROWS or self._size > MOST_CELLS:
                reason = f"more than {MOST_ROWS:,} rows or {MOST_CELLS:,} cells in a sheet"
                raise RecordingError(self._path, reason, self._row)
        elif tag in _TEXTS:
            self._parts.setdefault(tag, "")

    def add(self, tags: Tags, text: str) -> None:
        """Take text; signs for the pronunciation are left out."""
        if tags[-1] in _TEXTS and "rPh" not in tags:
            self._parts[tags[-1]] = longer(self._parts[tags[-1]], text)

    def end(self, tags: Tags) -> None:
        """Take the end of a tag."""
        if tags[-1] == "c":
            self._place()
        elif tags[-1] == "row" and self._cells:
            self._rows.append((self._row, self._cells))

    def _place(self) -> None:
        given, parts = self._given, self._parts
        reference = given.get("r")
        self._column = column_of(reference.rstrip("0123456789")) if reference else self._column + 1
        kind, style = given.get("t", "n"), int(given.get("s", 0))
        text = self._text(kind, style, parts.get("t" if kind == "inlineStr" else "v", ""), parts.get("f"))
        if not text:
            return
        if self._column >= MOST_COLUMNS:
            reason = f"got a value in column {self._column + 1:,}, allowed: {MOST_COLUMNS:,} columns"
            raise RecordingError(self._path, reason, self._row)
        if (new := self._column + 1 - len(self._cells)) > 0:
            self._cells += [""] * new
            self._size += new
        self._cells[self._column] = text


@lru_cache(maxsize=MOST_COLUMNS)
def column_of(letters: str) -> int:
    """Return the number of a column, from 0.

    Examples
    --------
    >>> column_of("A"), column_of("XFD")
    (0, 16383)
    """
    if not re.fullmatch("[A-Z]{1,3}", letters):
        raise ValueError(f"got {quoted(letters)} as a column, allowed: A to XFD")
    number = 0
    for letter in letters:
        number = number * _LETTERS + ord(letter) - ord("A") + 1
    return number - 1
