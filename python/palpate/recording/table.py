"""Text tables of loggers: finds delimiter, encoding, header rows, units and cells without a value."""

import csv
import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, islice
from pathlib import Path

from palpate.errors import RecordingError, listed, quoted, shortened
from palpate.files import read_bytes

_MARKS = """
    OL +OL -OL OVL OVLD OVER OVERLOAD OVERFLOW OVFL OPEN ERR ERROR NAN NA N/A NULL NONE - -- ---
    INF +INF -INF #N/A #NUM! #VALUE! #DIV/0!
"""
NO_VALUE = frozenset({"", *_MARKS.split()})
"""Cells (upper case) that mean "no value" in the files of loggers and spreadsheets."""

OVERLOAD = 1e30
"""Numbers of this magnitude mean "no value": SCPI instruments send 9.9E+37."""

PICOFARADS = {"aF": 1e-6, "fF": 1e-3, "pF": 1.0, "nF": 1e3, "uF": 1e6, "µF": 1e6, "μF": 1e6, "mF": 1e9, "F": 1e12}
SECONDS = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ns": 1e-9, "min": 60.0}

LARGEST = 500_000_000
"""Bytes of a table, at most: it is read as a whole."""
MOST_COLUMNS = 1000
MOST_HEADER_ROWS = 1000
LONGEST = 100_000
"""Characters of a line, at most."""

_UNIT = re.compile(r"(?:^|[\s_(\[/])(%|[A-Za-zµμ]{1,3})[)\]]?$")
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?$")
_DELIMITERS = "\t;|,"
_SAMPLE = 64  # lines used to find the delimiter
_SURE = 3  # rows of numbers one after the other are the first rows


@dataclass(frozen=True)
class Table:
    """A text table: header rows, and rows of cells as text.

    Attributes
    ----------
    header : list of list of str
        The rows before the first row of numbers.
    rows : list of (int, list of str)
        The other rows: line number, counted from 1, and cells.
    torn : bool
        Whether the file ends without a line end: then the last row may be incomplete, and is left out.
    """

    path: Path
    header: list[list[str]]
    rows: list[tuple[int, list[str]]]
    torn: bool

    @property
    def width(self) -> int:
        """The number of columns of the first row of numbers."""
        return len(self.rows[0][1])

    def names(self, column: int) -> list[str]:
        """Return all names of a column (from 0): its header cells, then all of them joined.

        A blank cell of an upper header row belongs to the name on its left.
        """
        return self._names[column]

    @cached_property
    def _names(self) -> list[list[str]]:
        filled = [[*row, *[""] * (self.width - len(row))] for row in self.header]
        spanning = [list(accumulate(row, _filled)) for row in filled[:-1]]
        found = []
        for column in range(self.width):
            cells = [row[column] for row in filled]
            joined = " ".join(part for part in [*(row[column] for row in spanning), *cells[-1:]] if part)
            found.append([name for name in dict.fromkeys([*cells, joined]) if name])
        return found

    @cached_property
    def _columns(self) -> list[dict[str, list[int]]]:
        """The columns of each name, stripped, and bare."""
        found: list[dict[str, list[int]]] = []
        for simplify in _SIMPLER:
            columns: dict[str, list[int]] = {}
            for column, names in enumerate(self._names):
                for name in {simplify(name) for name in names}:
                    columns.setdefault(name, []).append(column)
            found.append(columns)
        return found

    def column(self, wanted: str | int) -> int:
        """Return the index (from 0) of the column with this name, or at this position (from 1).

        Raises
        ------
        ValueError
            No column, or several columns have this name.
        """
        text = str(wanted).strip()
        if text.isdecimal() and len(text) < 10:
            if not 1 <= int(text) <= self.width:
                raise ValueError(f"column: got position {text}, allowed: 1 to {self.width}")
            return int(text) - 1
        for simplify, columns in zip(_SIMPLER, self._columns, strict=True):
            found = columns.get(simplify(text), [])
            if len(found) == 1:
                self._require_header_as_wide_as_rows()
                return found[0]
            if found:
                positions = listed([str(column + 1) for column in found])
                raise ValueError(
                    f"column: got {quoted(text)}, the name of several columns, allowed: one of the positions {positions}"
                )
        raise ValueError(f"column: got {quoted(text)}, allowed: {self.describe()}")

    def _require_header_as_wide_as_rows(self) -> None:
        width = len(self.header[-1])
        if width != self.width and any(self.header[-1][self.width :] + self.rows[0][1][width:]):
            raise ValueError(
                f"column: the header has {width} cells, but the rows have {self.width}: a name may belong to another "
                "column; allowed: positions, counted from 1"
            )

    def describe(self) -> str:
        """Return positions and names of the columns as text; of many columns those of the first ones."""
        return listed([f"{c} ({shortened(names[-1])})" if names else str(c) for c, names in enumerate(self._names, 1)])

    def unit(self, column: int, units: dict[str, float]) -> str | None:
        """Return the unit in a column's header, the lowest cell first: one of `units`, "%", or None."""
        for name in self.names(column)[::-1]:
            match = _UNIT.search(name)
            if match:
                known = {unit.casefold(): unit for unit in units}
                unit = match[1] if match[1] in units else known.get(match[1].casefold())
                if unit or match[1] == "%":
                    return unit or "%"
        return None

    def cell(self, row: int, column: int) -> str:
        """Return one cell of a row (from 0).

        Raises
        ------
        RecordingError
            The row is too short.
        """
        line, cells = self.rows[row]
        if column >= len(cells):
            raise RecordingError(self.path, f"got {len(cells)} cells, but column {column + 1} is needed", line)
        return cells[column]


