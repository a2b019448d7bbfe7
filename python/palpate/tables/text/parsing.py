"""Text tables of loggers: finds their delimiter and splits their lines."""

import csv
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from palpate.errors import RecordingError
from palpate.tables.cell.kinds import NUMBER, TEXT, kind
from palpate.tables.table import Table
from palpate.tables.text.comma_twice import check_marks, has_decimal_commas
from palpate.tables.text.encoding import decoded
from palpate.tables.text.rows import Rows, table_of

MOST_COLUMNS = 1000
LONGEST = 100_000
"""Characters of a line, at most."""

_DELIMITERS = "\t;|,"
_SAMPLE = 64  # lines used to find the delimiter
_MOST_IN_CELL = 5  # lines of a cell in quotes
_COLUMN_GAP = re.compile(r"\t|  +")
_BRACKET = re.compile(r" (?=[(\[])")


class Gap(NamedTuple):
    """Lines of a file that are not given: how many, and after which line."""

    after: int
    lines: int

    def number(self, line: int) -> int:
        """Return the number that a given line has in the file."""
        return line if line <= self.after else line + self.lines


WHOLE = Gap(0, 0)
"""No lines are left out."""


def parse(path: Path, raw: bytes, gap: Gap = WHOLE) -> Table:
    """Read the contents of a text file as a table.

    Parameters
    ----------
    path : pathlib.Path
        For messages.
    raw : bytes
    gap : Gap, optional
        Lines of samples that are not in `raw`.

    Raises
    ------
    RecordingError
        Not text, no row of numbers, a row that does not belong to the others, or too many columns or header rows.
    """
    text = decoded(path, raw).replace("\r\n", "\n").replace("\r", "\n")
    lines = _closed(text.split("\n")) if '"' in text else text.split("\n")
    torn = gap.number(len(lines)) if lines[-1] else None
    delimiter = delimiter_of(lines)
    if _named_delimiter(lines[0]):
        lines[0] = ""
    rows = _rows(path, lines, delimiter)
    if gap.lines:
        rows = [(gap.number(line), cells) for line, cells in rows]

    def split_name(line: int, width: int) -> list[str] | None:
        other = delimiter is None or delimiter not in lines[line - 1]
        return _header_cells(lines[line - 1], width) if other else None

    table = table_of(path, rows, torn=torn, split_name=split_name)
    if delimiter == "," and not table.header_fits:
        check_marks(table)
    return table


def delimiter_of(lines: Sequence[str]) -> str | None:
    """Return the delimiter of the lines of a table: a tab where each is one number with a decimal comma; None for blanks."""
    if named := _named_delimiter(lines[0]):
        return named
    filled = [line for line in lines if line.strip()]
    delimiter = _delimiter(filled)
    decimal = delimiter == "," and filled and has_decimal_commas(filled[0], filled[len(filled) // 2 :][:_SAMPLE])
    return "\t" if decimal else delimiter


def _closed(lines: list[str]) -> list[str]:
    """Return lines; a cell in quotes that goes on in the next ones is in the first of them, and they are blank."""
    found = list(lines)
    for at, line in enumerate(lines):
        if found[at] and line.count('"') % 2:
            following = range(at + 1, min(at + _MOST_IN_CELL, len(lines)))
            end = next((other for other in following if lines[other].count('"') % 2), at)
            found[at : end + 1] = [" ".join(lines[at : end + 1]), *[""] * (end - at)]
    return found


def _rows(path: Path, lines: list[str], delimiter: str | None) -> Rows:
    """Return the number and the cells of each line."""
    found = []
    for number, line in enumerate(lines, 1):
        if len(line) > LONGEST:
            raise RecordingError(path, f"got a line of {len(line):,} characters, allowed: {LONGEST:,}", number)
        try:
            cells = cells_of(line, delimiter)
        except csv.Error as error:
            raise RecordingError(path, f"{error}: not a table", number) from error
        if len(cells) > MOST_COLUMNS:
            raise RecordingError(path, f"got {len(cells):,} columns, allowed: {MOST_COLUMNS:,}", number)
        found.append((number, cells))
    return found


def _named_delimiter(line: str) -> str | None:
    """Return the delimiter that the first line names for Excel, sep=; for example."""
    named = line.strip(' "').removeprefix("sep=")
    return named if named != line.strip(' "') and named in [*_DELIMITERS] else None


def _delimiter(lines: list[str]) -> str | None:
    """Return the delimiter with which the cells of most lines are understood; None for blanks."""
    body = lines if len(lines) <= _SAMPLE else lines[len(lines) // 2 :][:_SAMPLE]

    def understood(candidate: str | None) -> float:
        try:
            return sum(_share(cells_of(line[:LONGEST], candidate)[:MOST_COLUMNS]) for line in body)
        except csv.Error:
            return 0

    candidates: list[str | None] = [*_DELIMITERS, None]
    return max(candidates, key=understood)


def _share(cells: list[str]) -> float:
    """Return the share of the cells of a row that are not text; 0 for a row of one cell, or without a number."""
    kinds = [kind(cell) for cell in cells]
    return 1 - kinds.count(TEXT) / len(kinds) if NUMBER in kinds and len(kinds) > 1 else 0


def cells_of(line: str, delimiter: str | None) -> list[str]:
    """Return the cells of a line, without blanks around them."""
    if '"' in line:
        line = line if delimiter else " ".join(line.split())
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter or " "), [])]
    cells = line.split(delimiter)
    return [cell.strip() for cell in cells] if " " in line or not line.isascii() else cells


def _header_cells(line: str, width: int) -> list[str] | None:
    """Return the names in a line with other delimiters than the rows of numbers, if they are as many as columns."""
    splits = [[cell.strip() for cell in _COLUMN_GAP.split(line.strip())]]
    splits += [[cell.strip() for cell in line.split(delimiter)] for delimiter in _DELIMITERS]
    splits += [_BRACKET.sub("\0", line.strip()).split(), line.split()]
    return next(([cell.replace("\0", " ") for cell in cells] for cells in splits if len(cells) == width), None)
