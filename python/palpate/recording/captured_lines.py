"""Lines of a serial port that a terminal program captured in a file, as a table."""

import math
import re
from array import array
from dataclasses import replace
from pathlib import Path

import numpy as np

from palpate.ad7746.registers import SATURATED_PF
from palpate.errors import RecordingError
from palpate.files import read_unpacked
from palpate.importers.decoding import decoded
from palpate.importers.stamps import StampedText, split_stamps
from palpate.importers.table import ColumnData, ReadOptions, Table
from palpate.importers.text_dialect import DELIMITERS
from palpate.importers.units import CellKind, cell_kind
from palpate.line_protocol import (
    TIMES,
    Grammar,
    LineFormat,
    LineValues,
    Refused,
    parse_columns,
    parse_pattern,
    parse_unit,
)
from palpate.messages import quoted
from palpate.samples import Status

_TRIED = 200  # lines that show whether the lines can be read
_FEWEST = 0.5  # of the lines after the first one that is read
_SHOWN = 20  # lines that show whether they have names
_NAMED_CELL = re.compile(r"[A-Za-z_][\w ()\[\]]*[=:]\s*[-+.\d]")
_DECIMAL_COMMA = re.compile(r"(?<=\d),(?=\d)")
_NAME_LINES = 4  # above the first row
_CHANNEL_WORD = re.compile(
    r"\b(?:hard|soft|c1|c2|cin\d?|cap\d?|capacitance\d?|ch\d)\b", re.IGNORECASE
)
_COLUMN_NAMES = {"t": "time", "t_hard": "time", "t_soft": "t_soft"}


class CapturedRows:
    """What was read from the lines of a file.

    Attributes
    ----------
    hard, soft : array of float
        pF, or in another unit; nan: no value.
    times_ns : dict
        Times of the board by their role: t, t_hard, t_soft.
    numbers : array of int
        Of the lines, from 1.
    gap_rows : list of int
        Rows from which on an earlier baseline is not valid: restart, another CAPDAC.
    lost : int
        Pairs that are missing by the numbers of the board.
    has_codes : bool
        Whether there are codes of the AD7746.
    refused : int
        Number of lines that were not read, after the first one that was read.
    first, first_refused : str
        The first line that was read, and its values; the first one that was not, and the reason.
    """

    def __init__(self) -> None:
        self.hard = array("d")
        self.soft = array("d")
        self.times_ns: dict[str, array[int]] = {role: array("q") for role in TIMES}
        self.numbers = array("q")
        self.gap_rows: list[int] = []
        self.lost = 0
        self.has_codes = False
        self.refused = 0
        self.first = ""
        self.first_refused = ""
        self._before: LineValues | None = None

    def __len__(self) -> int:
        """Return the number of lines that were read."""
        return len(self.numbers)

    def add(self, values: LineValues, number: int) -> None:
        """Add the values of a line."""
        before = self._before
        if before is not None and _is_gap(before, values):
            self.gap_rows.append(len(self))
        elif before is not None and before.seq is not None and values.seq is not None:
            self.lost += values.seq - before.seq - 1
        self._before = values
        self.has_codes |= values.hard_raw >= 0
        self.hard.append(_usable(values.hard, values.status, Status.HARD_SATURATED))
        self.soft.append(_usable(values.soft, values.status, Status.SOFT_SATURATED))
        times = (values.t, values.t_hard, values.t_soft)
        for role, time_ns in zip(TIMES, times, strict=True):
            if time_ns is not None:
                self.times_ns[role].append(time_ns)
        self.numbers.append(number)

    def refuse(self, line: str, number: int, reason: Refused) -> None:
        """Count a line that is not read."""
        self.refused += 1
        if not self.first_refused:
            self.first_refused = f"line {number} ({quoted(line)}): {reason}"

    def notes(self) -> list[str]:
        """Return the first line, and what is missing."""
        notes = [self.first]
        if self.refused == 1:
            notes.append(f"a line was not read: {self.first_refused}")
        elif self.refused:
            notes.append(f"{self.refused} lines were not read, the first: {self.first_refused}")
        if self.lost:
            notes.append(f"{self.lost} pairs are missing by their numbers (seq)")
        if self.gap_rows:
            found = (
                f"{len(self.gap_rows)} times, the first at line {self.numbers[self.gap_rows[0]]}"
            )
            notes.append(f"the board restarted, or its CAPDAC moved: {found}")
        return notes