def _filled(left: str, cell: str) -> str:
    return cell or left


def read_table(path: Path) -> Table:
    """Read a text file as a table.

    Raises
    ------
    RecordingError
        Not text, no row of numbers, or too many columns or header rows.
    """
    lines = re.split(r"\r\n|\r|\n", _text(path))
    rows = _rows(path, lines, _delimiter([line for line in lines if line.strip()]))
    head = list(islice(rows, MOST_HEADER_ROWS + _SURE))
    data = [is_data(cells) for _, cells in head]
    first = next((i for i in range(len(head[: MOST_HEADER_ROWS + 1])) if all(data[i : i + _SURE])), None)
    if first is None:
        raise RecordingError(path, *_why_no_data(head))
    body = [*head[first:], *rows]
    torn = lines[-1] != "" and len(body) > 1
    return Table(path, [cells for _, cells in head[:first]], body[:-1] if torn else body, torn)


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
    best = max(split, key=lambda row: sum(map(_is_number, row[1])))
    wrong = next((cell for cell in best[1] if not _is_number(cell)), best[1][0])
    return f"not a recording: no row of numbers; {quoted(wrong)} is not a number", best[0]


def _is_number(cell: str) -> bool:
    try:
        return not math.isnan(to_number(cell))
    except ValueError:
        return False


def to_number(cell: str) -> float:
    """Return the value of a cell; nan if it is one of `NO_VALUE`.

    Raises
    ------
    ValueError
        Neither a number nor one of `NO_VALUE`.
    """
    if cell.upper() in NO_VALUE:
        return math.nan
    if "_" in cell:
        raise ValueError(cell)
    cell = cell.replace("\u2212", "-")
    value = float(cell.replace(",", ".") if _DECIMAL_COMMA.match(cell) else cell)
    return value if abs(value) < OVERLOAD else math.nan


def _text(path: Path) -> str:
    try:
        raw = read_bytes(path, LARGEST)
    except OSError as error:
        raise RecordingError(path, f"cannot be read: {error.strerror}") from error
    if not raw:
        raise RecordingError(path, "is empty")
    if raw.startswith(b"PAR1"):
        raise RecordingError(path, "a Parquet table: palpate cannot read Parquet; use the CSV from which it was made")
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


def is_data(cells: list[str]) -> bool:
    """Return whether more than half of the filled cells are numbers or "no value", and at least one is a number."""
    filled = [cell for cell in cells if cell]
    marks = sum(cell.upper() in NO_VALUE for cell in filled)
    numbers = sum(map(_is_number, filled))
    return numbers > 0 and 2 * (numbers + marks) > len(filled)


def bare_name(name: str) -> str:
    """Return a name in lower case and without its unit: 'C (pF)', 'c_pF' and 'C' are equal."""
    match = _UNIT.search(name)
    known = match and (match[1] in PICOFARADS or match[1] in SECONDS or match[1] == "%")
    return (name[: match.start()] if match and known else name).strip(" _/").casefold()


_SIMPLER: tuple[Callable[[str], str], ...] = (str.strip, bare_name)
"""A name is compared as it is, then as its bare name."""
