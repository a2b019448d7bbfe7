"""The grammar of lines from a port or a file: a line is read whole, or refused with a reason."""

import json
import math
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import reduce
from operator import xor
from typing import Any, NamedTuple

from palpate.ad7746.configuration import SATURATION
from palpate.ad7746.registers import LAST_CODE, capacitance_pF, is_saturated
from palpate.importers.units import (
    OVERLOAD,
    PICOFARADS,
    checked_unit,
    is_no_value,
    unit_read,
)
from palpate.messages import quoted
from palpate.samples import Sample, Status

UNUSED = "-"  # Name of a column that is not used; its cells may be any text.
TIMES = ("t", "t_hard", "t_soft")
CHANNELS = ("hard", "soft")
NANOSECONDS = {"s": 1e9, "ms": 1e6, "us": 1e3, "ns": 1.0}
# Units of times as tables write them, and here; "": without a unit.
_SAME_TIMES = {
    "": "",
    "s": "s",
    "sec": "s",
    "ms": "ms",
    "us": "us",
    "µs": "us",
    "μs": "us",
    "ns": "ns",
}
_UNITS_FOLDED = {unit.casefold(): unit for unit in PICOFARADS} | {"": ""}
# Columns of whole numbers, with their range.
WHOLE = {
    "seq": (0, 2**32 - 1),
    "hard_raw": (-1, LAST_CODE),
    "soft_raw": (-1, LAST_CODE),
    "capdac_hard": (0, 255),
    "capdac_soft": (0, 255),
    "status": (0, 8),
    "t_uncertainty_us": (-1, 2**31 - 1),
}
# Words in place of a number, in any case and with any sign: the instrument has no value.
MARKS = frozenset(["OL", "OVL", "OVLD", "OVER", "OVERLOAD", "OVF", "NAN", "INF"])
# Range of the first capacitance of a channel without a unit.
SMALLEST_PF = 0.01
LARGEST_PF = 100.0
LONGEST = 1000  # Bytes of a line, at most: anything longer is not text.
_LONGEST_NS = 2**62
_NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_DECIMALS = re.compile(r"[-+]?[0-9]*(\.[0-9]*)?")
# Values in a row with another number of decimals: the instrument has changed its range.
_CHANGED = 8
# Another number of decimals adds 1, the usual one subtracts a little: above 3 the number varies,
_VARYING = 3
_USUAL = 0.05
# if values have ended with at least so many other digits than 0, which such numbers leave out.
_ENDS = 5
_BRACKETS = re.compile(r"([A-Za-z_]\w*) ?[(\[]([A-Za-zµμ]+)[)\]](?=\s*[=:])")
# Names of columns as tables have them, with a unit after them or in brackets: CIN1, Hard (pF).
_NAME_OF_TABLE = re.compile(
    r"(?:c[ _]?)?(?P<bump>hard|soft)(?:[ _]?bump)?"
    r"|(?:c|cin|cap|capacitance)[ _]?(?P<number>[12])"
    r"|(?:t|time)[ _]?(?P<one>hard|soft)"
    r"|(?P<time>t|time|time[ _]?stamp|elapsed(?:[ _]?time)?)",
    re.IGNORECASE,
)
_UNIT_OF_NAME = re.compile(r"[ _]([A-Za-zµμ]+)$| ?[(\[]([A-Za-zµμ]+)[)\]]$")
_CELL = re.compile(r"(?:([A-Za-z_][A-Za-z0-9_µμ]*)[=:])?(.*)")
_NAMES = "columns= names each cell in order: hard, soft, t_ms, seq, ... or - if it is not used"


class Refused(ValueError):
    """A line that is not read; its text is the reason, and the option that helps."""


class LineColumn(NamedTuple):
    """Role of a cell (hard, soft, a time, a name in `WHOLE`, or "-"), and the unit in its name."""

    role: str
    unit: str = ""


class LineUnit(NamedTuple):
    """Unit of the capacitances whose column has none: its name, and its size, pF; 0: unknown."""

    name: str = "pF"
    pF: float = 0.0