def _is_gap(before: LineValues, values: LineValues) -> bool:
    """Return whether the board restarted between two lines, or its CAPDAC moved."""
    if (before.capdac_hard, before.capdac_soft) != (values.capdac_hard, values.capdac_soft):
        return True
    return before.seq is not None and values.seq is not None and values.seq <= before.seq


def _usable(value: float, status: int | None, saturated: Status) -> float:
    """Return a reading, nan if its status says that it is saturated or without excitation."""
    if status is not None and status & (saturated | Status.EXCITATION):
        return math.nan
    return value


def captured_table(path: Path, options: ReadOptions) -> Table:
    """Return the lines of a file as a table with the columns hard, soft and, if known, time.

    A line is read as `serial:` reads it, behind the stamps of the program that captured it.

    Raises
    ------
    RecordingError
        Too few lines can be read: with the last reason.
    ValueError
        An option is wrong.
    """
    text, notes = decoded(path, read_unpacked(path))
    line_format = _line_format(options)
    stamped = split_stamps(text)
    lines = _lines_to_read(text, stamped, line_format)
    if options.decimal == "comma":
        lines = [_DECIMAL_COMMA.sub(".", line) for line in lines]
    grammar = Grammar(line_format)
    rows = _read_lines(path, lines, grammar, line_format)
    columns = _columns(rows, stamped, line_format)
    table = Table(path, columns, rows.numbers, [*rows.notes(), *notes])
    table.has_names = not grammar.is_by_order
    table.gap_rows = tuple(rows.gap_rows)
    table.host_stamps = stamped is not None and not any(rows.times_ns.values())
    if rows.has_codes:
        table.full_scale_pF = SATURATED_PF
    unit = options.unit
    if line_format.unit.name == "pF":
        unit = None  # the values are converted
    table.open_options = replace(options, columns=None, pattern=None, unit=unit, time_unit=None)
    return table


def is_stamped(path: Path) -> bool:
    """Return whether the lines of a file are behind stamps that are no column of a table."""
    stamped = split_stamps(decoded(path, read_unpacked(path)).text)
    return stamped is not None and stamped.is_foreign


def have_names(path: Path) -> bool:
    """Return whether the lines of a file have names beside their values, or are JSON objects."""
    text = decoded(path, read_unpacked(path)).text
    stamped = split_stamps(text)
    lines = (stamped.text if stamped else text).split("\n")
    half = len(lines) // 2
    named = 0
    shown = list(filter(str.strip, lines[half : half + _SHOWN]))
    for line in shown:
        is_json = line.lstrip().startswith("{")
        if is_json or len(_NAMED_CELL.findall(line)) > 1:
            named += 1
    return 2 * named > len(shown)


def _line_format(options: ReadOptions) -> LineFormat:
    line_format = LineFormat()
    if isinstance(options.columns, str):
        line_format = replace(line_format, columns=parse_columns("columns", options.columns))
    if options.pattern is not None:
        line_format = replace(line_format, pattern=parse_pattern("pattern", options.pattern))
    if options.unit is not None:
        line_format = replace(line_format, unit=parse_unit("unit", options.unit))
    return line_format


def _lines_to_read(text: str, stamped: StampedText | None, line_format: LineFormat) -> list[str]:
    """Return the lines, without their stamps unless an option is for the lines with them."""
    whole = text.split("\n")
    if not text.endswith("\n"):
        whole[-1] = ""  # its last number may be cut off
    if stamped is None:
        return whole
    inner = stamped.text.split("\n")
    if not text.endswith("\n"):
        inner[-1] = ""
    is_free = not line_format.columns and line_format.pattern is None
    if is_free or _count_read(inner, line_format) > 0:
        return inner
    return whole


