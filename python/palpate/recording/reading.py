"""Reads recordings into memory: palpate's own files, and tables of other loggers."""

import math
import os
from collections.abc import Mapping
from datetime import UTC, datetime, time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palpate.ad7746.datasheet import SATURATED_PF
from palpate.errors import RecordingError, listed, quoted, shortened
from palpate.recording import sidecar
from palpate.recording.own_file import Recorded, is_own
from palpate.recording.recording import Mark, Recording
from palpate.recording.table import PICOFARADS, SECONDS, Table, bare_name, is_data, read_table, to_number
from palpate.samples import DTYPE, usable

OWN_COLUMNS = {"hard": "hard_pF", "soft": "soft_pF", "time": "t_hard_s", "soft_time": "t_soft_s"}
AS_TABLE = (
    "a recording of palpate, read as a table of another logger: its rows are not verified, its status, codes and tares not "
    "used; leave out --map and --unit"
)
"""Note of a recording that is read with `columns` or `unit`."""
_TIMES = {"time", "t", "t_hard", "timestamp", "time stamp", "timestamps", "seconds", "elapsed", "elapsed time", "zeit"}
_TIMES |= {"date", "datetime", "clock"}


def read(
    path: str | os.PathLike[str],
    *,
    columns: Mapping[str, str | int] | None = None,
    unit: str | None = None,
) -> Recording:
    """Read a recording into memory.

    Parameters
    ----------
    path : path-like
        A text table: cells separated by comma, semicolon, tab, | or blanks; any number of header rows.
    columns : mapping, optional
        Columns of "hard", "soft" and, if it is not found by its name, "time"; also "soft_time", if the soft channel
        has its own times. A column is a name in one of the header rows, or a position counted from 1. Not needed for
        palpate's own files.
    unit : str, optional
        Unit of both capacitances, aF to F. Default: the unit in the header, else pF.

    Returns
    -------
    Recording

    Raises
    ------
    RecordingError
        The file is not a recording: with the line and the reason.
    ValueError
        The column does not exist, or the unit is not a unit of capacitance.

    Examples
    --------
    >>> recording = read("bench.csv", columns={"hard": 3, "soft": "Ch1"})  # doctest: +SKIP
    """
    wanted = dict(OWN_COLUMNS if columns is None else columns)
    _check(wanted, unit)
    recorded = is_own(Path(path))
    if recorded and columns is None and unit is None:
        return _own(Recorded(path))
    table = read_table(Path(path))
    own = {name for column in range(table.width) for name in table.names(column)} >= set(OWN_COLUMNS.values())
    if table.width < 2:
        raise RecordingError(table.path, "not a recording: one column, two are needed", table.rows[0][0])
    if columns is None and not own:
        raise ValueError(
            f"columns: got none for a table of another logger, allowed: hard and soft, two of {table.describe()}"
        )
    if own and not {"time", "soft_time"} & set(wanted):
        wanted |= {key: OWN_COLUMNS[key] for key in ("time", "soft_time")}
    hard = _capacitance(table, wanted["hard"], unit)
    soft = _capacitance(table, wanted["soft"], unit)
    t_hard_s = _times(table, wanted.get("time"))
    t_soft_s = _times(table, wanted["soft_time"]) if "soft_time" in wanted else t_hard_s
    notes = _notes(table, t_hard_s, hard, soft)
    if recorded:
        notes.append(AS_TABLE)
    if unit is None and not table.unit(table.column(wanted["hard"]), PICOFARADS):
        notes.append("no unit in the header: pF assumed")
    full_scale = SATURATED_PF if columns is None else math.inf
    return Recording(t_hard_s, t_soft_s, hard, soft, tuple(notes), full_scale)


def _own(recorded: Recorded) -> Recording:
    block = np.concatenate([np.zeros(0, DTYPE), *recorded.blocks()])
    times = (block["t_hard_ns"] / 1e9, block["t_soft_ns"] / 1e9)
    last = np.flatnonzero(np.isin(block["seq"][:-1], [seq for seq, _ in recorded.gap_marks]))
    return Recording(
        *times,
        *usable(block, recorded.full_scale_pF),
        notes=recorded.notes,
        full_scale_pF=recorded.full_scale_pF,
        host_stamps=recorded.host_stamps,
        doubts=recorded.doubts,
        gap_rows=tuple((last + 1).tolist()),
        zero_utc_ns=recorded.zero_utc_ns,
        marks=tuple(Mark(*mark) for mark in sidecar.marks_of(recorded.document or {})),
    )


