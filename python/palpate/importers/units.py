"""Units of capacitances and times, the names of columns, and what a cell of a table contains."""

import math
import re
from collections.abc import Collection
from enum import Enum
from functools import lru_cache, partial

from palpate.messages import unlike

PICOFARADS = {
    "aF": 1e-6,
    "fF": 1e-3,
    "pF": 1.0,
    "nF": 1e3,
    "uF": 1e6,
    "µF": 1e6,
    "μF": 1e6,
    "mF": 1e9,
    "F": 1e12,
}
"""Units of capacitance, pF."""
SECONDS = {
    "s": 1.0,
    "sec": 1.0,
    "ms": 1e-3,
    "us": 1e-6,
    "µs": 1e-6,
    "μs": 1e-6,
    "ns": 1e-9,
    "min": 60.0,
    "d": 86400.0,
}
"""Units of time, s."""
_UNITS_FOLDED = frozenset(map(str.casefold, [*PICOFARADS, *SECONDS]))
OVERLOAD = 1e30
"""Numbers of this magnitude mean "no value": SCPI instruments send 9.9E+37."""

# Last letters of other units: "mm" and "nN" differ by one letter from mF and nF.
_OTHER_UNITS = frozenset("mgsANVWJCTKLlHSΩ%1")
_TIME_WORDS = {
    "second": "s",
    "seconds": "s",
    "secs": "s",
    "lsl_timestamp": "s",
    "msec": "ms",
    "millis": "ms",
    "milliseconds": "ms",
    "usec": "us",
    "micros": "us",
    "microseconds": "us",
    "nanos": "ns",
    "nanoseconds": "ns",
    "minutes": "min",
    "days": "d",
}
_LAST_WORD = re.compile(r"[(\[]([^()\[\]]*)[)\]]\s*$|(?:^|[\s_/])([^\s_/()\[\]]+)\s*$")
_OTHER_UNIT_WORDS = frozenset({
    "%", "percent", "mv", "volt", "volts", "hz", "counts", "count", "cnt", "raw", "lsb", "adc",
    "digits", "codes", "norm", "normalized", "rel", "uv", "kv", "mn", "kn", "um", "mm", "cm", "kpa",
    "mpa", "ma", "ohm", "ohms",
})  # fmt: skip
_MORE_UNITS = frozenset({
    "v", "n", "a", "sequence", "index", "°c", "c", "degc", "ampere", "farad", "farads", "newton", "m",
    "pa", "bar", "-", "",
})  # fmt: skip
_OTHER_UNIT_CAPITALS = frozenset({"V", "N"})  # v and n may be names of channels

# Names without blanks, underscores and units, in lower case.
TIME_NAMES = frozenset({
    "time", "t", "timestamp", "timestamps", "datetime", "date", "clock", "elapsed", "elapsedtime",
    "seconds", "secs", "millis", "milliseconds", "micros", "microseconds", "nanos", "nanoseconds",
    "lsltimestamp", "epoch", "unixtime", "utc", "hosttime", "zeit", "uhrzeit", "datum",
    "zeitstempel", "xvalue", "thard", "timehard", "hardtime", "timea", "time1", "t1",
    *map(str.casefold, SECONDS),
})  # fmt: skip
SOFT_TIME_NAMES = frozenset({"tsoft", "timesoft", "softtime", "timeb", "time2", "t2"})
"""Names of the times of the soft channel, if the hard channel has its own."""
CHANNEL_NAMES = (
    ("hard", "soft"),
    ("chard", "csoft"),
    ("hardbump", "softbump"),
    ("c1", "c2"),
    ("cin1", "cin2"),
    ("cap1", "cap2"),
    ("capacitance1", "capacitance2"),
)
"""Names of the hard and the soft channel; with other names it is unknown which is which."""
SUMMARY = re.compile(
    r"\W*(?:average|avg|mean|median|mittel\w*|min|max|minimum|maximum|sum|summe|total|count|range"
    r"|rms|sd|sigma|std|stdv|std ?dev|stdev|stdabw|standard|var|variance)\b",
    re.IGNORECASE,
)
"""Words with which rows or columns of statistics begin."""

