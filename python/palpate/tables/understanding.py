"""What the columns of a table mean: the times and capacitances of two channels."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.errors import RecordingError, quoted
from palpate.tables.asked import Asked
from palpate.tables.names import TIMES, named
from palpate.tables.numbers import numbers
from palpate.tables.table import Table
from palpate.tables.times import Times, times
from palpate.tables.units import PICOFARADS

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Channels:
    """Two channels of a table, and how it was understood.

    Attributes
    ----------
    t_hard_s, t_soft_s, hard, soft : numpy.ndarray, shape (n,)
        As those of `palpate.Recording`.
    said : str
        One line: which columns, which units, pairs a second, rows.
    notes : tuple of str
        What was left out or looks wrong.
    zero_utc_ns : int or None
    """

    t_hard_s: Array
    t_soft_s: Array
    hard: Array
    soft: Array
    said: str
    notes: tuple[str, ...]
    zero_utc_ns: int | None


def channels(table: Table, asked: Asked) -> Channels:
    """Return the two channels of a table.

    Raises
    ------
    RecordingError
        A cell is wrong: with its line and column.
    ValueError
        The table leaves the meaning open: the message has what fits, and the option that settles it.
    """
    wanted = dict(asked.columns or {})
    if table.width < 2:
        raise RecordingError(table.path, "not a recording: one column, two are needed", table.lines[0])
    if not wanted:
        raise ValueError(
            f"columns: got none for a table of another logger, allowed: hard and soft, two of {table.describe()}"
        )
    hard = _capacitance(table, wanted["hard"], asked)
    soft = _capacitance(table, wanted["soft"], asked)
    hard_times = _times(table, wanted.get("time"), asked)
    soft_times = _times(table, wanted["soft_time"], asked).since(hard_times) if "soft_time" in wanted else hard_times
    notes = _notes(table, hard_times.seconds, hard, soft)
    if asked.unit is None and not table.unit(table.column(wanted["hard"]), PICOFARADS):
        notes.append("no unit in the header: pF assumed")
    return Channels(hard_times.seconds, soft_times.seconds, hard, soft, "", tuple(notes), hard_times.zero_utc_ns)


def _capacitance(table: Table, wanted: str | int, asked: Asked) -> Array:
    column = table.column(wanted)
    named_unit = table.unit(column, PICOFARADS)
    if asked.unit is None and named_unit == "%":
        raise ValueError(
            f"column: got {quoted(wanted)}, which is in per cent, allowed: a capacitance; if it is one, give its unit"
        )
    values = numbers(table, column, asked.decimal)
    factor = PICOFARADS[asked.unit or named_unit or "pF"]
    return values if factor == 1.0 else values * factor


def _times(table: Table, wanted: str | int | None, asked: Asked) -> Times:
    if asked.rate is not None:
        return Times(np.arange(len(table)) / asked.rate, f"{asked.rate:g} pairs a second, as asked")
    if wanted is not None:
        return times(table, table.column(wanted), asked.time_unit, asked.decimal)
    found = named(table, TIMES)
    if not found:
        return Times(np.full(len(table), math.nan), "")
    return times(table, found[0], asked.time_unit, asked.decimal)


def _notes(table: Table, time_s: Array, hard: Array, soft: Array) -> list[str]:
    missing = int(np.count_nonzero(~(np.isfinite(hard) & np.isfinite(soft))))
    back = int(np.count_nonzero(np.diff(time_s) < 0))
    notes = {
        f"{missing} of {len(hard)} rows have no value in a channel: left out": missing,
        f"time goes back at {back} of {len(hard)} rows: the order of the file is used": back,
        "no column of times found: start_s is unknown": bool(len(time_s)) and bool(np.isnan(time_s).all()),
    }
    return [*(note for note, holds in notes.items() if holds), *table.notes]
