"""The grammar of lines on a serial port: a line is read as a whole, or refused with a reason."""

import json
import math
import re
from collections import Counter
from collections.abc import Sequence
from functools import reduce
from operator import xor
from typing import Any, NamedTuple

from palpate.ad7746.registers import LAST_CODE, capacitance_pF, is_saturated
from palpate.importers.units import PICOFARADS, checked_unit, unit_read
from palpate.messages import quoted
from palpate.samples import Sample, Status
from palpate.sources import options

Values = dict[str, Any]  # Role -> value: pF (float; nan: no value), ns (int), or a whole number.
UNUSED = "-"  # Name of a column that is not used; its cells may be any text.
TIMES = ("t", "t_hard", "t_soft")
CHANNELS = ("hard", "soft")
NANOSECONDS = {"s": 1e9, "ms": 1e6, "us": 1e3, "ns": 1.0}
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
OVERLOAD = 1e30  # Numbers from this size on say that there is no value, too: SCPI instruments send 9.9E+37.
# Range of the first capacitance of a channel whose unit is not given.
SMALLEST_PF = 0.01
LARGEST_PF = 100.0
LONGEST = 1000  # Bytes of a line, at most: anything longer is not text.
_LONGEST_NS = 2**62
_NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_DECIMALS = re.compile(r"[-+]?[0-9]*(\.[0-9]*)?")
_CHANGED = (
    8  # Values in a row with another number of decimals: the instrument has changed its range.
)
# Another number of decimals counts 1, the usual one takes so much off: above 3 it varies,
_VARYING = 3
_USUAL = 0.05
_ENDS = 5  # where values have ended with as many digits, and none with 0, which a varying number leaves out.
_CELL = re.compile(r"(?:([A-Za-z_]\w*)[=:])?(.*)", re.ASCII)
_NAMES = "columns= names each cell in order: hard, soft, t_ms, seq, ... or - if it is not used"


class Refused(ValueError):
    """A line that is not read; its text is the reason, and which option helps."""


class LineColumn(NamedTuple):
    """What a cell is: hard, soft, a time, a name in `WHOLE`, or "-"; and the unit in its name, or ""."""

    role: str
    unit: str = ""


Cells = list[tuple[str, str]]  # Name, "" without one, and text of each cell of a line.


class Decimals:
    """The usual number of decimals of a channel: where it is fixed, a value with another one has lost a character."""

    def __init__(self) -> None:
        self._counts = Counter[int]()
        self._last = (0, 0)  # number of decimals, values in a row with it
        self._varying = 0.0
        self._ends = set[str]()  # last digits of usual values
        self.padded = False  # one of them is 0, behind another decimal

    def require_usual(self, role: str, text: str, *, padded: bool) -> None:
        """Count a value; raises Refused. `padded`: a value of another channel ends with 0."""
        found = _DECIMALS.match(text)
        count = len(found[1] or "") if found and found[0] else 0
        self._counts[count] += 1
        self._last = count, self._last[1] + 1 if count == self._last[0] else 1
        if self._last[1] == _CHANGED:
            self._counts = Counter({count: _CHANGED})
        [(usual, _)] = self._counts.most_common(1)
        if count == usual:
            self._varying -= min(_USUAL, self._varying)
            self._ends.add(text[-1])
            self.padded |= count > 2 and text[-1] == "0"  # the point counts; 7.0 shows nothing
            return
        self._varying += 1
        if self.padded or padded or self._varying <= _VARYING or len(self._ends) < _ENDS:
            before = max(usual - 1, 0)
            raise Refused(
                f"{role} has {max(count - 1, 0)} decimals, before it had {before}: has it lost a character?"
            )
        self._varying = math.inf


