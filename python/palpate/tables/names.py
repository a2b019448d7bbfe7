"""Names that people give to columns of times and capacitances."""

import re
from collections.abc import Collection

from palpate.tables.table import Table
from palpate.tables.units import SECONDS, bare, bare_name

TIMES = frozenset({
    "time", "t", "timestamp", "timestamps", "datetime", "date", "clock", "elapsed", "elapsedtime", "seconds", "secs",
    "millis", "milliseconds", "micros", "microseconds", "nanos", "nanoseconds", "lsltimestamp", "epoch", "unix",
    "unixtime", "utc", "localtime", "systemtime", "hosttime", "relativetime", "timesincestart", "recordtime",
    "zeit", "uhrzeit", "datum", "zeitstempel", "temps", "tiempo", "tempo", "ticks",
    "thard", "timehard", "hardtime", "timea", "time1", "t1",
})  # fmt: skip
"""Names of a column of times, without blanks, underscores and units."""
SOFT_TIMES = frozenset({"tsoft", "timesoft", "softtime", "timeb", "time2", "t2"})
"""Names of the times of the soft channel, beside those of the hard channel."""
PAIRS = (("hard", "soft"), ("chard", "csoft"), ("hardbump", "softbump"), ("c1", "c2"), ("cin1", "cin2"),
         ("cap1", "cap2"), ("capacitance1", "capacitance2"))  # fmt: skip
"""Names of the hard and the soft channel. Others leave open which is which."""

_CHANNEL = re.compile("(?:c|cin|cap|capacitance|ch)[0-9]")
_BETWEEN = re.compile(r"[\s_./#:-]+")


def simple_name(name: str) -> str:
    """Return a name in lower case, without unit, blanks and underscores: 'C_1 (pF)' gives 'c1'.

    A name that is a unit of time stays: 'ms' is a name of a column of times.
    """
    return _BETWEEN.sub("", bare_name(name)) or name.strip().casefold()


def named(table: Table, names: Collection[str]) -> list[int]:
    """Return the columns (from 0) that have one of these names."""
    return [column for column in range(table.width) if any(simple_name(name) in names for name in table.names(column))]


def time_columns(table: Table) -> list[int]:
    """Return the columns (from 0) that have a name for times, of the table or of the hard channel.

    A capital T without a unit of time is a temperature.
    """
    found = named(table, TIMES | {unit.casefold() for unit in SECONDS})
    return [column for column in found if table.unit(column, SECONDS) in SECONDS or bare(table.name(column)) != "T"]


def named_channel(table: Table, column: int) -> bool:
    """Return whether a column has a name as C3, CIN3 or cap 3."""
    return any(_CHANNEL.fullmatch(simple_name(name)) for name in table.names(column))