_NO_VALUE = frozenset({
    "", "OL", "+OL", "-OL", "OVL", "OVLD", "OVER", "OVERLOAD", "OVERFLOW", "OVFL", "OPEN", "ERR",
    "ERROR", "NAN", "NA", "N/A", "NAT", "<NA>", "NULL", "NONE", "-", "--", "---", "INF", "+INF",
    "-INF", "#N/A", "#NUM!", "#VALUE!", "#DIV/0!", "#REF!", "#NAME?", "#NULL!", "∞", "+∞", "-∞",
})  # fmt: skip
# As Microsoft's and GNU's libraries print a number that is none: -1.#IND, 1.#QNAN, -nan(ind).
_PRINTED_NAN = re.compile(r"[+-]?(?:1\.#(?:IND|QNAN|SNAN|INF|J)\d*|NAN(?:\(\w*\))?)", re.IGNORECASE)
_DOUBLE = r"[+-]?(?:\d+[.,]\d*|[.,]\d+)[dD][+-]?\d+"  # 1.5D+01: double precision of Fortran
_NUMBER = re.compile(rf"[+-]?(?:\d[\d.,]*|[.,]\d+)(?:[eE][+-]?\d+)?|{_DOUBLE}")
_DOUBLE_CELL = re.compile(_DOUBLE)
_DURATION = re.compile(r"([+-]?(?:\d[\d.,]*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*([A-Za-zµμ]+)")
_TIME = re.compile(
    r"\d{1,4}[-/.]\d{1,2}[-/.]\d{2,4}(?:[T ].*)?|\d{1,4}:\d\d[\d:.,]*(?: ?[AaPp][Mm])?"
)


def checked_unit(name: str, value: object) -> str:
    """Return the unit of two signals: of capacitance, or any text that is not a misspelt one.

    Examples
    --------
    >>> checked_unit("unit", "N"), unit_read("N"), unit_read("fF")
    ('N', 'N', 'pF')
    """
    text = value.strip() if isinstance(value, str) else ""
    if text in PICOFARADS:
        return text
    near = partial(_one_letter_apart, text.casefold())
    similar = any(map(near, map(str.casefold, PICOFARADS)))
    if not text or (similar and text[-1] not in _OTHER_UNITS):
        others = "or another unit, as N; not one so like these"
        raise ValueError(f"{name}: {unlike(value, PICOFARADS)}; {others}")
    return text


def _one_letter_apart(one: str, other: str) -> bool:
    """Return whether two texts differ by at most one letter: added, removed or replaced."""
    short, long = sorted((one, other), key=len)
    replaced = len(short) == len(long)
    for i in range(len(long)):
        if short[:i] + short[i + replaced :] == long[:i] + long[i + 1 :]:
            return True
    return False


def unit_read(unit: str) -> str:
    """Return the unit of values that were read in `unit`: any capacitance is converted to pF."""
    return "pF" if unit in PICOFARADS else unit


def _last_word(name: str) -> str:
    """Return the text in brackets at the end of a name, else its last word."""
    match = _LAST_WORD.search(name)
    if match is None:
        return ""
    return (match[1] or match[2] or "").strip()


def _unit_in(name: str, units: Collection[str]) -> str | None:
    """Return the unit at the end of a name, if it is one of `units`, in any case."""
    word = _last_word(name)
    if word in units:
        return word
    folded = {unit.casefold(): unit for unit in units}
    return folded.get(word.casefold())


def time_unit_in(name: str) -> str | None:
    """Return the unit of time that a name ends with, or is."""
    unit = _unit_in(name, SECONDS)
    return unit or _TIME_WORDS.get(_last_word(name).casefold()) or _TIME_WORDS.get(name.casefold())


def stated_unit(name: str) -> str:
    """Return the unit at the end of a name, also one that is no capacitance; "" if there is none.

    Examples
    --------
    >>> stated_unit("C1 (pF)"), stated_unit("C1_counts"), stated_unit("C1 (0.1 pF)"), stated_unit("C1")
    ('pF', 'counts', '0.1 pF', '')
    """
    unit = _unit_in(name, PICOFARADS)
    if unit:
        return unit
    word = _last_word(name)
    in_brackets = name.rstrip().endswith((")", "]"))
    if in_brackets or word.casefold() in _OTHER_UNIT_WORDS or word in _OTHER_UNIT_CAPITALS:
        return word
    return ""


