"""One required result: its value, its limit, and what is printed beside it."""

import math
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """A required result.

    Attributes
    ----------
    name : str
    value, limit : float
        In `unit`.
    unit : str
    at_least : bool
        The limit is a lower one.
    coverage : float, in [0, 1]
        Share of the nominal 95 % intervals without a flag that hold the truth; nan if there were none.
    intervals : int
        Their number.
    efficiency : float
        Fisher bound / value; nan where there is no bound.
    beside : str
        More about the value, as text.
    """

    name: str
    value: float
    limit: float
    unit: str = "%"
    at_least: bool = False
    coverage: float = math.nan
    intervals: int = 0
    efficiency: float = math.nan
    beside: str = ""

    @property
    def holds(self) -> bool:
        """Whether the value keeps its limit."""
        return self.value >= self.limit if self.at_least else self.value <= self.limit


HEADER = f"{'':6}{'':64}{'value':>9}  {'limit':>15}  {'efficiency':>10}  {'cover':>7}"


def line(row: Row) -> str:
    """Return a row as text.

    Examples
    --------
    >>> line(Row("error", 0.0123, 0.02)).split()
    ['holds', 'error', '0.0123', 'at', 'most', '0.02', '%', '-', '-']
    """
    limit = f"{'at least' if row.at_least else 'at most'} {row.limit:.4g} {row.unit}"
    efficiency = "-" if math.isnan(row.efficiency) else f"{row.efficiency:.2f}"
    cover = "-" if math.isnan(row.coverage) else f"{100 * row.coverage:.1f} %"
    text = f"{row.name:64}{row.value:>9.3g}  {limit:>18}  {efficiency:>10}  {cover:>7}  {row.beside}"
    return f"{'holds' if row.holds else 'FAILS'} {text}".rstrip()


def covered(rows: Iterable[Row], enough: int = 20) -> Row:
    """Return the row of the lowest coverage among rows with enough intervals."""
    counted = [row for row in rows if row.intervals >= enough]
    worst = min(counted, key=lambda row: row.coverage, default=Row("no row", math.nan, 0.0))
    name = f"95 % intervals without a flag, lowest of {len(counted)} rows"
    return Row(name, 100 * worst.coverage, 90.0, at_least=True, beside=worst.name)