class LineForm(NamedTuple):
    """What all lines have in common: a checksum or none, and the names of the cells."""

    has_checksum: bool
    names: list[str]


@dataclass(frozen=True)
class LineValues:
    """Values of a line, pF, ns and whole numbers; nan: there is no value, None: no such cell."""

    hard: float = math.nan
    soft: float = math.nan
    t: int | None = None
    t_hard: int | None = None
    t_soft: int | None = None
    seq: int | None = None
    hard_raw: int = -1
    soft_raw: int = -1
    capdac_hard: int | None = None
    capdac_soft: int | None = None
    status: int | None = None
    t_uncertainty_us: int = -1
    time_step_ns: int = 0  # of the last digit of its times

    def sample(self) -> Sample:
        """Return a sample without number and times; Refused if its status contradicts its values."""
        is_lost = math.isnan(self.hard + self.soft)
        status = self.status
        if status is None:
            status = int(Status.LOST) if is_lost else 0
        if (status == Status.LOST) != is_lost:
            missing = "a value" if is_lost else "no value"
            raise Refused(f"its status is {status}, but {missing} is missing")
        codes = self.hard_raw, self.soft_raw
        for code, flag in zip(codes, SATURATION, strict=True):
            if code >= 0 and not is_lost and is_saturated(code):
                status |= flag
        readings = self.hard, self.soft
        return Sample(0, 0, 0, *codes, *readings, int(status), self.t_uncertainty_us)

    def text(self, columns: Sequence[LineColumn]) -> str:
        """Return the values for a message, in the order of the columns."""
        texts = []
        values = asdict(self)
        for role, _ in columns:
            value: Any = values.get(role)
            if role in CHANNELS:
                texts.append(f"{role} {value:.9g} pF")
            elif role in TIMES:
                texts.append(f"{role} {value / 1e9:.9g} s")
            elif value is not None:
                texts.append(f"{role} {value}")
        return ", ".join(texts)


class Decimals:
    """The usual number of decimals of a channel; a value with another one has lost a character."""

    def __init__(self) -> None:
        self._counts = Counter[int]()
        self._last = -1  # number of decimals
        self._run = 0  # values in a row with it
        self._varying = 0.0
        self._ends = set[str]()  # last digits of usual values
        self.padded = False  # one of them is 0, behind another decimal

    def require_usual(self, role: str, text: str, *, padded: bool) -> None:
        """Count a value; raises Refused. `padded`: a value of another channel ends with 0."""
        match = _DECIMALS.match(text)
        count = len(match[1] or "") if match else 0  # with the point
        self._counts[count] += 1
        if count != self._last:
            self._last = count
            self._run = 0
        self._run += 1
        if self._run == _CHANGED:
            self._counts = Counter({count: _CHANGED})
        [(usual, _)] = self._counts.most_common(1)
        if count == usual:
            self._varying = max(self._varying - _USUAL, 0)
            self._ends.add(text[-1])
            self.padded |= count > 2 and text[-1] == "0"  # 7.0 shows nothing
            return
        self._varying += 1
        if self.padded or padded or self._varying <= _VARYING or len(self._ends) < _ENDS:
            before = max(usual - 1, 0)
            raise Refused(
                f"{role} has {max(count - 1, 0)} decimals, before it had {before}: "
                "has it lost a character?"
            )
        self._varying = math.inf


def _named_columns() -> dict[str, LineColumn]:
    """Return all names of columns in lower case; of capacitances and times also with each unit."""
    columns = {name: LineColumn(name) for name in (*WHOLE, UNUSED)}
    columns |= {"millis": LineColumn("t", "ms"), "micros": LineColumn("t", "us")}
    roles = {"hard": "hard", "c1": "hard", "soft": "soft", "c2": "soft", "time": "t"}
    roles |= zip(TIMES, TIMES, strict=True)
    for name, role in roles.items():
        columns[name] = LineColumn(role)
        for unit in PICOFARADS if role in CHANNELS else NANOSECONDS:
            columns[f"{name}_{unit}".casefold()] = LineColumn(role, unit)
    return columns


COLUMNS = _named_columns()  # Name in lower case -> column.


