"""Units of capacitances and times, the names that columns have, and cells that mean "no value"."""

import math
import re
from collections.abc import Collection
from functools import lru_cache

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
_OTHER_UNITS = frozenset(
    "mgsANVWJCTKLlHSΩ%1"
)  # how "mm", "nN" and the like end, which are one letter from mF and nF
_WORDS = {
    "second": "s", "seconds": "s", "secs": "s", "lsl_timestamp": "s", "msec": "ms", "millis": "ms", "milliseconds": "ms",
    "usec": "us", "micros": "us", "microseconds": "us", "nanos": "ns", "nanoseconds": "ns", "minutes": "min", "days": "d",
}  # fmt: skip
_LAST = re.compile(r"[(\[]([^()\[\]]*)[)\]]\s*$|(?:^|[\s_/])([^\s_/()\[\]]+)\s*$")
_OTHERS = ("%", "percent", "mv", "volt", "volts", "hz", "counts", "count", "cnt", "raw", "lsb", "adc", "digits", "codes",
           "norm", "normalized", "rel", "uv", "kv", "mn", "kn", "um", "mm", "cm", "kpa", "mpa", "ma", "ohm", "ohms")  # fmt: skip
_CAPITALS = ("V", "N")  # as letters of a name they are channels


def checked_unit(name: str, value: object) -> str:
    """Return a unit of two signals: one of capacitance, or any text that is not one of these with a wrong letter.

    Examples
    --------
    >>> checked_unit("unit", "N"), unit_read("N"), unit_read("fF")
    ('N', 'N', 'pF')
    """
    text = value.strip() if isinstance(value, str) else ""
    slip = any(_one_letter(text.casefold(), unit.casefold()) for unit in PICOFARADS)
    if not text or (slip and text not in PICOFARADS and text[-1] not in _OTHER_UNITS):
        raise ValueError(
            f"{name}: {unlike(value, PICOFARADS)}; or another unit, as N; not one so like these"
        )
    return text


def _one_letter(one: str, other: str) -> bool:
    """Return whether two texts differ by one letter at most: more, less, or another one."""
    short, long = sorted((one, other), key=len)
    return any(
        short[:i] + short[i + (len(short) == len(long)) :] == long[:i] + long[i + 1 :]
        for i in range(len(long))
    )


def unit_read(unit: str) -> str:
    """Return the unit of the values that are read: pF of any capacitance, else as given."""
    return "pF" if unit in PICOFARADS else unit


def last_word(name: str) -> str:
    """Return what stands in brackets at the end of a name, else its last word."""
    match = _LAST.search(name)
    return (match[1] or match[2] or "").strip() if match else ""


def unit_in(name: str, units: Collection[str]) -> str | None:
    """Return the unit at the end of a name, if it is one of `units`."""
    word = last_word(name)
    return word if word in units else {unit.casefold(): unit for unit in units}.get(word.casefold())


def time_unit_in(name: str) -> str | None:
    """Return the unit of time that a name ends with, or is."""
    return (
        unit_in(name, SECONDS)
        or _WORDS.get(last_word(name).casefold())
        or _WORDS.get(name.casefold())
    )


def stated_unit(name: str) -> str:
    """Return the unit of capacitance at the end of a name, else what is there as unit: anything in brackets, some words; or ""."""
    word, in_brackets = last_word(name), name.rstrip().endswith((")", "]"))
    return unit_in(name, PICOFARADS) or (
        word if in_brackets or word.casefold() in _OTHERS or word in _CAPITALS else ""
    )


def bare(name: str) -> str:
    """Return a name without its unit: 'C1 (pF)' gives 'C1'."""
    match, word = _LAST.search(name), last_word(name)
    known = match and (word in PICOFARADS or word in SECONDS or word == "%")
    return (name[: match.start()] if match and known else name).strip(" _/")


def simple_name(name: str) -> str:
    """Return a name in lower case, without unit, blanks and underscores: 'C_1 (pF)' gives 'c1'; one that is a unit stays."""
    return re.sub(r"[\s_./#:-]+", "", bare(name)).casefold() or name.strip().casefold()


# Names of a column of times, without blanks, underscores and units.
TIMES = frozenset({
    "time", "t", "timestamp", "timestamps", "datetime", "date", "clock", "elapsed", "elapsedtime", "seconds", "secs", "millis",
    "milliseconds", "micros", "microseconds", "nanos", "nanoseconds", "lsltimestamp", "epoch", "unixtime", "utc", "hosttime",
    "zeit", "uhrzeit", "datum", "zeitstempel", "thard", "timehard", "hardtime", "timea", "time1", "t1",
    *(unit.casefold() for unit in SECONDS),
})  # fmt: skip
# Names of the times of the soft channel, beside those of the hard channel.
SOFT_TIMES = frozenset({"tsoft", "timesoft", "softtime", "timeb", "time2", "t2"})
# Names of the hard and the soft channel. Others leave open which is which.
PAIRS = (("hard", "soft"), ("chard", "csoft"), ("hardbump", "softbump"), ("c1", "c2"), ("cin1", "cin2"),
         ("cap1", "cap2"), ("capacitance1", "capacitance2"))  # fmt: skip
# Cells (upper case) that mean "no value" in the files of loggers and spreadsheets.
NO_VALUE = frozenset({
    "", "OL", "+OL", "-OL", "OVL", "OVLD", "OVER", "OVERLOAD", "OVERFLOW", "OVFL", "OPEN", "ERR", "ERROR", "NAN", "NA",
    "N/A", "NAT", "<NA>", "NULL", "NONE", "-", "--", "---", "INF", "+INF", "-INF", "#N/A", "#NUM!", "#VALUE!", "#DIV/0!",
    "#REF!", "#NAME?", "#NULL!", "∞", "+∞", "-∞",
})  # fmt: skip
# Words that rows or columns of statistics begin with.
SUMMARY = re.compile(r"\W*(?:average|avg|mean|median|mittel\w*|min|max|minimum|maximum|sum|summe|total|count|range|rms|"
                     r"sd|sigma|std|stdv|std ?dev|stdev|stdabw|standard|var|variance)\b", re.IGNORECASE)  # fmt: skip
OVERLOAD = 1e30  # numbers of this magnitude mean "no value": SCPI instruments send 9.9E+37


def to_number(cell: str, marks: str = ".,") -> float:
    """Return the value of a cell with one of these decimal marks; nan if it is one of `NO_VALUE`; ValueError if no number."""
    if cell.upper() in NO_VALUE:
        return math.nan
    if not re.fullmatch(rf"[+-]?(?:\d+[{marks}]?\d*|[{marks}]\d+)(?:[eE][+-]?\d+)?", cell):
        raise ValueError(cell)
    value = float(cell.replace(",", "."))
    return value if abs(value) < OVERLOAD else math.nan


_NUMBER = re.compile(r"[+-]?(?:\d[\d.,]*|[.,]\d+)(?:[eE][+-]?\d+)?")
_TIME = re.compile(
    r"\d{1,4}[-/.]\d{1,2}[-/.]\d{2,4}(?:[T ].*)?|\d{1,4}:\d\d[\d:.,]*(?: ?[AaPp][Mm])?"
)
NUMBER, TIME, NONE, TEXT = "number", "time", "none", "text"


@lru_cache(maxsize=4096)  # a line is split in several ways, and many cells are equal
def kind(cell: str) -> str:
    """Return whether a cell is a number, a time (or date), no value, or text."""
    if cell.upper() in NO_VALUE:
        return NONE
    return NUMBER if _NUMBER.fullmatch(cell) else TIME if _TIME.fullmatch(cell) else TEXT
