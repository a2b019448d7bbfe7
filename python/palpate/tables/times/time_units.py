"""The unit of times that are numbers: by their name, as dates by their size, or by their pace."""

import math
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.errors import shortened
from palpate.tables.table import Table
from palpate.tables.times.steps import coarse, median_step, typical_step
from palpate.tables.units import SECONDS, bare_name

CANDIDATES = ("s", "ms", "us", "ns", "d")
"""Units that are found without a name."""

_WORDS = {
    "s": "second seconds secs sekunde sekunden",
    "ms": "msec msecs milli millis millisecond milliseconds millisekunden",
    "us": "usec usecs micro micros microsecond microseconds mikrosekunden",
    "ns": "nsec nsecs nanos nanosecond nanoseconds",
    "min": "minute minutes minuten",
    "d": "day days tage",
}
_UNITS = {word: unit for unit, words in _WORDS.items() for word in words.split()} | {"lsl_timestamp": "s"}
_LAST_WORD = re.compile(r"([A-Za-z]{1,16})[)\]]?$")

GUESSED = (9.9, 499.0)  # pairs a second, of a unit that nobody named; hundredths of a second look like 500
_SURE = (4.0, 1000.0)  # of one unit only
LIKELY = (2.0, 2000.0)
POSSIBLE = (0.2, 20_000.0)
LONGEST_S = 10 * 365.25 * 86400  # a logger that counts from its start

_DAY_NS = 86_400_000_000_000


@dataclass(frozen=True)
class Epoch:
    """A way to count dates: the unit, the first and last number that are taken for a date, and where 1970 is."""

    unit: str
    first: float
    last: float
    zero_1970: int
    said: str
    utc: bool = True


_EPOCHS = (
    Epoch("s", 946_684_800, 3_155_760_000, 0, "s since 1970"),  # 2000 to 2070, also below
    Epoch("ms", 946_684_800e3, 3_155_760_000e3, 0, "ms since 1970"),
    Epoch("us", 946_684_800e6, 3_155_760_000e6, 0, "us since 1970"),
    Epoch("ns", 946_684_800e9, 3_155_760_000e9, 0, "ns since 1970"),
    Epoch("s", 3_281_990_400, 5_238_604_800, 2_082_844_800, "s since 1904"),  # from 2008, the end of the first
    Epoch("d", 36_526, 73_050, 25_569, "Excel days", utc=False),
    Epoch("d", 730_486, 767_011, 719_529, "MATLAB days", utc=False),
)


