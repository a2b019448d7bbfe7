"""Recordings of the two channels, from palpate's own files and from other loggers' tables."""

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palpate.ad7746 import CODES_PER_PF, FULL_SCALE_PF, SATURATED_CODES
from palpate.errors import RecordingError
from palpate.table import PICOFARADS, SECONDS, Table, bare_name, read_table, to_number

OWN_COLUMNS = {"hard": "hard_pF", "soft": "soft_pF", "time": "t_hard_s", "soft_time": "t_soft_s"}
_TIMES = {
    "time",
    "t",
    "timestamp",
    "time stamp",
    "timestamps",
    "seconds",
    "elapsed",
    "elapsed time",
    "date",
    "datetime",
}


@dataclass(frozen=True)
class Recording:
    """Both channels of a probe.

    Attributes
    ----------
    t_hard_s, t_soft_s : numpy.ndarray, shape (n,)
        Time of each channel's reading, s; nan where the file has no times, the same where it has one.
    hard, soft : numpy.ndarray, shape (n,)
        Capacitances, pF, baseline included; nan where the file has no value.
    notes : tuple of str
        What a reader of the results should know: rows without a value, a torn end, times that go back.
    full_scale_pF : float
        A reading of this size is saturated: the AD7746's in palpate's own files, inf elsewhere.
    """

    t_hard_s: NDArray[np.float64]
    t_soft_s: NDArray[np.float64]
    hard: NDArray[np.float64]
    soft: NDArray[np.float64]
    notes: tuple[str, ...] = ()
    full_scale_pF: float = math.inf


def read(
    path: str | os.PathLike[str],
    *,
    columns: Mapping[str, str | int] | None = None,
    unit: str | None = None,
) -> Recording:
    """Read a recording.

    Parameters
    ----------
    path : path-like
        A text table: comma, semicolon, tab, bar or blanks between the cells; any number of header rows.
    columns : mapping, optional
        Which columns hold "hard", "soft" and, where it is not found by its name, "time" (and
        "soft_time", where the soft channel has its own): a name in one of the header rows, or a
        position counted from 1. Not needed for palpate's own files.
    unit : str, optional
        Unit of both capacitances, aF to F. Taken from the header where it names one; pF otherwise.

    Returns
    -------
    Recording

    Raises
    ------
    RecordingError
        The file is not a recording: with the line and the reason.
    ValueError
        A column that is not there, or a unit that is not one of capacitance.

    Examples
    --------
    >>> recording = read("bench.csv", columns={"hard": 3, "soft": "Ch1"})  # doctest: +SKIP
    """
    wanted = dict(OWN_COLUMNS if columns is None else columns)
    for key in ("hard", "soft"):
        if key not in wanted:
            raise ValueError(f"columns: got {', '.join(wanted) or 'none'}, allowed: hard, soft and, if wanted, time")
    if unknown := set(wanted) - set(OWN_COLUMNS):
        raise ValueError(f"columns: got {min(unknown)!r}, allowed: {', '.join(OWN_COLUMNS)}")
    if unit is not None and unit not in PICOFARADS:
        raise ValueError(f"unit: got {unit!r}, allowed: {', '.join(PICOFARADS)}")
    table = read_table(Path(path))
    if columns is None:
        _require_own(table)
    hard = _capacitance(table, wanted["hard"], unit)
    soft = _capacitance(table, wanted["soft"], unit)
    t_hard_s = _times(table, wanted.get("time"))
    t_soft_s = _times(table, wanted["soft_time"]) if "soft_time" in wanted else t_hard_s
    full_scale = math.inf if columns is not None else FULL_SCALE_PF - SATURATED_CODES / CODES_PER_PF
    return Recording(t_hard_s, t_soft_s, hard, soft, tuple(_notes(table, t_hard_s, hard, soft)), full_scale)


def _require_own(table: Table) -> None:
    names = {name for column in range(table.width) for name in table.names(column)}
    if not names >= set(OWN_COLUMNS.values()):
        raise ValueError(
            f"columns: got none for a table that is not palpate's own, allowed: hard and soft out of {table.describe()}"
        )


def _capacitance(table: Table, wanted: str | int, unit: str | None) -> NDArray[np.float64]:
    column = table.column(wanted)
    named = table.unit(column, PICOFARADS)
    if unit is None and named == "%":
        raise ValueError(f"column: got {wanted!r}, which is in per cent, allowed: a capacitance (or state its unit)")
    factor = PICOFARADS[unit or named or "pF"]
    values = np.empty(len(table.rows))
    for row, (line, _) in enumerate(table.rows):
        cell = table.cell(row, column)
        try:
            values[row] = to_number(cell)
        except ValueError:
            reason = f"{cell!r} in column {column + 1} ({wanted}) is neither a number nor an overload mark"
            raise RecordingError(table.path, reason, line) from None
    return values * factor


def _times(table: Table, wanted: str | int | None) -> NDArray[np.float64]:
    column = _time_column(table) if wanted is None else table.column(wanted)
    if column is None:
        return np.full(len(table.rows), math.nan)
    factor = SECONDS.get(table.unit(column, SECONDS) or "s", 1.0)
    first: datetime | None = None
    values = np.empty(len(table.rows))
    for row, (line, _) in enumerate(table.rows):
        cell = table.cell(row, column)
        try:
            values[row] = to_number(cell) * factor
        except ValueError:
            try:
                moment = datetime.fromisoformat(cell)
                first = first or moment
                values[row] = (moment - first).total_seconds()
            except (ValueError, TypeError) as error:
                reason = f"{cell!r} in column {column + 1} is neither a number nor a date and time"
                raise RecordingError(table.path, reason, line) from error
    return values


def _time_column(table: Table) -> int | None:
    for column in range(table.width):
        if _TIMES & {bare_name(name) for name in table.names(column)}:
            return column
    return None


def _notes(
    table: Table, time_s: NDArray[np.float64], hard: NDArray[np.float64], soft: NDArray[np.float64]
) -> list[str]:
    missing = int(np.count_nonzero(~(np.isfinite(hard) & np.isfinite(soft))))
    back = int(np.count_nonzero(np.diff(time_s) < 0))
    notes = {
        f"{missing} of {len(hard)} rows have no value in a channel: left out": missing,
        f"time goes back at {back} of {len(hard)} rows: they are taken in the order of the file": back,
        "the last row is torn: left out": table.torn,
    }
    return [note for note, holds in notes.items() if holds]
