"""Times of the rows of a table."""

from dataclasses import dataclass, field
from datetime import UTC, datetime, time

import numpy as np
from numpy.typing import NDArray

from palpate.errors import RecordingError, quoted
from palpate.tables.numbers import to_number
from palpate.tables.table import Table
from palpate.tables.units import SECONDS

_EPOCH = 1e9  # s; larger first times are dates (since 1970), not times since the start
_LATEST_S = 2**63 / 1e9


@dataclass(frozen=True)
class Times:
    """The times of the rows.

    Attributes
    ----------
    seconds : numpy.ndarray, shape (n,)
        Since the first row where the table has dates, else as in the table.
    said : str
        How the cells were understood, as in the line that a user reads: "ms", "dates", "times of day".
    zero_utc_ns : int or None
        UTC of second 0, ns since 1970; None: unknown.
    notes : list of str
    """

    seconds: NDArray[np.float64]
    said: str
    zero_utc_ns: int | None = None
    notes: list[str] = field(default_factory=list)


def times(table: Table, column: int, unit: str | None = None, decimal: str | None = None) -> Times:
    """Return the times in a column.

    Parameters
    ----------
    table : Table
    column : int
        From 0.
    unit : str, optional
        Unit of the numbers; default: that in the name of the column, else the only one that makes sense.
    decimal : str, optional
        As in `numbers`.

    Raises
    ------
    RecordingError
        A cell is neither a number nor a time: with its line and column.
    ValueError
        The cells leave the unit open; the message has what fits, and the option that settles it.
    """
    cells = table.columns[column].cells
    known = unit or table.unit(column, SECONDS) or "s"
    factor = SECONDS.get(known, 1.0)
    values = np.empty(len(cells))
    for row, cell in enumerate(cells):
        try:
            values[row] = _seconds(str(cell), factor)
        except ValueError:
            reason = f"{quoted(cell)} in column {column + 1} ({table.name(column)}) is neither a number nor a time"
            raise RecordingError(table.path, reason, table.lines[row]) from None
    values -= values[0] if values[0] > _EPOCH else 0.0
    if (np.abs(values) >= _LATEST_S).any():
        line = table.lines[int(np.argmax(np.abs(values) >= _LATEST_S))]
        raise RecordingError(
            table.path, "this time is more than 292 years after the first one: too large for 64-bit nanoseconds", line
        )
    return Times(values, known)


def _seconds(cell: str, factor: float) -> float:
    """Return seconds, from a number, a date with time, or a time of day."""
    try:
        return to_number(cell) * factor
    except ValueError:
        pass
    try:
        return datetime.fromisoformat(cell).replace(tzinfo=UTC).timestamp()
    except ValueError:
        of_day = time.fromisoformat(cell)
        return of_day.hour * 3600 + of_day.minute * 60 + of_day.second + of_day.microsecond * 1e-6
