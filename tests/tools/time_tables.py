"""Tables of one column of times, and their rows."""

from collections.abc import Sequence
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

from palpate.tables.table import Column, Table
from palpate.tables.times.times import Times, times

BEGUN = datetime(2026, 11, 21, 23, 59, 58)
STEP_US = 26_041
ROWS = 200


def column(cells: Any, name: str = "time", unit: str = "") -> Table:
    """Return a table with one column; its first row is in line 2."""
    return Table(Path("table.csv"), [Column((name,) if name else (), cells, unit)], range(2, 2 + len(cells)))


def read_times(cells: Any, name: str = "time", unit: str | None = None) -> Times:
    return times(column(cells, name), 0, unit)


def moments(rows: int = ROWS, begun: datetime = BEGUN) -> list[datetime]:
    """Return 38.4 rows a second; those of the default begin two seconds before midnight."""
    return [begun + timedelta(microseconds=STEP_US * row) for row in range(rows)]


def texts(form: str, rows: Sequence[datetime] | None = None) -> list[str]:
    """Return moments as text; %3 is milliseconds, %f microseconds."""
    rows = rows if rows is not None else moments()
    return [row.strftime(form.replace("%3", f"{row.microsecond // 1000:03d}")) for row in rows]
