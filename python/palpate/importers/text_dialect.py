"""How the rows of a text are written: delimiter, decimal mark, kinds of the cells."""

import csv
import re
from functools import partial
from pathlib import Path
from statistics import mode
from typing import NamedTuple

from palpate.errors import RecordingError
from palpate.importers.table import DECIMAL_MARKS, Option, OptionError
from palpate.importers.units import CellKind, cell_kind
from palpate.messages import quoted

COMMENT = re.compile(r'["\s]*(?:[#%!]|//)')
COMMENT_SIGNS = ("#", "%", "!", "//")
DELIMITERS = "\t;|,"
_SAMPLE = 500  # characters, in the middle and at the end, that show the dialect
_MAYBE_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2},[0-9]{3}")


class Dialect(NamedTuple):
    """How rows are written: delimiter (None: blanks), decimal mark, kinds of the cells."""

    delimiter: str | None
    decimal_mark: str
    kinds: list[CellKind]

    @property
    def width(self) -> int:
        """Number of cells in a row."""
        return len(self.kinds)


def split_cells(line: str, delimiter: str | None) -> list[str]:
    """Return the cells of a line."""
    if delimiter is None:
        return [cell.strip('"') for cell in line.split()]
    if line and '"' not in line:
        cells = line.split(delimiter)
    else:
        rows = csv.reader([line], delimiter=delimiter, skipinitialspace=True)
        cells = next(rows, [])
    return list(map(str.strip, cells))


def cell_kinds(cells: list[str]) -> list[CellKind]:
    """Return what each cell contains."""
    return list(map(cell_kind, cells))


def count_values(kinds: list[CellKind]) -> int:
    """Return the number of numbers and times."""
    return kinds.count(CellKind.NUMBER) + kinds.count(CellKind.TIME)


def text_dialect(path: Path, text: str, decimal: str | None) -> Dialect:
    """Find how the rows are written, from lines in the middle and at the end.

    The decimal mark is ambiguous if all commas may separate thousands.
    """
    lines = sample_lines(text)
    if not lines:
        raise RecordingError(path, "nothing but blank lines", 1)
    delimiter = _delimiter(lines)
    rows = [split_cells(line, delimiter) for line in lines]
    commas = []
    for row in rows:
        for cell in row:
            if "," in cell and "." not in cell and cell_kind(cell) is CellKind.NUMBER:
                commas.append(cell)
    if decimal is None:
        decimal = "point"
        if commas:
            decimal = "comma"
            if all(map(_MAYBE_THOUSANDS.fullmatch, commas)):
                got = f"{quoted(commas[0])}, a decimal comma or a thousands separator?"
                allowed = 'decimal "point" or "comma" (--decimal)'
                raise OptionError(Option.DECIMAL, got, allowed)
    width = mode(map(len, rows))
    kinds = [cell_kinds(row) for row in rows if len(row) == width]
    most_values = max(kinds, key=count_values)
    return Dialect(delimiter, DECIMAL_MARKS[decimal], most_values)


def sample_lines(text: str) -> list[str]:
    """Return lines of the middle and of the end, without comments."""
    sample = ""
    half = text.find("\n", len(text) // 2)
    if half >= 0:
        sample = text[half + 1 : text.find("\n", half + _SAMPLE)]
    tail = text.rfind("\n", 0, max(len(text) - _SAMPLE, 0))
    lines = [*sample.split("\n"), *text[tail + 1 :].split("\n")]
    return [line for line in lines if line.strip() and not COMMENT.match(line)]


def _delimiter(lines: list[str]) -> str | None:
    """Return the delimiter with which lines have most numbers and times and fewest texts."""
    best = max(DELIMITERS, key=partial(_score, lines))
    needed = min(2 * len(lines), _score(lines, None))
    if "\t" in lines[-1] or _score(lines, best) >= needed:
        return best
    return None


def _score(lines: list[str], delimiter: str | None) -> int:
    score = 0
    for line in lines:
        kinds = cell_kinds(split_cells(line, delimiter))
        score += count_values(kinds) - kinds.count(CellKind.TEXT)
    return score
