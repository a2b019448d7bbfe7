"""Reads any recording: one of palpate, or a table of another program."""

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.dataframe import Frame
from palpate.errors import RecordingError
from palpate.files import Json
from palpate.importers.table import OptionError, ReadOptions, Table
from palpate.importers.units import unit_read
from palpate.recording.convert import own_recording
from palpate.recording.counts import Survey
from palpate.recording.csv_reader import (
    RecordingFile,
    has_wrong_name,
    header_damage,
    is_own,
)
from palpate.recording.opened import GapMark, OpenedRecording
from palpate.recording.recording import Recording
from palpate.samples import UNTIMED_NS, Block, blank

_GAP = "as a column of the table says"
_ROWS = 1 << 16  # of a block
AS_TABLE = (
    "a recording of palpate, read as a table of another program: its rows are not verified, "
    "its status, codes, tares, gaps and range not used"
)
"""Note of a recording that is read with `columns`, `unit` or the like, or without its file."""


class ImportedRecording(OpenedRecording):
    """A recording of another program, read into memory; see `OpenedRecording` for the other attributes.

    Parameters
    ----------
    path : pathlib.Path
    recording : Recording
    unused : list of str
        Names, or positions from 1, of the columns that are not in the recording.
    """

    def __init__(self, path: Path, recording: Recording, unused: Sequence[str] = ()) -> None:
        super().__init__(path)
        self._recording = recording
        self.unused = list(unused)
        self.full_scale_pF = recording.full_scale_pF
        self.unit = recording.unit
        self.host_stamps = recording.host_stamps
        self.period_s = recording.period_s
        self.zero_utc_ns = recording.zero_utc_ns
        self.timed = recording.timed
        self.understood = recording.understood
        self.gap_marks = [GapMark(row - 1, _GAP) for row in recording.gap_rows]
        self.tares = frozenset(mark.seq for mark in self.gap_marks)

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on the data; complete after `blocks()`."""
        notes = self._recording.notes
        if self.timed and self.survey.pause_note:
            notes += (self.survey.pause_note,)
        return notes

    @property
    def doubts(self) -> tuple[str, ...]:
        """Return nothing: doubts about a table are in `notes`."""
        return ()

    def skip_damage(self) -> None:
        """Do nothing: a damaged table is refused when it is read."""

    def in_memory(self) -> Recording:
        """Return the recording in memory."""
        return self._recording

    def describe(self) -> Json:
        """Return the known properties of the instrument."""
        known: Json = {
            "name": "table of another program",
            "file": self.path.name,
            "full_scale_pF": self.full_scale_pF,
        }
        if self.unit != "pF":
            known["unit"] = self.unit
        if self.period_s:
            known["period_s"] = self.period_s
        if self.host_stamps:
            known["stamps"] = "host"
        return known

    def blocks(self) -> Iterator[Block]:
        """Yield all samples in parts; without times, pairs are `UNTIMED_NS` apart."""
        self.survey = Survey(marked=self.tares)
        recording = self._recording
        rows = len(recording)
        edges = sorted({*range(0, rows, _ROWS), *recording.gap_rows, rows})
        for begin, end in pairwise(edges):
            block = blank(end - begin)
            block["seq"] += begin
            block["hard"] = recording.hard[begin:end]
            block["soft"] = recording.soft[begin:end]
            if self.timed:
                block["t_hard_ns"] = _ns(recording.t_hard_s[begin:end])
                block["t_soft_ns"] = _ns(recording.t_soft_s[begin:end])
            else:
                block["t_hard_ns"] = block["t_soft_ns"] = block["seq"] * UNTIMED_NS
            self._count(block)
            yield block


def _ns(seconds: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return times in ns, halves rounded away from zero, as the tracker does."""
    ns = seconds * 1e9
    return np.trunc(ns + np.copysign(0.5, ns))


def of_table(path: Path, table: Table, wanted: ReadOptions) -> ImportedRecording:
    """Return a table or a data frame as a recording; errors as in `read`."""
    from palpate.importers.channels import find_channels
    from palpate.recording.arrow import own_frame
    from palpate.recording.open_table import open_table

    if not len(table):
        raise RecordingError(path, "has no rows")
    if wanted == ReadOptions():
        framed = own_frame(table)
        if framed is not None:
            return ImportedRecording(path, framed)
    soft = None
    if wanted.soft is not None:
        soft = open_table(Path(wanted.soft), wanted)
    if table.open_options is not None:
        wanted = table.open_options
    found = find_channels(table, wanted, soft)
    notes = found.notes
    if {column.name for column in table.columns} >= _OWN_NAMES:
        notes += (AS_TABLE,)
    recording = Recording(
        *found.readings,
        notes,
        full_scale_pF=table.full_scale_pF,
        host_stamps=table.host_stamps,
        gap_rows=table.gap_rows,
        unit=unit_read(wanted.unit or "pF"),
        zero_utc_ns=found.zero_utc_ns,
        understood=found.understood,
    )
    return ImportedRecording(path, recording, found.unused)


