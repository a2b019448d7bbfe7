"""Which columns a message proposes, where it is open which are the two channels."""

import re

import numpy as np

from palpate.errors import quoted
from palpate.tables.cell.kinds import NUMBER, kind
from palpate.tables.long import id_column, spread
from palpate.tables.names import time_columns
from palpate.tables.table import Table
from palpate.tables.units import PICOFARADS, bare_name, no_capacitance

_CHANNEL = re.compile(r"hard|hart|dure|soft|weich|souple|cap|kap|^c(in|h)?[ _]?\d|^cp|chan|kanal|voie")
_SOFT = re.compile(r"soft|weich|souple")
_NONE = re.compile(
    r"^(no\.?|nr\.?|n|#|index|idx|i|id|row|count|counter|seq|sample|rh|t|d)$|temp|hum|stat|flag|err|force|press|batt|filt"
)
_SAMPLE = 50  # cells


def proposed(table: Table) -> str:
    """Return what may be meant, as the end of a message: an example of options, or nothing."""
    names = id_column(table)
    if names is not None:
        return _example([(name, name) for name in sorted(spread(table, names)) if name])
    values = values_of(table)
    if len(values) == 1:
        return f"; only {table.name(values[0])} can be a channel: is the soft one in a file of its own? --soft FILE"
    rising = [] if any(map(table.names, range(table.width))) else [c for c in range(table.width) if _rises(table, c)]
    time = f",time={rising[-1] + 1}" if rising else ""
    return _example([(str(column + 1), table.name(column)) for column in values], time)


def values_of(table: Table, other: frozenset[int] | set[int] = frozenset()) -> list[int]:
    """Return the columns (from 0) that can be channels, none of `other`: those in a unit of capacitance, if there are some.

    Else those with names of channels; else all numbers but counters, temperatures and the like.
    """
    taken = {*time_columns(table), *other}
    free = [column for column in range(table.width) if column not in taken and _is_numeric(table, column)]
    names = {column: bare_name(table.name(column)) if table.names(column) else "" for column in free}
    free = [column for column in free if not _NONE.search(names[column]) and not _rises(table, column)]
    units = [column for column in free if table.unit(column, PICOFARADS) in PICOFARADS]
    named = [column for column in free if _CHANNEL.search(names[column])]
    found = next((each for each in (units, named) if len(each) > 1), free)
    fitting = [column for column in found if no_capacitance(table.name(column)) is None]
    return fitting if len(fitting) > 1 else found


def _example(channels: list[tuple[str, str]], time: str = "") -> str:
    """Return the options for channels, each as it is asked for and its name."""
    if len(channels) < 2:
        return ""
    soft = next((asked for asked, name in channels if _SOFT.search(name.casefold())), None)
    others = [asked for asked, _ in channels if asked != soft]
    option = f"hard={others[0]},soft={soft or others[1]}{time}"
    return f", as in --map {quoted(option) if ' ' in option else option}"


def _sample(table: Table, column: int) -> list[str]:
    middle = len(table) // 2
    return [str(cell) for cell in table.columns[column].cells[middle : middle + _SAMPLE] if cell is not None]


def _is_numeric(table: Table, column: int) -> bool:
    if table.columns[column].kind != "T":
        return table.columns[column].kind in "fiu"
    return any(kind(cell) == NUMBER for cell in _sample(table, column))


def _rises(table: Table, column: int) -> bool:
    """Return whether the numbers in the middle rise in even steps: a counter, or times."""
    sample = _sample(table, column)
    if len(sample) < 2 or not all(map(_is_plain, sample)):
        return False
    steps = np.diff(np.array([float(cell) for cell in sample]))
    return bool(np.all(steps > 0) and np.ptp(steps) <= np.mean(steps) / 2)


def _is_plain(cell: str) -> bool:
    return re.fullmatch(r"[+-]?\d+(\.\d*)?(e[+-]?\d+)?", cell, re.IGNORECASE) is not None
