"""A text table as a table: which lines are rows, how their cells are written, and what their columns are named."""

import csv
import io
import re
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from statistics import mode
from typing import Any

import numpy as np

from palpate.errors import MissingExtra, RecordingError, quoted
from palpate.extras import need
from palpate.tables.table import DECIMALS, Asked, Column, Table
from palpate.tables.units import NO_VALUE

_HEADER = 1 << 18  # characters in which the first row of numbers is looked for
_SAMPLE = 500  # characters in the middle, and at the end, in which the dialect is looked for
_MOST_NAMES = 4  # rows of names
_DELIMITERS = "\t;|,"
_COMMENT = re.compile(r'["\s]*(?:[#%!]|//)')
_NUMBER = re.compile(r"[+-]?(?:\d[\d.,]*|[.,]\d+)(?:[eE][+-]?\d+)?")
_DOUBTFUL = re.compile(r"[+-]?[1-9][0-9]{0,2},[0-9]{3}")  # decimal comma, or a separator of thousands
_TIME = re.compile(r"\d{1,4}[-/.]\d{1,2}[-/.]\d{2,4}(?:[T ].*)?|\d{1,4}:\d\d[\d:.,]*(?: ?[AaPp][Mm])?")
NUMBER, TIME, NONE, TEXT = "number", "time", "none", "text"


class NoRows(RecordingError):
    """There is no row of numbers."""


def kind(cell: str) -> str:
    """Return whether a cell is a number, a time (or date), no value, or text."""
    if cell.upper() in NO_VALUE:
        return NONE
    return NUMBER if _NUMBER.fullmatch(cell) else TIME if _TIME.fullmatch(cell) else TEXT


@dataclass(frozen=True)
class _Dialect:
    """How the rows are written: delimiter (None: blanks), decimal mark, kinds of the cells of a row."""

    delimiter: str | None
    decimal: str
    kinds: list[str]

    def row(self, path: Path, line: str, number: int) -> list[str]:
        """Return the cells of a row; refuse one with another number of cells."""
        cells = _split(line, self.delimiter)
        if len(cells) != len(self.kinds):
            reason = f"got {len(cells)} cells, allowed: {len(self.kinds)}, as in the other rows"
            raise RecordingError(path, reason, number)
        return cells


def text_table(path: Path, data: bytes, asked: Asked) -> Table:
    """Read the contents of a text file as a table; RecordingError with the line, ValueError if the decimal mark is open."""
    text = _decoded(path, data)
    dialect = _dialect(path, text, asked)
    above, begin = _above(path, text, dialect)
    notes, end = [], text.rfind("\n") + 1
    if text[end:] and len(_split(text[end:], dialect.delimiter)) < len(dialect.kinds):
        text, notes = text[:end], ["the last row is incomplete: left out"]
    body, first = text[begin:], len(above) + 1
    names = _names(path, above, dialect, "." in body)
    rows = body.encode()
    ends = int(np.count_nonzero(np.frombuffer(rows, np.uint8) == ord("\n")))  # five times as fast as count
    lines: Any = range(first, first + ends + (not rows.endswith(b"\n")))
    columns = _alike(rows, dialect, len(lines))
    if columns is None:
        columns, lines, left_out = _by_line(path, body, first, dialect, above[-1] if above else "")
        notes += left_out
    table = Table(path, [Column(*each) for each in zip(names, columns, strict=True)], lines, notes, dialect.decimal)
    for at, (each, of) in enumerate(zip(table.columns, dialect.kinds, strict=True)):
        if of == NUMBER and each.cells.dtype.kind == "O":  # also of a column that is not used: the row may be a sum
            wrong = [word for word in set(each.cells) if kind(word) == TEXT]
            table.refuse(at, np.isin(each.cells, wrong), "is neither a number nor an overload mark")
    return table


def _decoded(path: Path, data: bytes) -> str:
    text = "\0"
    for encoding in ["utf-16"] if data.startswith((b"\xff\xfe", b"\xfe\xff")) else ["utf-8-sig", "latin-1"]:
        with suppress(UnicodeDecodeError):
            text = data.decode(encoding)
            break
    if "\0" in text:
        allowed = "text, .xlsx, .parquet, .arrow, .feather, .xdf; save a .xls, .mat, .h5 or .npy as one of them"
        raise RecordingError(path, f"not a table that palpate reads, allowed: {allowed}")
    text = text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text  # two passes over all of it
    return text.removeprefix("\ufeff").rstrip("\x1a")


def _split(line: str, delimiter: str | None) -> list[str]:
    """Return the cells of a line."""
    if delimiter is None:
        return [cell.strip('"') for cell in line.split()]
    return [cell.strip() for row in csv.reader([line], delimiter=delimiter, skipinitialspace=True) for cell in row]