def is_unit_word(word: str) -> bool:
    """Return whether a text is the unit of a column, as in a row of units below the names.

    Examples
    --------
    >>> is_unit_word("Volt"), is_unit_word("pf"), is_unit_word("second"), is_unit_word("C1")
    (True, True, True, False)
    """
    folded = word.casefold()
    if folded in _UNITS_FOLDED or folded in _TIME_WORDS:
        return True
    return folded in _OTHER_UNIT_WORDS or folded in _MORE_UNITS


def bare_name(name: str) -> str:
    """Return a name without its unit: 'C1 (pF)' gives 'C1'."""
    match = _LAST_WORD.search(name)
    if match and _is_unit(_last_word(name), in_brackets=match[1] is not None):
        name = name[: match.start()]
    return name.strip(" _/")


def _is_unit(word: str, *, in_brackets: bool) -> bool:
    """Return whether a word is a unit; in brackets and with two letters or more in any case."""
    if word in PICOFARADS or word in SECONDS or word == "%":
        return True
    if len(word) < 2 and not in_brackets:
        return False
    return word.casefold() in _UNITS_FOLDED


def simple_name(name: str) -> str:
    """Return a name in lower case, without unit, blanks and underscores: 'C_1 (pF)' gives 'c1'.

    A name that is a unit stays as it is.
    """
    simple = re.sub(r"[\s_./#:-]+", "", bare_name(name)).casefold()
    return simple or name.strip().casefold()


class CellKind(Enum):
    """What the text of a cell contains."""

    NUMBER = "number"
    TIME = "time"  # or a date
    NO_VALUE = "no value"
    TEXT = "text"


@lru_cache(maxsize=4096)  # lines are split in several ways, and many cells are equal
def cell_kind(cell: str) -> CellKind:
    """Return what the text of a cell contains."""
    if is_no_value(cell):
        return CellKind.NO_VALUE
    if _NUMBER.fullmatch(cell):
        return CellKind.NUMBER
    if _TIME.fullmatch(cell) or duration_parts(cell):
        return CellKind.TIME
    return CellKind.TEXT


def is_no_value(cell: str) -> bool:
    """Return whether a cell is empty, or a mark of "no value", as OL, NaN or -1.#IND."""
    return cell.upper() in _NO_VALUE or _PRINTED_NAN.fullmatch(cell) is not None


def duration_parts(cell: str) -> tuple[str, str] | None:
    """Return the number and the unit of a duration, as 0.37 sec; None if a cell is none.

    Examples
    --------
    >>> duration_parts("0.37058 sec"), duration_parts("12ms"), duration_parts("6.9 pF")
    (('0.37058', 's'), ('12', 'ms'), None)
    """
    match = _DURATION.fullmatch(cell)
    if match is None:
        return None
    unit = time_unit_in(match[2])
    if unit is None:
        return None
    if unit == "sec":
        unit = "s"
    return match[1], unit


def is_text(cell: str) -> bool:
    """Return whether a cell has neither a number nor a time nor a mark of "no value"."""
    return cell_kind(cell) is CellKind.TEXT


def to_number(cell: str, marks: str = ".,") -> float:
    """Return the number in a cell with one of these decimal marks; nan for a mark of "no value".

    Raises
    ------
    ValueError
        The cell is no number; the message is the cell.
    """
    if is_no_value(cell):
        return math.nan
    digits = rf"[+-]?(?:\d+[{marks}]?\d*|[{marks}]\d+)"
    if not re.fullmatch(rf"{digits}(?:[eE][+-]?\d+)?", cell):
        is_double = re.fullmatch(rf"{digits}[dD][+-]?\d+", cell) and _DOUBLE_CELL.fullmatch(cell)
        if not is_double:
            raise ValueError(cell)
        cell = cell.casefold().replace("d", "e")
    value = float(cell.replace(",", "."))
    if abs(value) < OVERLOAD:
        return value
    return math.nan
