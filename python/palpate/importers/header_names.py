"""The names of the columns of a text: rows of names, of units, names of rows, too few names."""

import re
from pathlib import Path
from typing import NamedTuple

from palpate.errors import RecordingError
from palpate.importers.text_dialect import (
    COMMENT,
    DELIMITERS,
    Dialect,
    cell_kinds,
    count_values,
    split_cells,
)
from palpate.importers.units import SUMMARY, CellKind, is_unit_word
from palpate.messages import listed, quoted

_MOST_NAME_ROWS = 4
_COUNTED_ROWS = 3  # that show that a column has the numbers of the rows
_VALUES = (CellKind.NUMBER, CellKind.TIME)
_COMMENT_NAMES = frozenset(
    {"comment", "comments", "note", "notes", "remark", "remarks", "bemerkung"}
)
ROW_NAMES = "row"
"""Name of the column of the names of rows."""


class HeaderNames(NamedTuple):
    """The names of the columns above the rows.

    Attributes
    ----------
    names : list of str
        Joined from up to four rows, one for each column; "" where there is none.
    numbers : dict
        From the row of units: the numbers in columns that have no values below, by their name.
    unmatched : list of str
        Names whose columns are unknown, as their number differs.
    notes : list of str
    """

    names: list[str]
    numbers: dict[str, str]
    unmatched: list[str]
    notes: list[str]


def header_names(
    path: Path, above: list[str], first_rows: list[str], dialect: Dialect, *, has_points: bool
) -> HeaderNames:
    """Return the names of the columns.

    Parameters
    ----------
    path : pathlib.Path
    above : list of str
        The lines above the first row.
    first_rows : list of str
    dialect : Dialect
    has_points : bool
        Whether there is a point in the rows.

    Raises
    ------
    RecordingError
        Rows of statistics are above the names, or commas are decimal marks and delimiters.
    """
    filled = list(filter(str.strip, above))
    units: list[str] = []
    if filled:
        units = _units(filled[-1], dialect)
    if units:
        filled = filled[:-1]
    rows = _name_rows(path, above, filled, dialect, has_units=bool(units))
    if rows:
        return _joined(rows, units, dialect)
    notes: list[str] = []
    unmatched: list[str] = []
    if filled:
        _refuse_decimal_commas(path, len(above) + 1, filled[-1], dialect, has_points=has_points)
        unmatched = _texts_in(filled[-1], dialect)
    names = _shifted(unmatched, first_rows, dialect)
    if names:
        notes.append("one name fewer than columns: the first column has the names of the rows")
        return HeaderNames(names, {}, [], notes)
    names = _without_comment(unmatched, dialect)
    if names:
        notes.append(f"no cell is below the name {quoted(unmatched[-1])}")
        return HeaderNames(names, {}, [], notes)
    if units:
        return HeaderNames(units, {}, [], notes)
    if unmatched:
        found = f"{len(unmatched)} names ({listed(unmatched)}) above {dialect.width} columns"
        notes.append(f"{found}: not used, as it is unknown which is which")
    return HeaderNames([""] * dialect.width, {}, unmatched, notes)


def _name_rows(
    path: Path, above: list[str], filled: list[str], dialect: Dialect, *, has_units: bool
) -> list[list[str]]:
    """Return the rows of names above the rows of numbers, from top to bottom."""
    rows: list[list[str]] = []
    for line in filled[: -_MOST_NAME_ROWS - 1 : -1]:
        line = _uncommented(line)
        cells = _name_cells(line, dialect, is_last=not rows)
        kinds = cell_kinds(cells)
        is_numbered = has_units and not rows and kinds[:1] == [CellKind.TEXT]  # x-axis,1,2
        if not is_numbered:
            few_texts = kinds.count(CellKind.TEXT) < min(2, dialect.width)
            if not cells or count_values(kinds) or few_texts:
                break
        if rows and all(map(SUMMARY.match, filter(None, cells))):
            number = 1
            while not above[number - 1].endswith(line):
                number += 1
            found = f"{quoted(line.strip())} above the names is of statistics, not of samples"
            raise RecordingError(path, f"{found}: take these rows out", number)
        rows.insert(0, cells)
    return rows