def _dialect(path: Path, text: str, asked: Asked) -> _Dialect:
    """Find how the lines in the middle and at the end are written."""
    half, tail = text.find("\n", len(text) // 2), text.rfind("\n", 0, max(len(text) - _SAMPLE, 0))
    middle = text[half + 1 : text.find("\n", half + _SAMPLE)] if half >= 0 else ""
    lines = [line for line in f"{middle}\n{text[tail + 1 :]}".split("\n") if line.strip() and not _COMMENT.match(line)]
    if not lines:
        raise NoRows(path, "nothing but blank lines", 1)
    delimiter: str | None = max(_DELIMITERS, key=lambda each: _score(lines, each))
    if "\t" not in lines[-1] and _score(lines, delimiter) < min(2 * len(lines), _score(lines, None)):
        delimiter = None
    rows = [_split(line, delimiter) for line in lines]
    width = mode(map(len, rows))
    kinds = [[kind(cell) for cell in row] for row in rows if len(row) == width]
    decimal = DECIMALS[asked.decimal] if asked.decimal else _decimal(rows)
    return _Dialect(delimiter, decimal, max(kinds, key=lambda each: each.count(NUMBER) + each.count(TIME)))


def _score(lines: list[str], delimiter: str | None) -> int:
    """Return how many numbers and times a delimiter gives, less the texts."""
    kinds = [kind(cell) for line in lines for cell in _split(line, delimiter)]
    return kinds.count(NUMBER) + kinds.count(TIME) - kinds.count(TEXT)


def _decimal(rows: list[list[str]]) -> str:
    """Return the decimal mark; ask if all commas may separate thousands."""
    commas = [cell for row in rows for cell in row if "," in cell and "." not in cell and kind(cell) == NUMBER]
    if commas and all(map(_DOUBTFUL.fullmatch, commas)):
        raise ValueError(
            f"decimal: got {quoted(commas[0])}, a decimal comma or a thousands separator? "
            'allowed: decimal "point" or "comma" (--decimal)'
        )
    return "," if commas else "."


def _above(path: Path, text: str, dialect: _Dialect) -> tuple[list[str], int]:
    """Return the lines above the first row of numbers, and where that row begins."""
    above: list[str] = []
    for found in re.finditer(r"([^\n]*)\n?", text[:_HEADER]):
        kinds = [kind(cell) for cell in _split(found[1], dialect.delimiter)]
        values = kinds.count(NUMBER) + kinds.count(TIME)
        if values and not _COMMENT.match(found[1]):
            texts = [one == TEXT != other for one, other in zip(kinds, dialect.kinds, strict=False)]
            if len(kinds) == len(dialect.kinds) and (values > 1 or not any(texts)):
                return above, found.start()
            if TEXT not in kinds and len(kinds) > 1:
                dialect.row(path, found[1], len(above) + 1)
        above.append(found[1])
    raise NoRows(path, "not a recording: no row of numbers", 1)


def _names(path: Path, above: list[str], dialect: _Dialect, points: bool) -> list[str]:
    """Return the names of the columns, joined from up to four rows; "" if no line has a name for each column."""
    rows: list[list[str]] = []
    filled = [line for line in above if line.strip()]
    for line in filled[-_MOST_NAMES:][::-1]:
        cells = _header_cells(line.lstrip('#%!/ "') if _COMMENT.match(line) else line, dialect)
        kinds = [kind(cell) for cell in cells]
        if not cells or {NUMBER, TIME} & {*kinds} or kinds.count(TEXT) < min(2, len(kinds)):
            break
        rows.insert(0, cells)
    if rows:
        return [" ".join(filter(None, column)) for column in zip(*rows, strict=True)]
    few = len(_split(filled[-1], ",")) if filled else 1
    if 1 < few < len(dialect.kinds) and dialect.delimiter == "," and not points:
        reason = f"got {len(dialect.kinds)} cells below {few} names: commas separate the cells and are decimal marks?"
        raise RecordingError(path, f"{reason} save it with another delimiter", len(above) + 1)
    return [""] * len(dialect.kinds)


def _header_cells(line: str, dialect: _Dialect) -> list[str]:
    """Return the names in a line, which may have another delimiter than the rows; none if not one for each column."""
    ways = [_split(line, each) for each in (dialect.delimiter, *_DELIMITERS)]
    if dialect.kinds[-1] == NONE:  # each row ends with a delimiter
        ways.append([*ways[0], ""])
    return next(([cell.strip('"') for cell in cells] for cells in ways if len(cells) == len(dialect.kinds)), [])


def _alike(body: bytes, dialect: _Dialect, rows: int) -> list[Any] | None:
    """Return the columns of rows that are all alike, by pandas; None: not so, or there is no pandas."""
    if dialect.kinds[0] != NUMBER and any(sign in body for sign in (b"#", b"%", b"!", b"//")):
        return None  # there may be comments; else a comment is a text in a column of numbers
    try:
        pandas = need("pandas", "tables")
        exact = {} if pandas.__version__ >= "3.1" else {"float_precision": "round_trip"}  # the nearest double
        source, delimiter = io.BytesIO(body), dialect.delimiter or r"\s+"
        how = {"header": None, "na_filter": False, "skip_blank_lines": False, "low_memory": False, **exact}
        frame = pandas.read_csv(source, sep=delimiter, decimal=dialect.decimal, **how)
    except (MissingExtra, ValueError):
        return None
    columns = [each.to_numpy(object if each.dtype.kind not in "iuf" else None) for _, each in frame.items()]
    wrong = [of == NUMBER and each.dtype.kind == "O" for each, of in zip(columns, dialect.kinds, strict=False)]
    is_alike = frame.shape == (rows, len(dialect.kinds)) and not any(wrong)
    return columns if is_alike and (columns[-1].dtype.kind != "O" or all(columns[-1])) else None


def _by_line(
    path: Path, body: str, first: int, dialect: _Dialect, names: str
) -> tuple[list[Any], list[int], list[str]]:
    """Return the columns as texts, the number of each line, and a note on comments and repeated names."""
    rows, lines, left_out = list[list[str]](), list[int](), list[tuple[int, str]]()
    for number, line in enumerate(body.split("\n"), first):
        if _COMMENT.match(line) or (names and line == names):
            left_out.append((number, line))
        elif line.strip():
            rows.append(dialect.row(path, line, number))
            lines.append(number)
    more = f", and {len(left_out) - 1} more lines" if len(left_out) > 1 else ""
    notes = [f"line {number} is no row ({quoted(line)}){more}: left out" for number, line in left_out[:1]]
    return [np.array(column, object) for column in zip(*rows, strict=True)], lines, notes
