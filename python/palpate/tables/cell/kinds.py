"""What the cells of a row are: numbers, times, text, or nothing."""

from collections.abc import Sequence
from functools import lru_cache

from palpate.tables.cell.clock_layout import is_time
from palpate.tables.cell.decimals import is_plain, written
from palpate.tables.cell.numbers import NO_VALUE, UNITS
from palpate.tables.units import unit_in

NUMBER, TIME, NONE, TEXT = "number", "time", "none", "text"


@lru_cache(maxsize=1024)
def kind(cell: str) -> str:
    """Return whether a cell is a number, a time (or date), no value, or text.

    Examples
    --------
    >>> [kind(cell) for cell in ("6.123 pF", "12:00:00.5", "OL", "6.1x3")]
    ['number', 'time', 'none', 'text']
    """
    if is_plain(cell):
        return NUMBER
    if cell.upper() in NO_VALUE:
        return NONE
    number = written(cell)
    if number and (not number.unit or number.unit == "%" or unit_in(number.unit, UNITS)):
        return NUMBER
    return TIME if is_time(cell) else TEXT


def signature(cells: Sequence[str]) -> tuple[bool, ...]:
    """Return of each cell whether it is a number or a time, up to the last one that is; none if none is a number."""
    kinds = [kind(cell) for cell in cells]
    if NUMBER not in kinds:
        return ()
    values = [of_cell in (NUMBER, TIME) for of_cell in kinds]
    return tuple(values[: len(values) - values[::-1].index(True)])


def fits(cells: Sequence[str], pattern: Sequence[bool]) -> bool:
    """Return whether a row has a number, a time or no value wherever the pattern has a value, and a number among them."""
    if len(cells) < len(pattern):
        return False
    kinds = {kind(cell) for cell, value in zip(cells, pattern, strict=False) if value}
    return TEXT not in kinds and NUMBER in kinds


def has_value(cells: Sequence[str]) -> bool:
    """Return whether a number or a time is among the cells."""
    return any(kind(cell) in (NUMBER, TIME) for cell in cells)
