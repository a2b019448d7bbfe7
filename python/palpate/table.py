"""Text tables as loggers write them: delimiter, encoding, header rows, units, cells without a value."""

import csv
import math
import re
from dataclasses import dataclass
from pathlib import Path

from palpate.errors import RecordingError

_MARKS = """
    OL +OL -OL OVL OVER OVERLOAD OVERFLOW OVFL OPEN ERR ERROR NAN NA N/A NULL NONE - -- ---
    INF +INF -INF #N/A #NUM! #VALUE! #DIV/0!
"""
NO_VALUE = frozenset({"", *_MARKS.split()})
"""Cells, in upper case, with which loggers and spreadsheets say that there is no value."""

PICOFARADS = {"aF": 1e-6, "fF": 1e-3, "pF": 1.0, "nF": 1e3, "uF": 1e6, "µF": 1e6, "μF": 1e6, "mF": 1e9, "F": 1e12}
SECONDS = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ns": 1e-9, "min": 60.0}

_UNIT = re.compile(r"(?:^|[\s_(\[/])(%|[A-Za-zµμ]{1,3})[)\]]?$")
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?$")
_DELIMITERS = "\t;|,"
_SAMPLE = 64  # lines that are looked at to find the delimiter


@dataclass(frozen=True)
class Table:
    """A text table, its columns not yet interpreted.

    Attributes
    ----------
    header : list of list of str
        The rows before the first row of numbers.
    rows : list of (int, list of str)
        The rest: line number, counted from 1, and cells.
    torn : bool
        Whether the file ends within a row, as when its writer was stopped: the last line has fewer
        cells than the one before, and no line end. It is not among the rows.
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
        """Every name of a column (from 0): its header cells, then all of them joined.

        A blank cell of an upper header row belongs to the name on its left.
        """
        cells = [row[column] if column < len(row) else "" for row in self.header]
        spanning = [next((c for c in reversed(row[: column + 1]) if c), "") for row in self.header[:-1]]
        joined = " ".join(part for part in [*spanning, *cells[-1:]] if part)
        return [name for name in dict.fromkeys([*cells, joined]) if name]

    def column(self, wanted: str | int) -> int:
        """Index (from 0) of the column with this name, or at this position (from 1).

        Raises
        ------
        ValueError
            No such column, or several of the name.
        """
        text = str(wanted).strip()
        if text.isdecimal():
            if not 1 <= int(text) <= self.width:
                raise ValueError(f"column: got position {text}, allowed: 1 to {self.width}")
            return int(text) - 1
        for simplify in (str.strip, bare_name):
            name = simplify(text)
            found = [c for c in range(self.width) if name in (simplify(n) for n in self.names(c))]
            if len(found) == 1:
                return found[0]
            if found:
                positions = ", ".join(str(c + 1) for c in found)
                raise ValueError(f"column: got {text!r}, which is at positions {positions}; give one of these")
        raise ValueError(f"column: got {text!r}, allowed: {self.describe()}")

    def describe(self) -> str:
        """Return the columns as a user may name them: positions and names."""
        return ", ".join(f"{c + 1} ({self.names(c)[-1]})" if self.names(c) else str(c + 1) for c in range(self.width))

    def unit(self, column: int, units: dict[str, float]) -> str | None:
        """Return the unit in a column's header, the lowest cell first: one of `units`, "%", or None."""
        for name in self.names(column)[::-1]:
            match = _UNIT.search(name)
            if match and (match[1] in units or match[1] == "%"):
                return match[1]
        return None

    def cell(self, row: int, column: int) -> str:
        """Return one cell of a row (from 0).

        Raises
        ------
        RecordingError
            A row that is too short.
        """
        line, cells = self.rows[row]
        if column >= len(cells):
            raise RecordingError(self.path, f"{len(cells)} cells, column {column + 1} is needed", line)
        return cells[column]


def read_table(path: Path) -> Table:
    """Read a text file as a table.

    Raises
    ------
    RecordingError
        Not text, or no row of numbers.
    """
    lines = re.split(r"\r\n|\r|\n", _text(path))
    ended = lines[-1] == ""
    delimiter = _delimiter([line for line in lines if line.strip()][: 2 * _SAMPLE])
    split: list[tuple[int, list[str]]] = []
    for number, line in enumerate(lines, 1):
        try:
            cells = _cells(line, delimiter)
        except csv.Error as error:
            raise RecordingError(path, str(error), number) from error
        if any(cells) and not (split and line.lstrip().startswith("#")):
            split.append((number, cells))
    first = next((i for i, (_, cells) in enumerate(split) if _is_data(cells)), None)
    if first is None:
        raise RecordingError(path, "no row of numbers in it: not a recording", split[-1][0] if split else 1)
    rows = split[first:]
    torn = not ended and len(rows) > 1 and len(rows[-1][1]) < len(rows[-2][1])
    return Table(path, [cells for _, cells in split[:first]], rows[:-1] if torn else rows, torn)


def to_number(cell: str) -> float:
    """Return the value of a cell, nan where the cell says that there is none.

    Raises
    ------
    ValueError
        Neither a number nor one of `NO_VALUE`.
    """
    if cell.upper() in NO_VALUE:
        return math.nan
    if "_" in cell:
        raise ValueError(cell)
    value = float(cell.replace(",", ".") if _DECIMAL_COMMA.match(cell) else cell)
    return value if math.isfinite(value) else math.nan


def bare_name(name: str) -> str:
    """Return a name without its unit and in lower case: 'C (pF)', 'c_pF' and 'C' are the same."""
    match = _UNIT.search(name)
    known = match and (match[1] in PICOFARADS or match[1] in SECONDS or match[1] == "%")
    return (name[: match.start()] if match and known else name).strip(" _/").casefold()


def _text(path: Path) -> str:
    raw = path.read_bytes()
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        encodings = ["utf-16"]
    else:
        if b"\0" in raw:
            line = raw[: raw.index(b"\0")].count(b"\n") + 1
            raise RecordingError(path, "a zero byte: not text, not a recording", line)
        encodings = ["utf-8-sig", "latin-1"]
    for encoding in encodings:
        try:
            return raw.decode(encoding)
        except UnicodeDecodeError as error:
            problem = error
    raise RecordingError(path, f"not text: {problem}", 1)


def _delimiter(lines: list[str]) -> str | None:
    """Return the first candidate that stands equally often in nearly all lines below the header, or None: blanks."""
    body = lines[len(lines) // 2 :][:_SAMPLE]
    for candidate in _DELIMITERS:
        counts = [line.count(candidate) for line in body]
        usual = max(counts, key=counts.count, default=0)
        if usual and counts.count(usual) >= 0.9 * len(counts) - 1:
            return candidate
    return None


def _cells(line: str, delimiter: str | None) -> list[str]:
    if delimiter is None:
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]


def _is_data(cells: list[str]) -> bool:
    """More than half of the filled cells hold numbers or say that there is none; at least one is a number."""
    filled = [cell for cell in cells if cell]
    values = []
    for cell in filled:
        try:
            values.append(to_number(cell))
        except ValueError:
            continue
    return 2 * len(values) > len(filled) and not all(math.isnan(value) for value in values)
