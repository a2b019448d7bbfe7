"""Any recording as a sequence of blocks: palpate's own in parts, a table of another program as one block."""

import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from palpate.ad7746.datasheet import SATURATED_PF
from palpate.recording.exchange.binary_data import BinaryData, is_binary_data
from palpate.recording.exchange.columns_in import own_recording
from palpate.recording.own_file import Recorded
from palpate.recording.recording import Recording
from palpate.recording.survey import Survey
from palpate.samples import Block, blank
from palpate.tables.asked import Asked
from palpate.tables.loggers import OF_ONE_FILE, Logger
from palpate.tables.loggers import known as known_logger
from palpate.tables.table import Table

RATE = "pairs a second, for a table without times; or name the column of times with time=COL"
"""What is allowed as the rate of a table without times."""
_ROWS = 1 << 16  # of a block
GAP = "as a column of the table says"
"""What happened at a gap of a recording that became a data frame."""
OWN_COLUMNS = {"hard": "hard_pF", "soft": "soft_pF", "time": "t_hard_s", "soft_time": "t_soft_s"}
AS_TABLE = (
    "a recording of palpate, read as a table of another program: its rows are not verified, its status, codes, tares, "
    "gaps and range not used"
)
"""Note of a recording that is read with `columns`, `unit` or the like, or without its file."""


class Foreign:
    """A table of another logger, read as one block.

    Parameters
    ----------
    path : path-like
    table : Table, optional
        The table, if it was read before.
    known : sequence of Logger
        What is remembered about loggers; used if nothing else is asked.
    **asked
        Keywords of `palpate.read`.

    Attributes
    ----------
    recording : Recording
    unused : list of str
        Names, or positions from 1, of the columns that are not in the recording.

    Raises
    ------
    RecordingError, ValueError
        As in `palpate.read`.

    Examples
    --------
    >>> table = Foreign("tests/data/four-specimens.csv", columns={"hard": "hard_pF", "soft": "soft_pF"})
    >>> [len(block) for block in table.blocks()] == [table.survey.rows]
    True
    """

    document = None
    doubts: tuple[str, ...] = ()

    def __init__(
        self, path: str | os.PathLike[str], *, table: Table | None = None, known: Sequence[Logger] = (), **asked: Any
    ) -> None:
        self.path: Path = Path(path)
        self.survey: Survey = Survey()
        wanted = Asked(**asked)
        from palpate.tables.formats import read_table  # here and below: a recording of palpate needs none of it

        table = table or read_table(self.path, wanted)
        self.recording, self.unused = _recording(table, wanted, known)
        self.full_scale_pF: float = self.recording.full_scale_pF
        self.host_stamps: bool = self.recording.host_stamps
        self.gap_marks: list[tuple[int, str]] = [(row - 1, GAP) for row in self.recording.gap_rows]
        self.tares: frozenset[int] = frozenset(row for row, _ in self.gap_marks)
        times = (self.recording.t_hard_s, self.recording.t_soft_s)
        self.timed: bool = all(bool(np.isfinite(t).all()) for t in times)
        self.settings: dict[str, Any] = {}
        self.understood: str = self.recording.understood

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on the data; complete after `blocks()`."""
        pause = self.survey.told_pause if self.timed else ""
        return (*self.recording.notes, *([pause] if pause else []))

    def describe(self) -> dict[str, Any]:
        """Return the file name and full scale; nothing else is known."""
        known = {"name": "table of another program", "file": self.path.name, "full_scale_pF": self.full_scale_pF}
        return known | ({"stamps": "host"} if self.host_stamps else {})

    def blocks(self) -> Iterator[Block]:
        """Yield all samples, in parts, a new one after each gap; without times, samples are 1 ms apart."""
        self.survey = Survey(marked=self.tares)
        rows = len(self.recording.hard)
        for begin, end in pairwise(sorted({*range(0, rows, _ROWS), *self.recording.gap_rows, rows})):
            block = self._block(slice(begin, end))
            self.survey.add(block)
            yield block

    def _block(self, rows: slice) -> Block:
        recording = self.recording
        block = blank(rows.stop - rows.start)
        block["seq"] += rows.start
        block["hard"], block["soft"] = recording.hard[rows], recording.soft[rows]
        for name, seconds in (("t_hard_ns", recording.t_hard_s[rows]), ("t_soft_ns", recording.t_soft_s[rows])):
            ns = seconds * 1e9  # halves away from zero, as the tracker rounds seconds
            block[name] = np.trunc(ns + np.copysign(0.5, ns)) if self.timed else block["seq"] * 1_000_000
        return block


def _recording(table: Table, asked: Asked, known: Sequence[Logger]) -> tuple[Recording, list[str]]:
    """Return a table as a recording, and the names of the columns that it does not have."""
    from palpate.recording.exchange.frames import own_frame
    from palpate.tables.formats import read_table
    from palpate.tables.understanding import channels

    if not asked.given and (made := own_frame(table)) is not None:
        return made, []
    own = {name for column in range(table.width) for name in table.names(column)} >= set(OWN_COLUMNS.values())
    full_scale = SATURATED_PF if own and asked.columns is None else np.inf
    if own and not {"time", "soft_time"} & set(asked.columns or {}):
        asked = asked.with_columns({**OWN_COLUMNS, **(asked.columns or {})})
    logger = None if own or set(asked.given) - set(OF_ONE_FILE) else known_logger(table, known)
    if logger:
        asked = replace(logger.asked, **{name: getattr(asked, name) for name in OF_ONE_FILE})
    found = channels(table, asked, None if asked.soft is None else read_table(Path(asked.soft)))
    recording = Recording(
        found.t_hard_s,
        found.t_soft_s,
        found.hard,
        found.soft,
        notes=(*([str(logger)] if logger else []), *found.notes, *([AS_TABLE] if own else [])),
        full_scale_pF=full_scale,
        zero_utc_ns=found.zero_utc_ns,
        understood=found.said,
    )
    return recording, found.unused


AnyRecording = Recorded | Foreign | BinaryData
"""A recording of any kind, as a sequence of blocks."""


def recorded(path: str | os.PathLike[str], **asked: Any) -> AnyRecording:
    """Open a recording of any length, to read it in blocks.

    Parameters
    ----------
    path : path-like
    **asked
        Keywords of `palpate.read`, and `known`, as in `Foreign`. A table of another program is still read as a whole.

    Returns
    -------
    Recorded, Foreign or BinaryData
        An input for `palpate.touches`: `blocks()` yields arrays of samples; `settings` and `describe()` are those of
        the sidecar.

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
    known = asked.pop("known", ())
    given = {name: value for name, value in asked.items() if value is not None}
    file = Path(path)
    if not given and (own := own_recording(file)):
        return own
    if is_binary_data(file):
        if more := set(given) - {"soft", "rate"}:
            raise ValueError(f"{min(more)}: got it for a file of codes, allowed: soft and rate")
        rate = given.get("rate")
        return BinaryData(file, given.get("soft"), 1 / rate if rate else None)
    return Foreign(path, known=known, **given)
