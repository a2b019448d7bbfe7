"""A recording that is read from a file in blocks: palpate's own, or an imported table."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from palpate.files import Json
from palpate.recording.counts import Survey
from palpate.recording.recording import Recording
from palpate.recording.sidecar import Sidecar
from palpate.recording_protocol import Part, PartEnd
from palpate.samples import Block, usable_readings


class Damage(NamedTuple):
    """A place in a file that is no row, and was not left by a writer that was stopped.

    Attributes
    ----------
    line, lines : int
        Number of its first line, from 1; number of lines.
    offset, bytes : int
        Where it begins in the file, and its length.
    rows_before : int
        Rows of the file before it.
    reason : str
    """

    line: int
    lines: int
    offset: int
    bytes: int
    rows_before: int
    reason: str


class GapMark(NamedTuple):
    """A gap: the number of the last sample before it, and what happened there."""

    seq: int
    text: str


def _ignore(_rows: int) -> None:
    """Ignore the progress."""


class OpenedRecording(ABC):
    """A recording in a file, read in blocks; it has the members of `RecordingProtocol`.

    Attributes
    ----------
    path : pathlib.Path
    unit : str
        Of both signals.
    full_scale_pF : float
        Full scale, pF; inf: unknown.
    host_stamps : bool
        Whether the computer stamped the samples when they arrived.
    period_s : float
        Time from pair to pair by the device's settings, s; 0: unknown.
    zero_utc_ns : int or None
        UTC of t = 0, ns since 1970, by the wall clock at the beginning; None: unknown.
    timed : bool
        Whether its rows have times.
    understood : str
        Of a table of another program: one line that says which columns and units were used; else
        empty.
    unused : list of str
        Of a table: names, or positions from 1, of the columns that are not in the recording.
    sidecar : Sidecar
        Empty without one.
    settings : dict
        Scene and settings of the live measurement; empty if unknown.
    tares : frozenset of int
        Numbers of the samples after which the baseline was measured again; each is the last of a
        block.
    gap_marks : list of GapMark
        The gaps among the `tares`.
    survey : Survey
        Counts over the blocks of the last `blocks()`.
    damaged : list of Damage
        Places that the last `blocks()` left out; filled after `skip_damage()` only.
    on_progress : callable
        Called with the number of rows read; an error that it raises ends the reading.
    """

    unit: str = "pF"
    full_scale_pF: float = math.inf
    host_stamps: bool = False
    period_s: float = 0.0
    zero_utc_ns: int | None = None
    timed: bool = True
    understood: str = ""

    def __init__(self, path: Path) -> None:
        self.path: Path = path
        self.unused: list[str] = []
        self.sidecar: Sidecar = Sidecar()
        self.settings: Json = {}
        self.tares: frozenset[int] = frozenset()
        self.gap_marks: list[GapMark] = []
        self.survey: Survey = Survey()
        self.damaged: list[Damage] = []
        self.on_progress: Callable[[int], None] = _ignore

    @property
    @abstractmethod
    def notes(self) -> tuple[str, ...]:
        """Remarks on the data; complete after `blocks()`."""

    @property
    @abstractmethod
    def doubts(self) -> tuple[str, ...]:
        """Reasons why results may be wrong; complete after `blocks()`."""

    @abstractmethod
    def describe(self) -> Json:
        """Return the description of the instrument."""

    @abstractmethod
    def blocks(self) -> Iterator[Block]:
        """Yield all samples in blocks; after `skip_damage()` without damaged places.

        Yields
        ------
        numpy.ndarray, shape (n,), of `palpate.SampleRing.dtype`
        """

    @abstractmethod
    def in_memory(self) -> Recording:
        """Read the whole recording into memory."""

    @abstractmethod
    def skip_damage(self) -> None:
        """From now on, list damaged places in `damaged`; else the first one is an error."""

    def parts(self, full_scale_pF: float) -> Iterator[Part]:
        """Yield the pairs as a tracker takes them, in ns; each tare and each gap ends a part."""
        gaps = {mark.seq for mark in self.gap_marks}
        for block in self.blocks():
            hard, soft = usable_readings(block, full_scale_pF)
            last = int(block["seq"][-1])
            end = PartEnd.CONTINUES
            if last in gaps:
                end = PartEnd.GAP
            elif last in self.tares:
                end = PartEnd.TARE
            yield Part(block["t_hard_ns"], block["t_soft_ns"], hard, soft, end)

    def value_notes(self) -> Iterator[str]:
        """Yield nothing: the values were checked when they were read."""
        return iter(())

    def _count(self, block: Block) -> None:
        """Count the next block of `blocks()`."""
        self.survey.add(block)
        self.on_progress(self.survey.rows)