def _units(line: str, dialect: Dialect) -> list[str]:
    """Return the cells of a row of units: a unit in each column of numbers; else an empty list."""
    cells = _name_cells(_uncommented(line), dialect, is_last=True)
    of_values = []
    for cell, kind in zip(cells, dialect.kinds, strict=False):
        if kind in _VALUES:
            of_values.append(cell.strip("()[]"))
    filled = list(filter(None, of_values))
    if len(filled) < 2 or not all(map(is_unit_word, filled)):
        return []
    return cells


def _joined(rows: list[list[str]], units: list[str], dialect: Dialect) -> HeaderNames:
    """Return the names of several rows, with the units in brackets."""
    names = [" ".join(filter(None, words)) for words in zip(*rows, strict=True)]
    numbers = {}
    for index, unit in enumerate(units):
        if dialect.kinds[index] in _VALUES:
            unit = unit.strip("()[]")
            if unit:
                names[index] += f" ({unit})"
        elif unit:
            numbers[names[index]] = unit
    return HeaderNames(names, numbers, [], [])


def _refuse_decimal_commas(
    path: Path, line: int, header: str, dialect: Dialect, *, has_points: bool
) -> None:
    """Refuse rows with more cells than names, if commas may be both delimiter and decimal mark."""
    if has_points or dialect.delimiter != ",":
        return
    names = split_cells(_uncommented(header), ",")
    if 1 < len(names) < dialect.width:
        found = f"got {dialect.width} cells below {len(names)} names"
        question = "commas separate the cells and are decimal marks?"
        reason = f"{found}: {question} save it with another delimiter"
        raise RecordingError(path, reason, line)


def _texts_in(line: str, dialect: Dialect) -> list[str]:
    """Return the names in a line that has another number of them than there are columns."""
    cells = []
    for cell in split_cells(_uncommented(line), dialect.delimiter):
        cells.append(cell.strip('"'))
    while cells and not cells[-1]:
        del cells[-1]
    kinds = cell_kinds(cells)
    if len(cells) < 2 or kinds.count(CellKind.TEXT) < len(cells):
        return []
    return cells


def _shifted(names: list[str], first_rows: list[str], dialect: Dialect) -> list[str]:
    """Return the names with one before them, if the rows begin with their number, as R's do."""
    if len(names) != dialect.width - 1:
        return []
    first_cells = []
    for row in first_rows:
        first_cells.append(split_cells(row, dialect.delimiter)[0])
    are_counted = len(first_cells) >= _COUNTED_ROWS and all(map(str.isdecimal, first_cells))
    if are_counted:
        numbers = list(map(int, first_cells))
        are_counted = numbers == list(range(numbers[0], numbers[0] + len(numbers)))
        are_counted &= numbers[0] in (0, 1)
    if not are_counted and not all(row.startswith('"') for row in first_rows):
        return []
    return [ROW_NAMES, *names]


def _without_comment(names: list[str], dialect: Dialect) -> list[str]:
    """Return the names without the last one, if it is of comments, which no row has (LabVIEW)."""
    if len(names) == dialect.width + 1 and names[-1].casefold() in _COMMENT_NAMES:
        return names[:-1]
    return []


def _uncommented(line: str) -> str:
    """Return a line without the sign of a comment before it."""
    if COMMENT.match(line):
        return line.lstrip('#%!/ "')
    return line


def _name_cells(line: str, dialect: Dialect, *, is_last: bool) -> list[str]:
    """Return the names in a line, one for each column; an empty list if no way to split it fits.

    A header may have a delimiter of its own. Only the last line above the numbers may have names
    with blanks in them, separated by more blanks.
    """
    ways = [split_cells(line, delimiter) for delimiter in (dialect.delimiter, *DELIMITERS)]
    if is_last and not dialect.delimiter:
        ways.append(re.split(r"\s{2,}", line.strip()))
    if dialect.kinds[-1] is CellKind.NO_VALUE:  # each row ends with a delimiter
        ways.append([*ways[0], ""])
    for cells in ways:
        if len(cells) == dialect.width:
            return [cell.strip('"') for cell in cells]
    return []