@dataclass(frozen=True)
class TimeUnit:
    """The unit of a column of times, how it was found, and the way to count dates if they are dates."""

    unit: str
    said: str
    epoch: Epoch | None = None

    def seconds(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return times in this unit as seconds."""
        factor = SECONDS[self.unit]
        return values / round(1 / factor) if factor < 1 else values * factor if factor > 1 else values

    def since_ns(self, values: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return ns since the first one, so that equal dates of any files are equal: of whole numbers and the rest apart."""
        ns = round(SECONDS[self.unit] * 1e9)
        whole = np.trunc(values)
        rest = np.rint((values - whole) * ns).astype(np.int64)
        found: NDArray[np.int64] = (whole - whole[0]).astype(np.int64) * ns + rest - rest[0]
        return found

    def date_ns(self, value: float) -> int:
        """Return a date in this unit, ns since 1970."""
        if self.epoch is None:
            raise ValueError("date_ns: got times since a start, allowed: dates")
        ns = round(SECONDS[self.unit] * 1e9)
        whole = int(value)
        return (whole - self.epoch.zero_1970) * ns + round(float(value - whole) * ns)


def time_unit(table: Table, column: int, values: NDArray[np.float64], asked: str | None) -> TimeUnit:
    """Return the unit of the times in a column.

    Parameters
    ----------
    table : Table
    column : int
        From 0.
    values : numpy.ndarray, shape (n,)
        Finite.
    asked : str, optional
        Unit that the user gave.

    Raises
    ------
    ValueError
        The unit is open, or the name and the pace contradict each other: with the pairs a second of each unit.
    """
    step = typical_step(values)
    rates = {unit: 1 / (step * SECONDS[unit]) for unit in SECONDS} if step else {}
    named = asked or named_unit(table, column)
    if named:
        if not asked and rates:
            _require_no_better(table, column, named, values, rates)
        epoch = _epoch(values, (named,), {})
        return TimeUnit(named, epoch.said if epoch else named, epoch)
    epoch = _epoch(values, CANDIDATES, rates)
    if epoch:
        return TimeUnit(epoch.unit, epoch.said, epoch)
    if not rates:
        return TimeUnit("s", "s")  # one row, or one stamp: no unit changes anything
    sure = _sure(values, rates, GUESSED)
    if len(sure) != 1:
        raise ValueError(f"time_unit: got a median step of {step:.3g} in {_place(table, column)}: {_fits(rates)}")
    return TimeUnit(sure[0], f"{sure[0]} (by its steps)")


def named_unit(table: Table, column: int) -> str | None:
    """Return the unit in the names of a column, or that of the format."""
    unit = table.unit(column, SECONDS)
    if unit in SECONDS:
        return unit
    for name in reversed(table.names(column)):
        word = _LAST_WORD.search(name)
        found = _UNITS.get(bare_name(name)) or (_UNITS.get(word[1].lower()) if word else None)
        if found:
            return found
    return None


def _epoch(values: NDArray[np.float64], units: tuple[str, ...], rates: dict[str, float]) -> Epoch | None:
    """Return the way to count dates of which the first value and the pace make sense."""
    first = float(values[0])
    for epoch in _EPOCHS:
        paced = not rates or _within(rates[epoch.unit], POSSIBLE if epoch.utc else LIKELY)
        if paced and epoch.unit in units and epoch.first <= first < epoch.last:
            return epoch
    return None


def _sure(values: NDArray[np.float64], rates: dict[str, float], limits: tuple[float, float]) -> list[str]:
    """Return the units in which the pace is surely that of a tactile probe, by the windows and by the single steps."""
    size = max(abs(float(values[0])), abs(float(values[-1])))
    single = 0.0 if coarse(values) else median_step(values)
    return [
        unit
        for unit in CANDIDATES
        if limits[0] < rates[unit] < limits[1]
        and (not single or _within(1 / (single * SECONDS[unit]), LIKELY))
        and size * SECONDS[unit] < LONGEST_S
    ]


def _within(rate: float, limits: tuple[float, float]) -> bool:
    return limits[0] <= rate <= limits[1]


def _require_no_better(
    table: Table, column: int, named: str, values: NDArray[np.float64], rates: dict[str, float]
) -> None:
    if not _within(rates[named], POSSIBLE) and (sure := _sure(values, rates, _SURE)):
        raise ValueError(
            f"time_unit: got {named} in the name of {_place(table, column)}, but a median step of {typical_step(values):.3g}: "
            f"{_rate(rates[named])} if {named}, {_rate(rates[sure[0]])} if {sure[0]}; "
            f"allowed: time_unit {named} or {sure[0]} (--time-unit)"
        )


def _fits(rates: dict[str, float]) -> str:
    """Return the pairs a second of the two units in which they are nearest to those of a tactile probe."""
    middle = math.sqrt(_SURE[0] * _SURE[1])
    nearest = sorted(CANDIDATES, key=lambda unit: abs(math.log(rates[unit] / middle)))[:2]
    one, other = sorted(nearest, key=CANDIDATES.index)
    return (
        f"{_rate(rates[one])} if {one}, {_rate(rates[other])} if {other}; "
        f"allowed: time_unit {one} or {other}, or another (--time-unit)"
    )


def _rate(rate: float) -> str:
    shown = f"{rate:,.0f}" if rate >= 10 else f"{rate:.2g}"
    return f"{shown} pair{'' if shown == '1' else 's'} a second"


def _place(table: Table, column: int) -> str:
    return f"column {column + 1} ({shortened(table.name(column))})"
