"""Read a table in a text of any dialect: names, comments, numbers, stamps of captured lines."""

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.errors import MissingExtra, RecordingError, need
from palpate.importers.decoding import decoded
from palpate.importers.header_names import HeaderNames, header_names
from palpate.importers.stamps import StampedText, split_stamps
from palpate.importers.table import ColumnData, ReadOptions, Table
from palpate.importers.text_dialect import (
    COMMENT,
    COMMENT_SIGNS,
    Dialect,
    cell_kinds,
    count_values,
    split_cells,
    text_dialect,
)
from palpate.importers.units import TIME_NAMES, CellKind, is_text, simple_name, to_number
from palpate.messages import quoted

_LONGEST_HEADER = 1 << 18  # characters in which the first row of numbers is searched
_SHOWN_ROWS = 3  # that show whether a column has the names of rows
_VALUES = (CellKind.NUMBER, CellKind.TIME)
_WRONG_CELL = (
    "is neither a number nor an overload mark; "
    "if a second head begins there, delete the lines before it"
)


def text_table(path: Path, data: bytes, options: ReadOptions) -> Table:
    """Return the table in the contents of a text file.

    Raises
    ------
    RecordingError
        It is no table: with the line.
    OptionError
        The decimal mark is ambiguous.
    """
    text, notes = decoded(path, data)
    stamped = split_stamps(text)
    if stamped is not None and stamped.is_foreign:
        return _stamped_table(path, stamped, notes, options)
    return _table_in(path, text, notes, options)


def _stamped_table(
    path: Path, stamped: StampedText, notes: list[str], options: ReadOptions
) -> Table:
    """Return the table behind stamps, with the stamps as its last column."""
    table = _table_in(path, stamped.text, notes, options)
    if not any(stamped.stamps):
        return table
    positions = np.array(table.lines, int) - 1
    stamps = np.array(stamped.stamps, object)[positions]
    name = "time"
    if table.named(TIME_NAMES):
        name = "stamp"
    table.add_column(ColumnData(name, stamps, stamped.unit))
    return table


def _table_in(path: Path, text: str, decoding: list[str], options: ReadOptions) -> Table:
    """Return the table in a text; `decoding`: notes on the text."""
    dialect = text_dialect(path, text, options.decimal)
    above, begin = _lines_above(path, text, dialect)
    notes = []
    end = text.rfind("\n") + 1
    last_line = text[end:]
    if last_line.strip() and end > begin and not COMMENT.match(last_line):
        text = text[:end]  # the last number may be cut off
        notes.append("the last row is incomplete (no line end): left out")
    first_rows = text[begin : begin + _LONGEST_HEADER].split("\n")[:_SHOWN_ROWS]
    has_points = text.find(".", begin) >= 0
    header = header_names(
        path, above, list(filter(str.strip, first_rows)), dialect, has_points=has_points
    )
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
    named = map(ColumnData, header.names, columns)
    notes += [*header.notes, *decoding]
    table = Table(path, named, lines, notes, dialect.decimal_mark)
    table.has_names = any(header.names)
    table.unmatched_names = header.unmatched
    _refuse_texts(table, dialect)
    _count_by_increment(table, header)
    return table


def _count_by_increment(table: Table, header: HeaderNames) -> None:
    """Add the times of rows that are counted, if the header has their increment (Rigol)."""
    numbers = {simple_name(name): number for name, number in header.numbers.items()}
    first = table.columns[0]
    if "increment" not in numbers or not first.name.casefold().endswith("(sequence)"):
        return
    step = to_number(numbers["increment"], table.decimal_mark)
    start = to_number(numbers.get("start", "0"), table.decimal_mark)
    seconds = start + first.numbers() * step
    table.add_column(ColumnData("time", seconds, "s"))
    table.notes.append(f"times by the header: {start:g} s + {step:g} s for each row")


def _refuse_texts(table: Table, dialect: Dialect) -> None:
    """Refuse a text in a column of numbers or times, used or not: its row may be a sum."""
    for column, kind in zip(table.columns, dialect.kinds, strict=True):
        if kind in _VALUES and column.kind == "O":
            column.refuse(column.texts_that(is_text), _WRONG_CELL)


def _lines_above(path: Path, text: str, dialect: Dialect) -> tuple[list[str], int]:
    """Return the lines above the first row of numbers, and the position where it begins."""
    above: list[str] = []
    begin = 0
    for line in text[:_LONGEST_HEADER].split("\n"):
        cells = split_cells(line, dialect.delimiter)
        kinds = cell_kinds(cells)
        if count_values(kinds) and not COMMENT.match(line):
            if len(kinds) == dialect.width:
                if _is_row(kinds, dialect):
                    return above, begin
            elif len(kinds) > 1 and CellKind.TEXT not in kinds:
                raise _wrong_width(path, cells, len(above) + 1, dialect)
        above.append(line)
        begin += len(line) + 1
    raise RecordingError(path, "not a recording: no row of numbers", 1)


def _is_row(kinds: list[CellKind], dialect: Dialect) -> bool:
    """Return whether cells have several values, or texts only where other rows have texts.

    Settings of an instrument begin with their name, as X0 of LabVIEW; a row of units has a text in
    each column of numbers.
    """
    if kinds[0] is CellKind.TEXT and dialect.kinds[0] in _VALUES:
        return False
    if count_values(kinds) > 1:
        return True
    for kind, usual in zip(kinds, dialect.kinds, strict=True):
        if kind is CellKind.TEXT and usual is not CellKind.TEXT:
            return False
    return True


def _wrong_width(path: Path, cells: list[str], line: int, dialect: Dialect) -> RecordingError:
    reason = f"got {len(cells)} cells, allowed: {dialect.width}, as in the other rows"
    return RecordingError(path, reason, line)


def _uniform_columns(text: str, begin: int, dialect: Dialect) -> list[NDArray[Any]]:
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


def _may_have_comments(text: str, begin: int, dialect: Dialect) -> bool:
    """Return whether there may be comments or quoted cells from a position on."""
    signs = ['"']
    if dialect.kinds[0] is not CellKind.NUMBER:
        signs += COMMENT_SIGNS
    for sign in signs:
        if text.find(sign, begin) >= 0:
            return True
    return False


def _rows_by_line(
    path: Path, body: str, first_line: int, names: list[str], dialect: Dialect
) -> tuple[dict[int, list[str]], list[str]]:
    """Return the cells of the rows by the number of their line, and a note on other lines.

    Blank lines, comments and repeated lines of `names` are no rows.
    """
    rows = {}
    left_out = []
    for number, line in enumerate(body.split("\n"), first_line):
        if not line.strip():
            continue
        if COMMENT.match(line) or line in names:
            left_out.append(f"line {number} is no row ({quoted(line)})")
            continue
        rows[number] = split_cells(line, dialect.delimiter)
        if len(rows[number]) != dialect.width:
            raise _wrong_width(path, rows[number], number, dialect)
    if not left_out:
        return rows, []
    note, *others = left_out
    if others:
        note += f", and {len(others)} more lines"
    return rows, [f"{note}: left out"]