def column(name: str) -> LineColumn:
    """Return the column with a name, written as here or as in a table; raises Refused.

    Examples
    --------
    >>> column("CIN1") == column("hard"), column("Hard (fF)"), column("T_MS")
    (True, LineColumn(role='hard', unit='fF'), LineColumn(role='t', unit='ms'))
    """
    text = name.strip()
    known = COLUMNS.get(text.casefold())
    if text == "T":  # a temperature
        known = None
    elif known is None:
        known = _column_of_table(text)
    if known is None:
        raise Refused(f"what is {quoted(name)}? {_NAMES}")
    return known


def _column_of_table(name: str) -> LineColumn | None:
    """Return the column with a name as a table has it; None: there is none."""
    word = ""
    match = _NAME_OF_TABLE.fullmatch(name)
    if match is None:
        unit_match = _UNIT_OF_NAME.search(name)
        if unit_match is None:
            return None
        word = unit_match[1] or unit_match[2]
        match = _NAME_OF_TABLE.fullmatch(name[: unit_match.start()])
    if match is None:
        return None
    groups = match.groupdict()
    if groups["time"] or groups["one"]:
        unit = _SAME_TIMES.get(word.casefold())
        role = f"t_{groups['one'].casefold()}" if groups["one"] else "t"
    else:
        unit = _UNITS_FOLDED.get(word.casefold())
        is_soft = "soft" in (groups["bump"] or "").casefold() or groups["number"] == "2"
        role = "soft" if is_soft else "hard"
    if unit is None:
        return None
    return LineColumn(role, unit)


def require_pair(columns: Sequence[LineColumn]) -> None:
    """Check for both channels, no role twice, and one time, both times or none; raises Refused."""
    roles = Counter(role for role, _ in columns if role != UNUSED)
    for role in sorted(roles):
        if roles[role] > 1:
            raise Refused(f"{role} is there twice")
    channels = roles.keys() & {"hard", "soft", "hard_raw", "soft_raw"}
    if channels not in ({"hard", "soft"}, {"hard_raw", "soft_raw"}):
        raise Refused("it has not both channels: hard and soft, or hard_raw and soft_raw")
    if roles.keys() & set(TIMES) not in (set(), {"t"}, {"t_hard", "t_soft"}):
        raise Refused("it has not one time t, or both times t_hard and t_soft")


def parse_columns(name: str, value: Any) -> tuple[LineColumn, ...]:
    """Return the columns of cells in order, from their names; ValueError for other texts."""
    allowed = "names of all cells in order, as t_ms,hard,soft"
    return _columns_with(name, value, str(value).split(","), allowed)


def parse_pattern(name: str, value: Any) -> re.Pattern[str]:
    """Return a regular expression whose groups are columns; ValueError for other texts."""
    try:
        pattern = re.compile(str(value))
    except (re.error, OverflowError, RecursionError) as error:
        raise ValueError(
            f"{name}: got {quoted(value)}, allowed: a regular expression ({error})"
        ) from error
    allowed = "groups (?P<hard>...) and (?P<soft>...), named as columns"
    _columns_with(name, value, list(pattern.groupindex), allowed)
    return pattern


def _columns_with(
    option_name: str, value: Any, names: list[str], allowed: str
) -> tuple[LineColumn, ...]:
    """Return the columns with these names, if they have both channels."""
    try:
        columns = tuple(map(column, names))
        require_pair(columns)
    except Refused as error:
        raise ValueError(
            f"{option_name}: got {quoted(str(value))}, allowed: {allowed} ({error})"
        ) from error
    return columns


def parse_unit(name: str, value: Any) -> LineUnit:
    """Return a unit, or the size of one count of a converter, pF."""
    if isinstance(value, str) and not _NUMBER.fullmatch(value):
        unit = checked_unit(name, value)
        return LineUnit(unit_read(unit), PICOFARADS.get(unit, 1.0))
    title = f"{name} ({', '.join(PICOFARADS)}, or pF of one count)"
    count_pF = float(value)
    if not 0 < count_pF < math.inf:
        raise ValueError(f"{title}: got {quoted(value)}, allowed: a number above 0")
    return LineUnit(pF=count_pF)