def _check(wanted: Mapping[str, str | int], unit: str | None) -> None:
    for key in ("hard", "soft"):
        if key not in wanted:
            raise ValueError(f"columns: got {listed(wanted) or 'none'}, allowed: hard, soft and, if wanted, time")
    if unknown := set(wanted) - set(OWN_COLUMNS):
        raise ValueError(f"columns: got {quoted(min(unknown))}, allowed: {', '.join(OWN_COLUMNS)}")
    if str(wanted["hard"]).strip() == str(wanted["soft"]).strip():
        raise ValueError(f"columns: got {quoted(wanted['hard'])} for both channels, allowed: two columns")
    if unit is not None and unit not in PICOFARADS:
        raise ValueError(f"unit: got {quoted(unit)}, allowed: {', '.join(PICOFARADS)}")


def _capacitance(table: Table, wanted: str | int, unit: str | None) -> NDArray[np.float64]:
    column = table.column(wanted)
    named = table.unit(column, PICOFARADS)
    if unit is None and named == "%":
        raise ValueError(
            f"column: got {quoted(wanted)}, which is in per cent, allowed: a capacitance; if it is one, give its unit"
        )
    factor = PICOFARADS[unit or named or "pF"]
    values = np.empty(len(table.rows))
    for row, (line, _) in enumerate(table.rows):
        cell = table.cell(row, column)
        try:
            values[row] = to_number(cell)
        except ValueError:
            reason = f"{quoted(cell)} in column {column + 1} ({shortened(str(wanted))}) is neither a number nor an overload mark"
            raise RecordingError(table.path, reason, line) from None
    return values * factor


def _times(table: Table, wanted: str | int | None) -> NDArray[np.float64]:
    column = time_column(table) if wanted is None else table.column(wanted)
    if column is None:
        return np.full(len(table.rows), math.nan)
    factor = SECONDS.get(table.unit(column, SECONDS) or "s", 1.0)
    values = np.empty(len(table.rows))
    for row, (line, _) in enumerate(table.rows):
        cell = table.cell(row, column)
        try:
            values[row] = _seconds(cell, factor)
        except ValueError:
            if wanted is None:
                return np.full(len(table.rows), math.nan)
            reason = f"{quoted(cell)} in column {column + 1} ({shortened(str(wanted))}) is neither a number nor a time"
            raise RecordingError(table.path, reason, line) from None
    values -= values[0] if values[0] > _EPOCH else 0.0
    if (np.abs(values) >= _LATEST_S).any():
        line = table.rows[int(np.argmax(np.abs(values) >= _LATEST_S))][0]
        raise RecordingError(
            table.path, "this time is more than 292 years after the first one: too large for 64-bit nanoseconds", line
        )
    return values


_EPOCH = 1e9  # s; larger first times are dates (since 1970), not times since the start
_LATEST_S = 2**63 / 1e9


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


def time_column(table: Table) -> int | None:
    """Return the column (from 0) with a name for times; None without one."""
    for column in range(table.width):
        if _TIMES & {bare_name(name) for name in table.names(column)}:
            return column
    return None


def _notes(
    table: Table, time_s: NDArray[np.float64], hard: NDArray[np.float64], soft: NDArray[np.float64]
) -> list[str]:
    missing = int(np.count_nonzero(~(np.isfinite(hard) & np.isfinite(soft))))
    above = sum(is_data(cells) for cells in table.header)
    back = int(np.count_nonzero(np.diff(time_s) < 0))
    notes = {
        f"{missing} of {len(hard)} rows have no value in a channel: left out": missing,
        f"time goes back at {back} of {len(hard)} rows: the order of the file is used": back,
        f"{above} rows of numbers are above the column names: treated as part of the header": above,
        "the last row is incomplete (no line end): left out": table.torn,
        "no column of times found: start_s is unknown": bool(len(time_s)) and bool(np.isnan(time_s).all()),
    }
    return [note for note, holds in notes.items() if holds]