def with_soft_later(recording: OpenedRecording, later_ms: float | None) -> OpenedRecording:
    """Return a recording whose soft readings are later than its times say, by some ms.

    Raises
    ------
    ValueError
        It is a recording of palpate, which has the times of both channels, or it has no times.
    """
    if later_ms is None:
        return recording
    name = "soft_later_ms"
    if not math.isfinite(later_ms):
        raise ValueError(f"{name}: got {later_ms}, allowed: ms")
    is_table = isinstance(recording, ImportedRecording)
    if not is_table or not recording.timed:
        got = "a table without times" if is_table else "a recording of palpate"
        allowed = "a table of another program, with times, or with --rate"
        raise ValueError(f"{name}: got {got}, allowed: {allowed}")
    whole = recording.in_memory()
    shifted = replace(whole, t_soft_s=whole.t_soft_s + later_ms / 1000)
    return ImportedRecording(recording.path, shifted, recording.unused)


_OWN_NAMES = {"hard_pF", "soft_pF", "t_hard_s", "t_soft_s"}


def recorded(path: str | os.PathLike[str], **asked: Any) -> OpenedRecording:
    """Open a recording, to read it in blocks; a table of another program is read as a whole.

    Parameters
    ----------
    path : path-like
    **asked
        Keywords of `palpate.read`.

    Returns
    -------
    OpenedRecording
        A `RecordingFile` or an `ImportedRecording`, an input for `palpate.touches`: `blocks()`
        yields arrays of samples; `settings` and `describe()` are those of the sidecar.

    Raises
    ------
    RecordingError, ValueError
        As in `palpate.read`.

    Examples
    --------
    >>> import palpate
    >>> [touch.samples for touch in palpate.touches(recorded("tests/data/four-specimens.csv"))]
    [250, 250, 250, 250]
    """
    wanted = ReadOptions(**asked)
    file = Path(path)
    if wanted == ReadOptions() and is_own(file):
        return RecordingFile(file)
    from palpate.recording.open_table import open_table  # a recording of palpate does not need it

    if wanted != ReadOptions():
        return of_table(file, open_table(file, wanted), wanted)
    if has_wrong_name(file):
        raise RecordingError(file, header_damage(file), 1)
    try:
        table = open_table(file, wanted)
        return own_recording(table) or of_table(file, table, wanted)
    except (OptionError, RecordingError) as error:
        damage = header_damage(file)
        if damage:
            raise RecordingError(file, damage, 1) from error
        raise


def read(
    source: str | os.PathLike[str] | Frame,
    *,
    columns: Mapping[str, str | int] | str | None = None,
    unit: str | None = None,
    time_unit: str | None = None,
    rate: float | None = None,
    decimal: str | None = None,
    soft: str | os.PathLike[str] | None = None,
    part: str | None = None,
    pattern: str | None = None,
) -> Recording:
    """Read a recording into memory.

    Parameters
    ----------
    source : path-like or data frame
        A recording of palpate, or a table of another program; also packed as .gz. "-" is standard
        input. Or a frame of pandas or polars, an object with `__arrow_c_stream__`, a dict of
        arrays, or a structured array: columns of contiguous float64 are used as they are, without a
        copy.
    columns : mapping or str, optional
        Columns of "hard", "soft" and, if it is not found by its name, "time"; also "soft_time", if
        the soft channel has its own times. A column is a name in one of the header rows, or a
        position counted from 1. Not needed for palpate's own files. Of captured lines of a serial
        port: the names of the cells in order, as for `serial:`, "t_ms,hard,soft".
    unit : str, optional
        Unit of both capacitances, aF to F: they are converted to pF. Or of two other signals, any
        text, as "N": their values are used as they are. Default: the unit in the header, else pF.
    time_unit : str, optional
        Unit of the times, ns to d. Default: the unit in the header, else the one that makes sense.
    rate : float, optional
        Pairs a second, for a table without usable times.
    decimal : str, optional
        Decimal mark, "point" or "comma", where the numbers leave it open.
    soft : path-like, optional
        File of the soft channel, if `source` has the hard channel only.
    part : str, optional
        Name of the sheet of a workbook, or of the stream of an XDF file, if several have the two
        channels.
    pattern : str, optional
        Of captured lines: a regular expression that matches a whole line, with groups of these
        names, as "A(?P<hard>.*)B(?P<soft>.*)".

    Returns
    -------
    Recording

    Raises
    ------
    RecordingError
        The file is not a recording: with the line and the reason.
    ValueError
        A column does not exist, a unit is not known, or the file leaves its meaning open: with what
        settles it.

    Examples
    --------
    >>> recording = read("bench.csv", columns={"hard": 3, "soft": "Ch1"})  # doctest: +SKIP
    """
    wanted = ReadOptions(columns, unit, time_unit, rate, decimal, soft, part, pattern)
    if isinstance(source, str | os.PathLike):
        return recorded(source, **vars(wanted)).in_memory()
    from palpate.importers.frames import frame_table

    table = frame_table(source, wanted)
    return of_table(table.path, table, wanted).in_memory()
