"""Any recording as a sequence of blocks: palpate's own, and long clean tables of other programs, in parts."""

import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate.ad7746.datasheet import SATURATED_PF
from palpate.errors import PalpateError
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

if TYPE_CHECKING:
    from palpate.tables.flat import Flat
    from palpate.tables.understanding import Channels

_Array = NDArray[np.float64]
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
    """A table of another logger, read as a whole, or in parts if it is long and nothing in it is doubtful.

    Parameters
    ----------
    path : path-like
    table : Table, optional
        The table, if it was read before.
    known : sequence of Logger
        What is remembered about loggers; used if nothing else is asked.
    whole : bool
        Read it as a whole.
    **asked
        Keywords of `palpate.read`.

    Attributes
    ----------
    unused : list of str
        Names, or positions from 1, of the columns that are not in the recording.
    document : None
        There is no sidecar.
    doubts : tuple of str
        Empty: what is doubtful is in `notes`.

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
        self,
        path: str | os.PathLike[str],
        *,
        table: Table | None = None,
        known: Sequence[Logger] = (),
        whole: bool = False,
        **asked: Any,
    ) -> None:
        self.path: Path = Path(path)
        self.survey: Survey = Survey()
        self._wanted, self._known = Asked(**asked), tuple(known)
        self._parts = None if whole or table else _in_parts(self.path, self._wanted, self._known)
        if self._parts:
            begin, self.unused = self._parts.begin, self._parts.unused
        else:
            self.recording, self.unused = begin, _ = _whole(self.path, table, self._wanted, self._known)
        self.full_scale_pF: float = begin.full_scale_pF
        self.host_stamps: bool = begin.host_stamps
        self.gap_marks: list[tuple[int, str]] = [(row - 1, GAP) for row in begin.gap_rows]
        self.tares: frozenset[int] = frozenset(row for row, _ in self.gap_marks)
        times = (begin.t_hard_s, begin.t_soft_s)
        self.timed: bool = all(bool(np.isfinite(t).all()) for t in times)
        self.settings: dict[str, Any] = {}
        self.understood: str = begin.understood
        self._told: tuple[str, ...] = begin.notes

    @property
    def in_parts(self) -> bool:
        """Whether it is read in parts."""
        return self._parts is not None

    @cached_property
    def recording(self) -> Recording:
        """The whole table."""
        return _whole(self.path, None, self._wanted, self._known)[0]

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on the data; complete after `blocks()`."""
        pause = self.survey.told_pause if self.timed else ""
        return (*self._told, *([pause] if pause else []))

    def describe(self) -> dict[str, Any]:
        """Return the file name and full scale; nothing else is known."""
        known = {"name": "table of another program", "file": self.path.name, "full_scale_pF": self.full_scale_pF}
        return known | ({"stamps": "host"} if self.host_stamps else {})

    def blocks(self) -> Iterator[Block]:
        """Yield all samples, in parts, a new one after each gap; without times, samples are 1 ms apart."""
        self.survey = Survey(marked=self.tares)
        for part in self._parts.flat.parts() if self._parts else self._of_whole():
            block = self._block(self.survey.rows, *part)
            self.survey.add(block)
            yield block

    def _of_whole(self) -> Iterator[tuple[_Array, ...]]:
        recording = self.recording
        rows = len(recording.hard)
        for begin, end in pairwise(sorted({*range(0, rows, _ROWS), *recording.gap_rows, rows})):
            columns = (recording.t_hard_s, recording.t_soft_s, recording.hard, recording.soft)
            yield tuple(column[begin:end] for column in columns)

    def _block(self, first: int, t_hard_s: _Array, t_soft_s: _Array, hard: _Array, soft: _Array) -> Block:
        block = blank(len(hard))
        block["seq"] += first
        block["hard"], block["soft"] = hard, soft
        for name, seconds in (("t_hard_ns", t_hard_s), ("t_soft_ns", t_soft_s)):
            ns = seconds * 1e9  # halves away from zero, as the tracker rounds seconds
            block[name] = np.trunc(ns + np.copysign(0.5, ns)) if self.timed else block["seq"] * 1_000_000
        return block


class _Parts(NamedTuple):
    """A table that is read in parts; `begin`: its first rows, with the notes on all of them."""

    begin: Recording
    unused: list[str]
    flat: "Flat"


def _in_parts(path: Path, asked: Asked, known: Sequence[Logger]) -> _Parts | None:
    from palpate.recording.exchange.frames import own_frame
    from palpate.tables.flat import flat
    from palpate.tables.formats import long_table

    if asked.soft is not None or asked.part is not None:
        return None
    try:
        stream = long_table(path)
        if stream is None or (not asked.given and own_frame(stream.first) is not None):
            return None
        how = _how(stream.first, asked, known)
        found = flat(stream, how.asked)
    except (OSError, PalpateError, ValueError):
        return None  # the reader of the whole says why
    return None if found is None else _Parts(how.recording(found.first), found.first.unused, found)


def _whole(path: Path, table: Table | None, asked: Asked, known: Sequence[Logger]) -> tuple[Recording, list[str]]:
    from palpate.tables.formats import read_table  # here and below: a recording of palpate needs none of it

    return _recording(table or read_table(path, asked), asked, known)


def _recording(table: Table, asked: Asked, known: Sequence[Logger]) -> tuple[Recording, list[str]]:
    """Return a table as a recording, and the names of the columns that it does not have."""
    from palpate.recording.exchange.frames import own_frame
    from palpate.tables.formats import read_table
    from palpate.tables.understanding import channels

    if not asked.given and (made := own_frame(table)) is not None:
        return made, []
    how = _how(table, asked, known)
    found = channels(table, how.asked, None if how.asked.soft is None else read_table(Path(how.asked.soft)))
    return how.recording(found), found.unused


class _How(NamedTuple):
    """How a table is read: as asked, or as known of palpate's own columns, or of a logger."""

    asked: Asked
    own: bool
    logger: Logger | None
    full_scale_pF: float

    def recording(self, found: "Channels") -> Recording:
        """Return its channels as a recording."""
        return Recording(
            found.t_hard_s,
            found.t_soft_s,
            found.hard,
            found.soft,
            notes=(*([str(self.logger)] if self.logger else []), *found.notes, *([AS_TABLE] if self.own else [])),
            full_scale_pF=self.full_scale_pF,
            zero_utc_ns=found.zero_utc_ns,
            understood=found.said,
        )


def _how(table: Table, asked: Asked, known: Sequence[Logger]) -> _How:
    own = {name for column in range(table.width) for name in table.names(column)} >= set(OWN_COLUMNS.values())
    full_scale = SATURATED_PF if own and asked.columns is None else np.inf
    if own and not {"time", "soft_time"} & set(asked.columns or {}):
        asked = asked.with_columns({**OWN_COLUMNS, **(asked.columns or {})})
    logger = None if own or set(asked.given) - set(OF_ONE_FILE) else known_logger(table, known)
    if logger:
        asked = replace(logger.asked, **{name: getattr(asked, name) for name in OF_ONE_FILE})
    return _How(asked, own, logger, full_scale)


AnyRecording = Recorded | Foreign | BinaryData
"""A recording of any kind, as a sequence of blocks."""


def recorded(path: str | os.PathLike[str], *, whole: bool = False, **asked: Any) -> AnyRecording:
    """Open a recording of any length, to read it in blocks.

    Parameters
    ----------
    path : path-like
    whole : bool
        As in `Foreign`: read a table of another program as a whole, as for its `recording`.
    **asked
        Keywords of `palpate.read`, and `known`, as in `Foreign`.

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
    return Foreign(path, known=known, whole=whole, **given)