@dataclass(frozen=True)
class LineFormat:
    """How to read lines: the cells in order, or a regular expression with them as groups."""

    columns: tuple[LineColumn, ...] = ()
    pattern: re.Pattern[str] | None = None
    unit: LineUnit = LineUnit()  # noqa: RUF009  it cannot be changed

    def __post_init__(self) -> None:
        """Check that the cells are not named twice."""
        if self.columns and self.pattern:
            raise ValueError(
                "columns: got a pattern, too, allowed: one of them; a pattern's groups are its "
                "columns"
            )


Cells = list[tuple[str, str]]  # Name, "" without one, and text of each cell of a line.


class Grammar:
    """Reads lines. The first line that is read fixes names and checksum of the lines after it."""

    def __init__(self, options: LineFormat) -> None:
        self._pattern = options.pattern
        self._option = options.columns
        self.columns: Sequence[LineColumn] = options.columns
        if self._pattern:
            self.columns = [column(name) for name in self._pattern.groupindex]
        self.unit = options.unit
        self.form: LineForm | None = None
        self.is_by_order = False
        self._is_size_checked = self.unit.pF > 0
        self._decimals = {role: Decimals() for role in CHANNELS}

    def read(self, line: bytes) -> LineValues:
        """Return the values of a line; raises Refused."""
        if len(line) > LONGEST:
            raise Refused(f"more than {LONGEST} bytes without a line end")
        text, has_checksum = without_checksum(line)
        names: list[str] = []
        if self._pattern:
            cells = match_cells(self._pattern, text)
        else:
            cells = split_line(text)
            names += [label for label, _ in cells]
        form = LineForm(has_checksum, names)
        if self.form not in (None, form):
            raise Refused("its names or its checksum are not as in the first line")
        columns = self._columns_of(cells)
        values: dict[str, Any] = {}
        texts: dict[str, str] = {}
        for each, (_, cell) in zip(columns, cells, strict=True):
            if each.role != UNUSED:
                values[each.role] = self._value(each, cell)
                texts[each.role] = cell
        self._check_sizes(columns, values)
        if not has_checksum:
            self._check_decimals(texts, values)
        for name in CHANNELS:
            code = values.get(f"{name}_raw", -1)
            if code >= 0:
                values[name] = capacitance_pF(code)
        if self.form is None:
            self.form = form
            self.columns = self.columns or columns
            self.is_by_order = not (self._option or self._pattern or any(names))
        return LineValues(**values, time_step_ns=_time_step_ns(columns, texts))

    def _columns_of(self, cells: Cells) -> Sequence[LineColumn]:
        """Return the columns: by the option, by their names, or two numbers as hard and soft."""
        if self._option:
            if len(cells) != len(self._option):
                raise Refused(
                    f"it has {len(cells)} cells, but columns= has {len(self._option)} names"
                )
            return self._option
        if cells[-1:] == [("", "")]:  # a plotter's line ends with a comma
            del cells[-1:]
        labels = [label for label, _ in cells]
        if all(labels):
            columns = [column(label) for label in labels]
            require_pair(columns)
            return columns
        if any(labels):
            raise Refused(f"cells with and without a name; a decimal comma is not read; {_NAMES}")
        if len(cells) != 2:
            raise Refused(f"{len(cells)} cells without names: which are hard and soft? {_NAMES}")
        if self.form is None and not all("." in text for _, text in cells):
            raise Refused("no decimals, no names: are they hard and soft, in pF? columns=hard,soft")
        return [LineColumn("hard"), LineColumn("soft")]

    def _value(self, column: LineColumn, text: str) -> float:
        """Return pF (nan: the instrument has no value), ns, or a whole number; raises Refused."""
        role, unit = column
        if role in CHANNELS:
            return _number(text) * (PICOFARADS[unit] if unit else self.unit.pF or 1.0)
        if role in WHOLE:
            low, high = WHOLE[role]
            if not (re.fullmatch("-?[0-9]{1,20}", text) and low <= int(text) <= high):
                raise Refused(f"{quoted(text)} is not a whole number from {low} to {high}")
            return int(text)
        if not unit:
            units = f"name it {role}_s, {role}_ms or {role}_us; {_NAMES}"
            raise Refused(f"the unit of {role} is not known: {units}")
        value = _number(text) * NANOSECONDS[unit]
        if not 0 <= value < _LONGEST_NS:
            raise Refused(f"{quoted(text)} is not a time")
        return round(value)

    def _check_sizes(self, columns: Sequence[LineColumn], values: dict[str, float]) -> None:
        """Check that the first values without a unit have the size of pF; raises Refused."""
        if self._is_size_checked:
            return
        sizes = [abs(values[role]) for role, unit in columns if role in CHANNELS and not unit]
        if any(size < SMALLEST_PF or size > LARGEST_PF for size in sizes):
            allowed = f"pF from {SMALLEST_PF:g} to {LARGEST_PF:g}"
            raise Refused(
                f"it has no unit, and its first values are not {allowed}: which unit? unit=fF"
            )
        self._is_size_checked = not math.isnan(sum(sizes))

    def _check_decimals(self, texts: dict[str, str], values: dict[str, float]) -> None:
        """Check that both channels have as many decimals as before; raises Refused."""
        padded = any(each.padded for each in self._decimals.values())
        for role, decimals in self._decimals.items():
            if not math.isnan(values.get(role, math.nan)):
                decimals.require_usual(role, texts[role], padded=padded)


