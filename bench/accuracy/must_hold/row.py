"""One required result: its value, its limit, and what is printed beside it."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any


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
    reason : str
        Why the limit cannot be kept, a sentence; empty where it has to be.
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
    reason: str = ""

    @property
    def holds(self) -> bool:
        """Whether the value keeps its limit."""
        return bool(self.value >= self.limit if self.at_least else self.value <= self.limit)

    @property
    def verdict(self) -> str:
        """Whether it "holds", is "known" not to, with a reason, or "FAILS"."""
        return "holds" if self.holds else "known" if self.reason else "FAILS"


HEADER = f"{'':6}{'':66}{'value':>9}  {'limit':>18}  {'bound / rmse':>12}  {'cover':>7}"


def line(row: Row) -> str:
    """Return a row as text; a limit that is not kept for a known reason has this reason below.

    Examples
    --------
    >>> line(Row("error", 0.0123, 0.02)).split()
    ['holds', 'error', '0.0123', 'at', 'most', '0.02', '%', '-', '-']
    """
    limit = f"{'at least' if row.at_least else 'at most'} {row.limit:.4g} {row.unit}"
    efficiency = "-" if math.isnan(row.efficiency) else f"{row.efficiency:.2f}"
    cover = "-" if math.isnan(row.coverage) else f"{100 * row.coverage:.1f} %"
    text = f"{row.name:66}{row.value:>9.3g}  {limit:>18}  {efficiency:>12}  {cover:>7}  {row.beside}"
    reason = f"\n{'':6}{row.reason}" if row.verdict == "known" else ""
    return f"{row.verdict} {text}".rstrip() + reason


def between(name: str, coverage: float, low: float, high: float, **more: Any) -> Iterator[Row]:
    """Return the two rows of a coverage with a lower and an upper limit, %."""
    for limit, at_least in ((low, True), (high, False)):
        yield Row(name, 100 * coverage, limit, at_least=at_least, **more)


def covered(theme: str, rows: Iterable[Row], enough: int = 20) -> Row:
    """Return the row of the lowest coverage among rows with enough intervals."""
    counted = [row for row in rows if row.intervals >= enough]
    worst = min(
        counted, key=lambda row: row.coverage, default=Row("none with intervals enough", math.inf, 0.0, coverage=1.0)
    )
    name = f"{theme}: lowest coverage of 95 % intervals without a flag"
    return Row(name, 100 * worst.coverage, 90.0, at_least=True, beside=f"{worst.name}; {len(counted)} rows")
