"""Reads recordings into memory: palpate's own files, and tables of other programs."""

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from palpate.ad7746.datasheet import SATURATED_PF
from palpate.recording.columns_in import own_recording
from palpate.recording.own_file import Recorded
from palpate.recording.recording import Recording
from palpate.samples import DTYPE, usable
from palpate.tables.asked import Asked
from palpate.tables.formats import read_table
from palpate.tables.table import Table
from palpate.tables.understanding import channels

OWN_COLUMNS = {"hard": "hard_pF", "soft": "soft_pF", "time": "t_hard_s", "soft_time": "t_soft_s"}
AS_TABLE = (
    "a recording of palpate, read as a table of another logger: its rows are not verified, its status, codes and tares not "
    "used; leave out --map and --unit"
)
"""Note of a recording that is read with `columns` or `unit`."""


def read(
    path: str | os.PathLike[str],
    *,
    columns: Mapping[str, str | int] | None = None,
    unit: str | None = None,
    time_unit: str | None = None,
    rate: float | None = None,
    decimal: str | None = None,
    soft: str | os.PathLike[str] | None = None,
) -> Recording:
    """Read a recording into memory.

    Parameters
    ----------
    path : path-like
        A recording of palpate, or a table of another program.
    columns : mapping, optional
        Columns of "hard", "soft" and, if it is not found by its name, "time"; also "soft_time", if the soft channel
        has its own times. A column is a name in one of the header rows, or a position counted from 1. Not needed for
        palpate's own files.
    unit : str, optional
        Unit of both capacitances, aF to F. Default: the unit in the header, else pF.
    time_unit : str, optional
        Unit of the times, ns to d. Default: the unit in the header, else the one that makes sense.
    rate : float, optional
        Pairs a second, for a table without usable times.
    decimal : str, optional
        Decimal mark, "point" or "comma", where the numbers leave it open.
    soft : path-like, optional
        File of the soft channel, if `path` has the hard channel only.

    Returns
    -------
    Recording

    Raises
    ------
    RecordingError
        The file is not a recording: with the line and the reason.
    ValueError
        A column does not exist, a unit is not known, or the file leaves its meaning open: with what settles it.

    Examples
    --------
    >>> recording = read("bench.csv", columns={"hard": 3, "soft": "Ch1"})  # doctest: +SKIP
    """
    asked = Asked(columns, unit, time_unit, rate, decimal, None if soft is None else Path(soft))
    if not isinstance(path, str | os.PathLike):
        return own_frame(path, asked) or _foreign(frame(path), asked, own=False)
    own = own_recording(Path(path))
    if own and not asked.given:
        return _own(own)
    return _foreign(read_table(Path(path)), asked, own=own is not None)


def _foreign(table: Table, asked: Asked, *, own: bool) -> Recording:
    columns = asked.columns
    like_own = {name for column in range(table.width) for name in table.names(column)} >= set(OWN_COLUMNS.values())
    if like_own and not {"time", "soft_time"} & set(columns or {}):
        asked = asked.with_columns({**OWN_COLUMNS, **(columns or {})})
    found = channels(table, asked)
    return Recording(
        found.t_hard_s,
        found.t_soft_s,
        found.hard,
        found.soft,
        notes=(*found.notes, *([AS_TABLE] if own else [])),
        full_scale_pF=SATURATED_PF if columns is None and like_own else np.inf,
        zero_utc_ns=found.zero_utc_ns,
        understood=found.said,
    )


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
    )
