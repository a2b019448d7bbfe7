"""Reads recordings into memory: palpate's own files, and tables of other programs."""

import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from palpate.recording import sidecar
from palpate.recording.exchange.binary_data import BinaryData
from palpate.recording.foreign import AnyRecording, Foreign, recorded
from palpate.recording.own_file import Recorded
from palpate.recording.recording import Mark, Recording
from palpate.recording.session import plan_of
from palpate.samples import DTYPE, usable
from palpate.tables.readers.frames import Frame, frame


def read(
    source: str | os.PathLike[str] | Frame,
    *,
    columns: Mapping[str, str | int] | None = None,
    unit: str | None = None,
    time_unit: str | None = None,
    rate: float | None = None,
    decimal: str | None = None,
    soft: str | os.PathLike[str] | None = None,
    part: str | None = None,
) -> Recording:
    """Read a recording into memory.

    Parameters
    ----------
    source : path-like or data frame
        A recording of palpate, a table of another program, or the "Binary Data.txt" of Analog Devices' program; also
        packed as .gz. "-" is standard input. Or a frame of pandas or polars, an object with `__arrow_c_stream__`, a dict
        of arrays, or a structured array: columns of contiguous float64 are used as they are, without a copy.
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
        File of the soft channel, if `source` has the hard channel only.
    part : str, optional
        Name of the sheet of a workbook, or of the stream of an XDF file, if several have the two channels.

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
    given: dict[str, Any] = {"columns": columns, "unit": unit, "time_unit": time_unit, "rate": rate, "decimal": decimal}
    if not isinstance(source, str | os.PathLike):
        table = frame(source)
        return Foreign(table.path, table=table, **given, soft=soft, part=part).recording
    return in_memory(recorded(source, whole=True, **given, soft=soft, part=part))


def in_memory(source: AnyRecording) -> Recording:
    """Return the whole of a recording that was opened to be read in blocks."""
    return source.recording if isinstance(source, Foreign) else _whole(source)


def _whole(recorded: Recorded | BinaryData) -> Recording:
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
        plan=plan_of(recorded.document or {}),
    )