def without_checksum(line: bytes) -> tuple[str, bool]:
    """Return the text of a line, and whether it has a checksum; raises Refused if that is wrong.

    The checksum is `*` and the XOR of all bytes before, two hexadecimal digits.
    """
    match = re.fullmatch(rb"(.*)\*([0-9A-Fa-f]{2})", line, re.DOTALL)
    if match:
        line = match[1]
        checksum = reduce(xor, line, 0)
        if checksum != int(match[2], 16):
            raise Refused(f"its checksum is {match[2].decode()}, but its text has {checksum:02X}")
    return line.decode(errors="replace").strip(), match is not None


def match_cells(pattern: re.Pattern[str], text: str) -> Cells:
    """Return the groups of a pattern as cells; raises Refused."""
    match = pattern.fullmatch(text)
    if not match:
        raise Refused("it does not match the pattern as a whole")
    groups = match.groupdict().items()
    return [(name, cell.strip()) for name, cell in groups if cell is not None]


def split_line(text: str) -> Cells:
    """Return the cells between ";", "|", "," or blanks, or of a JSON object; raises Refused."""
    if text.startswith("{"):
        try:
            members = json.loads(
                text, object_pairs_hook=list, parse_int=str, parse_float=str, parse_constant=str
            )
        except (ValueError, RecursionError) as error:
            raise Refused("it begins as a JSON object, but is none") from error
        return [(label, "nan" if value is None else str(value)) for label, value in members]
    text = re.sub(r"^\((.*)\)$|^>", r"\1", text)  # a tuple; Teleplot
    text = _BRACKETS.sub(r"\1_\2", text)  # Hard (pF) = 6.92
    text = re.sub(r"\s*([=:;|,])\s*", r"\1", text.strip())
    cells = []
    for part in re.split(r"[;|,]|\s+", text):
        match = _CELL.fullmatch(part)
        if match:
            cells.append((match[1] or "", match[2]))
    return cells


def _time_step_ns(columns: Sequence[LineColumn], texts: dict[str, str]) -> int:
    """Return the size of the last digit of the times of a line, ns; 0: unknown, or no times."""
    for role, unit in columns:
        if role in TIMES and "e" not in texts[role].casefold():
            decimals = len(texts[role].partition(".")[2])
            step_ns: float = NANOSECONDS[unit] / 10**decimals
            return round(step_ns)
    return 0


def _number(text: str) -> float:
    """Return the value of a cell; nan: the instrument has no value; raises Refused."""
    if text.lstrip("+-").upper() in MARKS or (text.lstrip("+-") and is_no_value(text)):
        return math.nan
    if not _NUMBER.fullmatch(text):
        raise Refused(f"{quoted(text)} is not a number")
    value = float(text)
    return value if abs(value) < OVERLOAD else math.nan
