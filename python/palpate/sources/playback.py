"""A recording as a source: a recording made by palpate, or a table of another logger."""

import time
from collections.abc import Generator, Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from palpate.errors import RecordingError
from palpate.files import Json
from palpate.importers.table import ReadOptions, parse_map
from palpate.importers.units import checked_unit
from palpate.recording.convert import RATE
from palpate.recording.reading import recorded
from palpate.samples import Block, Status
from palpate.source_events import Gap, GapCause, SourceItem
from palpate.sources.base import Stoppable
from palpate.sources.options import Options, number, option

# Message of a source that was stopped before the end of its file, where the checksum is compared.
UNREAD = "not read to its end: its rows are not verified"
_STOOD_S = 0.25  # the computer stood still, or slept


@dataclass(frozen=True)
class FileOptions(ReadOptions, Options):
    """Options of a path."""

    unit: str | None = option(checked_unit, None)
    """Unit of both signals. Default: from the header, else by size."""
    rate: float | None = option(number(0, above=True), None)
    """Pairs a second, in place of times."""
    speed: float | None = option(number(0, above=True), None)
    """Speed relative to the recording: 1 is its own speed. Default: as fast as possible."""


class FileSource(Stoppable):
    """The samples of a file, as fast as possible or with the timing of the recording."""

    def __init__(self, path: str, speed: float | None = None, **reading: Any) -> None:
        recording = self.recording = recorded(path, **reading)
        if not recording.timed:
            raise ValueError(f"rate: got none, allowed: {RATE}")
        self.live = speed is not None
        self.real_time = False
        self._speed = speed
        super().__init__()

    def __iter__(self) -> Iterator[SourceItem]:
        """Yield samples and gaps, with `speed` at their times.

        RecordingError at the end if a checksum differs.
        """
        gaps = list(self.recording.gap_marks)
        for block in self._blocks():
            begin = 0
            while gaps and gaps[0][0] < block["seq"][-1]:
                seq, text = gaps.pop(0)
                end = max(begin, int(np.searchsorted(block["seq"], seq, "right")))
                if end > begin:
                    yield block[begin:end]
                yield Gap(GapCause.RECORDED, text)
                begin = end
            yield block[begin:]

    def _blocks(self) -> Iterator[Block]:
        recording = self.recording
        whole = False
        if recording.understood:
            self.notify(f"{recording.path}: {recording.understood}")
        try:
            whole = yield from self._due()
        finally:  # also if the reader wants no more
            if not whole:
                self.notify(f"{recording.path}: {UNREAD}")
        if not whole:
            return
        for note in recording.notes:
            if note not in recording.doubts:
                self.notify(f"{recording.path}: {note}")
        if recording.doubts:
            raise RecordingError(recording.path, "; ".join(recording.doubts))

    def _due(self) -> Generator[Block, None, bool]:
        """Yield the samples, with `speed` at their times; return whether all of them."""
        begun = time.monotonic()
        first_ns = None
        for block in self.recording.blocks():
            if self._stopped.is_set():
                return False
            block = _marked(block)
            if not self._speed:
                yield block
                continue
            if first_ns is None:
                first_ns = block["t_hard_ns"][0]
            due = begun + (block["t_hard_ns"] - first_ns) / 1e9 / self._speed
            begin = 0
            while begin < len(block):
                late_s = time.monotonic() - due[begin]
                if late_s > _STOOD_S:  # it goes on where it was
                    begun += late_s
                    due += late_s
                if self._stopped.wait(max(due[begin] - time.monotonic(), 0)):
                    return False
                end = int(np.searchsorted(due, time.monotonic(), "right"))
                yield block[begin : max(end, begin + 1)]
                begin = max(end, begin + 1)
        return True

    def describe(self) -> Json:
        """Return the description of the instrument from the sidecar."""
        return {**self.recording.describe(), "full_scale_pF": self.recording.full_scale_pF}


def open_file(address: str, values: Mapping[str, object]) -> FileSource:
    """Return the source of a path; `map` is `columns` as text."""
    reading = dict(values)
    if "map" in reading:
        reading["columns"] = parse_map(str(reading.pop("map")))
    options = FileOptions.parse("file", reading)
    return FileSource(address, **asdict(options))


def _marked(block: Block) -> Block:
    """Return samples with status LOST where a value is missing; most tables have no status."""
    has_both = np.isfinite(block["hard"]) & np.isfinite(block["soft"])
    is_unmarked = ~has_both & (block["status"] == int(Status.OK))
    if is_unmarked.any():
        block = block.copy()
        block["status"][is_unmarked] = int(Status.LOST)
    return block