def _count_read(lines: list[str], line_format: LineFormat) -> int:
    """Return how many lines of the middle can be read."""
    grammar = Grammar(line_format)
    count = 0
    half = len(lines) // 2
    for line in lines[half : half + _TRIED]:
        try:
            grammar.read(line.strip().encode())
            count += 1
        except Refused:
            continue
    return count


def _read_lines(
    path: Path, lines: list[str], grammar: Grammar, line_format: LineFormat
) -> CapturedRows:
    """Read the lines; text before the first one that is read is of a board that starts."""
    rows = CapturedRows()
    if not _count_read(lines, line_format):
        _refuse_file(path, lines, line_format)
    above: list[str] = []
    for number, text in enumerate(lines, 1):
        line = text.strip()
        if not line or line.startswith("#"):
            continue
        try:
            values = grammar.read(line.encode())
            values.sample()  # refused if its status contradicts its values
        except Refused as reason:
            if len(rows):
                rows.refuse(line, number, reason)
            else:
                above.append(line)
            continue
        if not len(rows):
            if grammar.is_by_order:
                _refuse_names(path, number, above, line)
            rows.first = _first_line(line, values, grammar)
        rows.add(values, number)
    if len(rows) < _FEWEST * (len(rows) + rows.refused):
        raise RecordingError(path, f"most lines are not read, the first: {rows.first_refused}")
    return rows


def _refuse_file(path: Path, lines: list[str], line_format: LineFormat) -> None:
    """Raise RecordingError with the reason of a line from the middle that is not read."""
    grammar = Grammar(line_format)
    half = len(lines) // 2
    for number, line in enumerate(lines[half:], half + 1):
        if not line.strip():
            continue
        try:
            grammar.read(line.strip().encode())
        except Refused as reason:
            message = f"{quoted(line.strip())} is not read as a line of a serial port: {reason}"
            if "decimal comma" in str(reason):
                message += "; of a file: --decimal comma"
            raise RecordingError(path, message, number) from reason
    raise RecordingError(path, "not a recording: hardly any line can be read")


def _refuse_names(path: Path, number: int, above: list[str], line: str) -> None:
    """Refuse two numbers without names below a line that may have their names, in any order."""
    for before in above[-_NAME_LINES:]:
        if not _may_be_names(before, line):
            continue
        question = f"{quoted(before)} above it may be names: which is hard?"
        advice = "columns=hard,soft or columns=soft,hard"
        raise RecordingError(path, f"{quoted(line)}: {question} {advice}", number)


def _may_be_names(before: str, line: str) -> bool:
    """Return whether a line has as many texts as another one cells, or the name of a channel."""
    if _CHANNEL_WORD.search(before):
        return True
    for delimiter in DELIMITERS:
        if delimiter in line:
            cells = list(map(str.strip, before.split(delimiter)))
            is_same = len(cells) == len(line.split(delimiter))
            return is_same and all(cell_kind(cell) is CellKind.TEXT for cell in cells)
    return False


def _first_line(line: str, values: LineValues, grammar: Grammar) -> str:
    """Return the first line and what it was read as, for a note."""
    text = f"{quoted(line)} -> {values.text(grammar.columns)}"
    if grammar.is_by_order:
        text += "; hard is the first: columns=soft,hard if it is not"
    return text


def _columns(
    rows: CapturedRows, stamped: StampedText | None, line_format: LineFormat
) -> list[ColumnData]:
    """Return the columns of a table: times of the board, else the stamps; both channels."""
    columns = []
    for role, times_ns in rows.times_ns.items():
        if len(times_ns):
            seconds = np.array(times_ns, float) / 1e9
            columns.append(ColumnData(_COLUMN_NAMES[role], seconds, "s"))
    if not columns and stamped is not None and any(stamped.stamps):
        stamps = [stamped.stamps[number - 1] for number in rows.numbers]
        columns.append(ColumnData("time", np.array(stamps, object), stamped.unit))
    unit = "pF"
    if line_format.unit.name != "pF":
        unit = ""  # of another signal, as options.unit says
    columns.append(ColumnData("hard", np.array(rows.hard, float), unit))
    columns.append(ColumnData("soft", np.array(rows.soft, float), unit))
    return columns
