"""Read a table in a text of any dialect: delimiter, decimal mark, names, comments, numbers."""

import csv
import io
import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from statistics import mode
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate.errors import MissingExtra, RecordingError, need
from palpate.importers.table import (
    DECIMAL_MARKS,
    ColumnData,
    Option,
    OptionError,
    ReadOptions,
    Table,
)
from palpate.importers.units import SUMMARY, CellKind, cell_kind, is_text
from palpate.messages import quoted

_LONGEST_HEADER = 1 << 18  # characters in which the first row of numbers is searched
_SAMPLE = 500  # characters, in the middle and at the end, that show the dialect
_MOST_NAME_ROWS = 4
_DELIMITERS = "\t;|,"
_COMMENT = re.compile(r'["\s]*(?:[#%!]|//)')
_COMMENT_SIGNS = ("#", "%", "!", "//")
_MAYBE_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2},[0-9]{3}")
_VALUES = (CellKind.NUMBER, CellKind.TIME)
_WRONG_CELL = (
    "is neither a number nor an overload mark; "
    "if a second head begins there, delete the lines before it"
)


class _Dialect(NamedTuple):
    """How the rows are written: delimiter (None: blanks), decimal mark, kinds of the cells."""

    delimiter: str | None
    decimal_mark: str
    kinds: list[CellKind]

    @property
    def width(self) -> int:
        """Number of cells in a row."""
        return len(self.kinds)


def text_table(path: Path, data: bytes, options: ReadOptions) -> Table:
    """Return the table in the contents of a text file.

    Raises
    ------
    RecordingError
        It is no table: with the line.
    OptionError
        The decimal mark is ambiguous.
    """
    text = _decoded(path, data)
    dialect = _dialect(path, text, options.decimal)
    above, begin = _lines_above(path, text, dialect)
    notes = []
    end = text.rfind("\n") + 1
    last_line = text[end:]
    if last_line.strip() and end > begin and not _COMMENT.match(last_line):
        text = text[:end]  # the last number may be cut off
        notes.append("the last row is incomplete (no line end): left out")
    names = _names(path, above, dialect, has_points=text.find(".", begin) >= 0)
    first_line = len(above) + 1
    columns = _uniform_columns(text, begin, dialect)
    lines: Sequence[int]
    if columns:
        lines = range(first_line, first_line + len(columns[0]))
    else:
        rows, row_notes = _rows_by_line(path, text[begin:], first_line, above[-1:], dialect)
        columns = [np.array(cells, object) for cells in zip(*rows.values(), strict=True)]
        lines = list(rows)
        notes += row_notes
    named = map(ColumnData, names, columns)
    table = Table(path, named, lines, notes, dialect.decimal_mark)
    _refuse_texts(table, dialect)
    return table


def _refuse_texts(table: Table, dialect: _Dialect) -> None:
    """Refuse a text in a column of numbers or times, used or not: its row may be a sum."""
    for column, kind in zip(table.columns, dialect.kinds, strict=True):
        if kind in _VALUES and column.kind == "O":
            column.refuse(column.texts_that(is_text), _WRONG_CELL)


def _decoded(path: Path, data: bytes) -> str:
    """Return the text of a file, with Unix line ends."""
    encoding = "utf-8-sig"
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        encoding = "utf-16"
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    if "\0" in text:
        formats = "text, .xlsx, .parquet, .arrow, .feather, .xdf"
        advice = "save a .xls, .mat, .h5 or .npy as one of them"
        reason = f"not a table that palpate reads, allowed: {formats}; {advice}"
        raise RecordingError(path, reason)
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    return text.rstrip("\x1a")


def _split(line: str, delimiter: str | None) -> list[str]:
    """Return the cells of a line."""
    if delimiter is None:
        return [cell.strip('"') for cell in line.split()]
    if line and '"' not in line:
        cells = line.split(delimiter)
    else:
        rows = csv.reader([line], delimiter=delimiter, skipinitialspace=True)
        cells = next(rows, [])
    return list(map(str.strip, cells))


def _kinds(cells: list[str]) -> list[CellKind]:
    return list(map(cell_kind, cells))