class Grammar:
    """Reads lines. The first line that is read fixes the names, and the checksum, of the lines after it."""

    # `columns` are the cells in order, `pattern` is a regular expression with columns as its groups; `unit` is that of
    # capacitances whose name has none, pF.

    def __init__(
        self,
        columns: Sequence[LineColumn] = (),
        pattern: re.Pattern[str] | None = None,
        unit: float | str = 0.0,
    ) -> None:
        if columns and pattern:
            raise ValueError(
                "columns: got a pattern, too, allowed: one of them; a pattern's groups are its columns"
            )
        self.columns: Sequence[LineColumn] = (
            [column(name) for name in pattern.groupindex] if pattern else columns
        )
        self.by_order = False
        self.form: tuple[bool, list[str]] | None = None  # of all lines: checksum, names
        self._given = columns
        self._pattern = pattern
        self.unit = "pF" if isinstance(unit, float) else unit_read(unit)
        self._unit_pF = unit if isinstance(unit, float) else PICOFARADS.get(unit, 1.0)
        self._sized = False
        self._decimals = {role: Decimals() for role in CHANNELS}

    def read(self, line: bytes) -> Values:
        """Return the values of a line; raises Refused."""
        if len(line) > LONGEST:
            raise Refused(f"more than {LONGEST} bytes without a line end")
        text, summed = unsummed(line)
        cells = self._matched(text) if self._pattern else split(text)
        form = summed, [] if self._pattern else [label for label, _ in cells]
        if self.form not in (None, form):
            raise Refused("its names or its checksum are not as in the first line")
        columns = self._columns_of(cells)
        named = zip(columns, cells, strict=True)
        values = {
            each.role: self._value(each, cell) for each, (_, cell) in named if each.role != UNUSED
        }
        self._check_sizes(columns, values)
        padded = any(each.padded for each in self._decimals.values())
        # of both channels as many decimals as before
        for each, (_, cell) in zip(columns, cells, strict=True):
            if not summed and each.role in CHANNELS and not math.isnan(values[each.role]):
                self._decimals[each.role].require_usual(each.role, cell, padded=padded)
        if self.form is None:
            self.form = form
            self.columns = self.columns or columns
            self.by_order = not (self._given or self._pattern or any(form[1]))
        return values

    def _matched(self, text: str) -> Cells:
        match = self._pattern.fullmatch(text) if self._pattern else None
        if not match:
            raise Refused("it does not match the pattern as a whole")
        return [
            (name, found.strip()) for name, found in match.groupdict().items() if found is not None
        ]

    def _columns_of(self, cells: Cells) -> Sequence[LineColumn]:
        """Return what the cells are: by the option, by their names, or two numbers as hard and soft."""
        if not self._given and cells[-1:] == [("", "")]:  # a plotter's line ends with a comma
            del cells[-1:]
        labels = [label for label, _ in cells]
        if self._given:
            if len(cells) != len(self._given):
                raise Refused(
                    f"it has {len(cells)} cells, but columns= has {len(self._given)} names"
                )
            return self._given
        if all(labels):
            columns = [column(label) for label in labels]
            require_pair(columns)
            return columns
        if any(labels):
            raise Refused("it has cells with and without a name; a decimal comma is not read")
        if len(cells) != 2:
            raise Refused(f"{len(cells)} cells without names: which are hard and soft? {_NAMES}")
        if self.form is None and not all("." in text for _, text in cells):
            raise Refused("no decimals, no names: are they hard and soft, in pF? columns=hard,soft")
        return [LineColumn("hard"), LineColumn("soft")]

    def _value(self, one: LineColumn, text: str) -> float | int:
        """Return pF (nan: the instrument has no value), ns, or a whole number; raises Refused."""
        if one.role in CHANNELS:
            return _number(text) * (PICOFARADS[one.unit] if one.unit else self._unit_pF or 1.0)
        if one.role in WHOLE:
            low, high = WHOLE[one.role]
            if not (re.fullmatch("-?[0-9]{1,20}", text) and low <= int(text) <= high):
                raise Refused(f"{quoted(text)} is not a whole number from {low} to {high}")
            return int(text)
        if not one.unit:
            units = f"name it {one.role}_s, {one.role}_ms or {one.role}_us; {_NAMES}"
            raise Refused(f"the unit of {one.role} is not known: {units}")
        value = _number(text) * NANOSECONDS[one.unit]
        if not 0 <= value < _LONGEST_NS:
            raise Refused(f"{quoted(text)} is not a time")
        return round(value)

    def _check_sizes(self, columns: Sequence[LineColumn], values: Values) -> None:
        """Check that the first values without a unit have the size of pF; raises Refused."""
        if self._sized or self._unit_pF:
            return
        bare = [abs(values[one.role]) for one in columns if one.role in CHANNELS and not one.unit]
        if any(size < SMALLEST_PF or size > LARGEST_PF for size in bare):
            allowed = f"pF from {SMALLEST_PF:g} to {LARGEST_PF:g}"
            raise Refused(
                f"it has no unit, and its first values are not {allowed}: which unit? unit=fF"
            )
        self._sized = not math.isnan(sum(bare))


def _named_columns() -> dict[str, LineColumn]:
    """Return all names of columns in lower case, with each unit behind those that have one."""
    found = {name: LineColumn(name) for name in (*WHOLE, UNUSED)}
    found |= {"millis": LineColumn("t", "ms"), "micros": LineColumn("t", "us")}
    aliases = {"hard": "hard", "c1": "hard", "soft": "soft", "c2": "soft", "time": "t"} | {
        name: name for name in TIMES
    }
    for name, role in aliases.items():
        units = PICOFARADS if role in CHANNELS else NANOSECONDS
        found |= {name: LineColumn(role)} | {
            f"{name}_{unit}".casefold(): LineColumn(role, unit) for unit in units
        }
    return found


COLUMNS = _named_columns()  # Name in lower case -> column.


def column(name: str) -> LineColumn:
    """Return what a name means; raises Refused."""
    try:
        return COLUMNS[name.strip().casefold()]
    except KeyError:
        raise Refused(f"what is {quoted(name)}? {_NAMES}") from None


