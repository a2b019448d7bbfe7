"""Text tables of loggers: finds delimiter, encoding, header rows and cells without a value."""

import csv
import re
from collections.abc import Iterator
from itertools import accumulate, islice, zip_longest
from pathlib import Path

from palpate.errors import RecordingError, quoted
from palpate.tables.numbers import is_data, is_number
from palpate.tables.table import Column, Table

MOST_COLUMNS = 1000
MOST_HEADER_ROWS = 1000
LONGEST = 100_000
"""Characters of a line, at most."""

_DELIMITERS = "\t;|,"
TORN = "the last row is incomplete (no line end): left out"
_SAMPLE = 64  # lines used to find the delimiter
_SURE = 3  # rows of numbers one after the other are the first rows


def parse(path: Path, raw: bytes) -> Table:
    """Read the contents of a text file as a table.

    Raises
    ------
    RecordingError
        Not text, no row of numbers, or too many columns or header rows.
    """
    lines = re.split(r"\r\n|\r|\n", _decoded(path, raw))
    rows = _rows(path, lines, _delimiter([line for line in lines if line.strip()]))
    head = list(islice(rows, MOST_HEADER_ROWS + _SURE))
    data = [is_data(cells) for _, cells in head]
    first = next((i for i in range(len(head[: MOST_HEADER_ROWS + 1])) if all(data[i : i + _SURE])), None)
    if first is None:
        raise RecordingError(path, *_why_no_data(head))
    body = [*head[first:], *rows]
    torn = lines[-1] != "" and len(body) > 1
    header = [cells for _, cells in head[:first]]
    return _table(path, header, body[:-1] if torn else body, [TORN] if torn else [])


def _table(path: Path, header: list[list[str]], rows: list[tuple[int, list[str]]], notes: list[str]) -> Table:
    width = len(rows[0][1])
    by_column = zip_longest(*(cells[:width] for _, cells in rows))
    columns = [Column(names, cells) for names, cells in zip(_names(header, width), by_column, strict=True)]
    lowest = header[-1] if header else []
    fits = not header or len(lowest) == width or not any(lowest[width:] + rows[0][1][len(lowest) :])
    return Table(path, columns, [line for line, _ in rows], header, notes, fits)


def _names(header: list[list[str]], width: int) -> list[tuple[str, ...]]:
    """Return all names of each column; a blank cell of an upper header row belongs to the name on its left."""
    filled = [[*row, *[""] * (width - len(row))] for row in header]
    spanning = [list(accumulate(row, _filled)) for row in filled[:-1]]
    found = []
    for column in range(width):
        cells = [row[column] for row in filled]
        joined = " ".join(part for part in [*(row[column] for row in spanning), *cells[-1:]] if part)
        found.append(tuple(name for name in dict.fromkeys([*cells, joined]) if name))
    return found


def _filled(left: str, cell: str) -> str:
    return cell or left


def _rows(path: Path, lines: list[str], delimiter: str | None) -> Iterator[tuple[int, list[str]]]:
    """Yield the number and the cells of each line that is not empty, nor a comment below the first one."""
    begun = False
    for number, line in enumerate(lines, 1):
        if len(line) > LONGEST:
            raise RecordingError(path, f"got a line of {len(line):,} characters, allowed: {LONGEST:,}", number)
        try:
            cells = _cells(line, delimiter)
        except csv.Error as error:
            raise RecordingError(path, f"{error}: not a table", number) from error
        if len(cells) > MOST_COLUMNS:
            raise RecordingError(path, f"got {len(cells):,} columns, allowed: {MOST_COLUMNS:,}", number)
        if any(cells) and not (begun and line.lstrip().startswith("#")):
            begun = True
            yield number, cells


def _why_no_data(split: list[tuple[int, list[str]]]) -> tuple[str, int]:
    """Return a reason and a line: those of the row with the most numbers."""
    if not split:
        return "not a recording: nothing but blank lines", 1
    best = max(split, key=lambda row: sum(map(is_number, row[1])))
    wrong = next((cell for cell in best[1] if not is_number(cell)), best[1][0])
    return f"not a recording: no row of numbers; {quoted(wrong)} is not a number", best[0]


def _decoded(path: Path, raw: bytes) -> str:
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        encodings = ["utf-16"]
    else:
        if b"\0" in raw:
            line = raw[: raw.index(b"\0")].count(b"\n") + 1
            raise RecordingError(path, "not a recording: a zero byte, so this is not a text file", line)
        encodings = ["utf-8-sig", "latin-1"]
    for encoding in encodings:
        try:
            return raw.decode(encoding)
        except UnicodeDecodeError as error:
            problem = error
    raise RecordingError(path, f"not text: {problem}", 1)


def _delimiter(lines: list[str]) -> str | None:
    """Return the delimiter with which most lines are rows of numbers; None for blanks."""
    body = lines[len(lines) // 2 :][:_SAMPLE]

    def rows(candidate: str | None) -> int:
        try:
            split = (_cells(line, candidate) for line in body)
            return sum(is_data(cells[:MOST_COLUMNS]) for cells in split if len(cells) > 1)
        except csv.Error:
            return 0

    candidates: list[str | None] = [*_DELIMITERS, None]
    return max(candidates, key=rows)


def _cells(line: str, delimiter: str | None) -> list[str]:
    if delimiter is None:
        return [cell.strip('"') for cell in line.split()]
    cells = next(csv.reader([line], delimiter=delimiter), []) if '"' in line else line.split(delimiter)
    return [cell.strip() for cell in cells]