def _count_values(kinds: list[CellKind]) -> int:
    """Return the number of numbers and times."""
    return kinds.count(CellKind.NUMBER) + kinds.count(CellKind.TIME)


def _dialect(path: Path, text: str, decimal: str | None) -> _Dialect:
    """Find how the rows are written, from lines in the middle and at the end.

    The decimal mark is ambiguous if all commas may separate thousands.
    """
    lines = _sample_lines(text)
    if not lines:
        raise RecordingError(path, "nothing but blank lines", 1)
    delimiter = _delimiter(lines)
    rows = [_split(line, delimiter) for line in lines]
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
    kinds = [_kinds(row) for row in rows if len(row) == width]
    most_values = max(kinds, key=_count_values)
    return _Dialect(delimiter, DECIMAL_MARKS[decimal], most_values)


def _sample_lines(text: str) -> list[str]:
    """Return lines of the middle and of the end, without comments."""
    sample = ""
    half = text.find("\n", len(text) // 2)
    if half >= 0:
        sample = text[half + 1 : text.find("\n", half + _SAMPLE)]
    tail = text.rfind("\n", 0, max(len(text) - _SAMPLE, 0))
    lines = [*sample.split("\n"), *text[tail + 1 :].split("\n")]
    return [line for line in lines if line.strip() and not _COMMENT.match(line)]


def _delimiter(lines: list[str]) -> str | None:
    """Return the delimiter with which lines have most numbers and times and fewest texts."""
    best = max(_DELIMITERS, key=partial(_score, lines))
    needed = min(2 * len(lines), _score(lines, None))
    if "\t" in lines[-1] or _score(lines, best) >= needed:
        return best
    return None


def _score(lines: list[str], delimiter: str | None) -> int:
    score = 0
    for line in lines:
        kinds = _kinds(_split(line, delimiter))
        score += _count_values(kinds) - kinds.count(CellKind.TEXT)
    return score


def _lines_above(path: Path, text: str, dialect: _Dialect) -> tuple[list[str], int]:
    """Return the lines above the first row of numbers, and the position where it begins."""
    above: list[str] = []
    begin = 0
    for line in text[:_LONGEST_HEADER].split("\n"):
        cells = _split(line, dialect.delimiter)
        kinds = _kinds(cells)
        if _count_values(kinds) and not _COMMENT.match(line):
            if len(kinds) == dialect.width:
                if _is_row(kinds, dialect):
                    return above, begin
            elif len(kinds) > 1 and CellKind.TEXT not in kinds:
                raise _wrong_width(path, cells, len(above) + 1, dialect)
        above.append(line)
        begin += len(line) + 1
    raise RecordingError(path, "not a recording: no row of numbers", 1)


def _is_row(kinds: list[CellKind], dialect: _Dialect) -> bool:
    """Return whether cells have several values, or texts only where other rows have texts."""
    if _count_values(kinds) > 1:
        return True
    for kind, usual in zip(kinds, dialect.kinds, strict=True):
        if kind is CellKind.TEXT and usual is not CellKind.TEXT:
            return False
    return True


def _wrong_width(path: Path, cells: list[str], line: int, dialect: _Dialect) -> RecordingError:
    reason = f"got {len(cells)} cells, allowed: {dialect.width}, as in the other rows"
    return RecordingError(path, reason, line)


def _names(path: Path, above: list[str], dialect: _Dialect, *, has_points: bool) -> list[str]:
    """Return the names of the columns, joined from up to four rows; "" where there is none."""
    filled = list(filter(str.strip, above))
    rows: list[list[str]] = []
    for line in filled[: -_MOST_NAME_ROWS - 1 : -1]:
        line = _uncommented(line)
        cells = _name_cells(line, dialect, is_last=not rows)
        kinds = _kinds(cells)
        few_texts = kinds.count(CellKind.TEXT) < min(2, dialect.width)
        if not cells or _count_values(kinds) or few_texts:
            break
        if rows and all(map(SUMMARY.match, filter(None, cells))):
            number = 1
            while not above[number - 1].endswith(line):
                number += 1
            found = f"{quoted(line.strip())} above the names is of statistics, not of samples"
            raise RecordingError(path, f"{found}: take these rows out", number)
        rows.insert(0, cells)
    if filled and not rows and not has_points and dialect.delimiter == ",":
        names = _split(_uncommented(filled[-1]), ",")
        if 1 < len(names) < dialect.width:
            found = f"got {dialect.width} cells below {len(names)} names"
            question = "commas separate the cells and are decimal marks?"
            reason = f"{found}: {question} save it with another delimiter"
            raise RecordingError(path, reason, len(above) + 1)
    if not rows:
        return [""] * dialect.width
    return [" ".join(filter(None, words)) for words in zip(*rows, strict=True)]


def _uncommented(line: str) -> str:
    """Return a line without the sign of a comment before it."""
    if _COMMENT.match(line):
        return line.lstrip('#%!/ "')
    return line


def _name_cells(line: str, dialect: _Dialect, *, is_last: bool) -> list[str]:
    """Return the names in a line, one for each column; an empty list if no way to split it fits.

    A header may have a delimiter of its own. Only the last line above the numbers may have names
    with blanks in them, separated by more blanks.
    """
    ways = [_split(line, delimiter) for delimiter in (dialect.delimiter, *_DELIMITERS)]
    if is_last and not dialect.delimiter:
        ways.append(re.split(r"\s{2,}", line.strip()))
    if dialect.kinds[-1] is CellKind.NO_VALUE:  # each row ends with a delimiter
        ways.append([*ways[0], ""])
    for cells in ways:
        if len(cells) == dialect.width:
            return [cell.strip('"') for cell in cells]
    return []


def _uniform_columns(text: str, begin: int, dialect: _Dialect) -> list[NDArray[Any]]:
    """Return the columns of rows that are all alike, by pandas.

    An empty list: they are not alike, or pandas is missing.
    """
    if _may_have_comments(text, begin, dialect):
        return []
    file = io.BytesIO(text.encode())
    file.seek(len(text[:begin].encode()))
    try:
        pandas = need("pandas", "tables")
        to_nearest: dict[str, str] = {}
        if pandas.__version__ < "3.1":  # later ones always read the nearest double
            to_nearest["float_precision"] = "round_trip"
        frame = pandas.read_csv(
            file,
            sep=dialect.delimiter or r"\s+",
            decimal=dialect.decimal_mark,
            header=None,
            na_filter=False,
            skip_blank_lines=False,
            low_memory=False,
            **to_nearest,
        )
    except (MissingExtra, ValueError):
        return []
    if frame.shape[1] != dialect.width:
        return []
    columns: list[NDArray[Any]] = []
    for name, kind in zip(frame, dialect.kinds, strict=True):
        series = frame[name]
        if series.dtype.kind in "iuf":
            columns.append(series.to_numpy())
        elif kind is CellKind.NUMBER:
            return []
        else:
            columns.append(series.to_numpy(object))
    last = columns[-1]
    if last.dtype.kind == "O" and not all(last):  # a short row
        return []
    return columns


def _may_have_comments(text: str, begin: int, dialect: _Dialect) -> bool:
    """Return whether there may be comments or quoted cells from a position on."""
    signs = ['"']
    if dialect.kinds[0] is not CellKind.NUMBER:
        signs += _COMMENT_SIGNS
    for sign in signs:
        if text.find(sign, begin) >= 0:
            return True
    return False


def _rows_by_line(
    path: Path, body: str, first_line: int, names: list[str], dialect: _Dialect
) -> tuple[dict[int, list[str]], list[str]]:
    """Return the cells of the rows by the number of their line, and a note on other lines.

    Blank lines, comments and repeated lines of `names` are no rows.
    """
    rows = {}
    left_out = []
    for number, line in enumerate(body.split("\n"), first_line):
        if not line.strip():
            continue
        if _COMMENT.match(line) or line in names:
            left_out.append(f"line {number} is no row ({quoted(line)})")
            continue
        rows[number] = _split(line, dialect.delimiter)
        if len(rows[number]) != dialect.width:
            raise _wrong_width(path, rows[number], number, dialect)
    if not left_out:
        return rows, []
    note, *others = left_out
    if others:
        note += f", and {len(others)} more lines"
    return rows, [f"{note}: left out"]