def require_pair(columns: Sequence[LineColumn]) -> None:
    """Check for both channels, no role twice, and one time, both times or none; raises Refused."""
    roles = [one.role for one in columns if one.role != UNUSED]
    if twice := sorted({role for role in roles if roles.count(role) > 1}):
        raise Refused(f"{twice[0]} is there twice")
    if set(roles) & {"hard", "soft", "hard_raw", "soft_raw"} not in (
        {"hard", "soft"},
        {"hard_raw", "soft_raw"},
    ):
        raise Refused("it has not both channels: hard and soft, or hard_raw and soft_raw")
    if ("t_hard" in roles) != ("t_soft" in roles) or ("t" in roles and "t_hard" in roles):
        raise Refused("it has not one time t, or both times t_hard and t_soft")


def unsummed(line: bytes) -> tuple[str, bool]:
    """Return a line without its checksum, and whether it had one: `*` and the XOR of all bytes before; raises Refused."""
    match = re.fullmatch(rb"(.*)\*([0-9A-Fa-f]{2})", line, re.DOTALL)
    if match and (found := reduce(xor, match[1], 0)) != int(match[2], 16):
        raise Refused(f"its checksum is {match[2].decode()}, but its text has {found:02X}")
    return (match[1] if match else line).decode(errors="replace").strip(), match is not None


def split(text: str) -> Cells:
    """Return the cells between ";", "|", "," or blanks, or the members of a JSON object; raises Refused."""
    if text.startswith("{"):
        try:
            members = json.loads(
                text, object_pairs_hook=list, parse_int=str, parse_float=str, parse_constant=str
            )
        except (ValueError, RecursionError) as error:
            raise Refused("it begins as a JSON object, but is none") from error
        return [(label, "nan" if value is None else str(value)) for label, value in members]
    plain = re.sub(r"^\((.*)\)$|^>", r"\1", text)  # a tuple; Teleplot
    tight = re.sub(r"\s*([=:;|,])\s*", r"\1", plain.strip())
    cells = (_CELL.fullmatch(part) for part in re.split(r"[;|,]|\s+", tight))
    return [(cell[1] or "", cell[2]) for cell in cells if cell]


def _number(text: str) -> float:
    """Return the value of a cell; nan: the instrument has no value; raises Refused."""
    if text.lstrip("+-").upper() in MARKS:
        return math.nan
    if not _NUMBER.fullmatch(text):
        raise Refused(f"{quoted(text)} is not a number")
    value = float(text)
    return value if abs(value) < OVERLOAD else math.nan


def shown(values: Values) -> str:
    """Return values as a message shows them."""
    forms = dict.fromkeys(CHANNELS, "{} {:.9g} pF") | dict.fromkeys(TIMES, "{} {:.9g} s")
    scaled = {role: value / 1e9 if role in TIMES else value for role, value in values.items()}
    return ", ".join(forms.get(role, "{} {}").format(role, value) for role, value in scaled.items())


def sample_of(values: Values) -> Sample:
    """Return the values as a sample, without number and times; raises Refused if its status contradicts its values."""
    hard_raw, soft_raw = codes = [values.get(f"{name}_raw", -1) for name in CHANNELS]
    known = [capacitance_pF(code) if code >= 0 else math.nan for code in codes]
    hard, soft = (values.get(name, value) for name, value in zip(CHANNELS, known, strict=True))
    lost = math.isnan(hard) or math.isnan(soft)
    status = values.get("status", int(Status.LOST) if lost else 0)
    if (status == Status.LOST) != lost:
        raise Refused(f"its status is {status}, but {'a value' if lost else 'no value'} is missing")
    if not lost:
        flags = (Status.HARD_SATURATED, Status.SOFT_SATURATED)
        status |= sum(
            flag
            for code, flag in zip(codes, flags, strict=True)
            if code >= 0 and is_saturated(code)
        )
    return Sample(
        0, 0, 0, hard_raw, soft_raw, hard, soft, int(status), values.get("t_uncertainty_us", -1)
    )


def _columns(name: str, value: Any) -> tuple[LineColumn, ...]:
    return _complete(
        name, str(value), str(value).split(","), "names of all cells in order, as t_ms,hard,soft"
    )


def _pattern(name: str, value: Any) -> re.Pattern[str]:
    try:
        found = re.compile(str(value))
    except (re.error, OverflowError, RecursionError) as error:
        raise ValueError(
            f"{name}: got {quoted(value)}, allowed: a regular expression ({error})"
        ) from error
    _complete(
        name,
        str(value),
        list(found.groupindex),
        "groups (?P<hard>...) and (?P<soft>...), named as columns",
    )
    return found


def _complete(name: str, value: str, names: list[str], allowed: str) -> tuple[LineColumn, ...]:
    """Return the columns of these names, if they have both channels."""
    try:
        found = tuple(map(column, names))
        require_pair(found)
    except Refused as error:
        raise ValueError(f"{name}: got {quoted(value)}, allowed: {allowed} ({error})") from error
    return found


def _unit(name: str, value: Any) -> float | str:
    """Return a unit, or the size of one count of a converter, pF."""
    if isinstance(value, str) and not _NUMBER.fullmatch(value):
        return checked_unit(name, value)
    return float(
        options.number(0, above=True)(
            f"{name} ({', '.join(PICOFARADS)}, or pF of one count)", value
        )
    )


OF_LINES: dict[str, options.Check] = {"columns": _columns, "pattern": _pattern, "unit": _unit}
