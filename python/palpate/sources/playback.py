"""A recording as a source: a recording made by palpate, or a table of another logger."""

import time
from collections.abc import Generator, Iterator, Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from palpate.errors import RecordingError
from palpate.importers.table import ReadOptions, parse_map
from palpate.importers.units import checked_unit
from palpate.recording.convert import RATE
from palpate.recording.reading import recorded
from palpate.samples import Block, Status
from palpate.source_events import Gap, GapCause, SourceItem
from palpate.sources.base import Stoppable
from palpate.sources.options import Check, anything, checked, number

# Message of a source that was stopped before the end of its file, where the checksum is compared.
UNREAD = "not read to its end: its rows are not verified"
_STOOD_S = 0.25


class FileSource(Stoppable):
    """The samples of a file, as fast as possible or with the timing of the recording."""

    def __init__(self, path: str, speed: float | None = None, **asked: Any) -> None:
        recording = self.recording = recorded(path, **asked)
        if not recording.timed:
            raise ValueError(f"rate: got none, allowed: {RATE}")
        self.live: bool = speed is not None
        self.real_time: bool = False
        self._speed = speed
        super().__init__()

    def __iter__(self) -> Iterator[SourceItem]:
        """Yield the samples and gaps, with `speed` at their times; raises RecordingError at the end if a checksum differs."""
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
        for note in (note for note in recording.notes if note not in recording.doubts):
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
            if not self._speed:
                yield _marked(block)
                continue
            first_ns = block["t_hard_ns"][0] if first_ns is None else first_ns
            due = begun + (block["t_hard_ns"] - first_ns) / 1e9 / self._speed
            begin = 0
            while begin < len(block):
                late_s = time.monotonic() - due[begin]
                if late_s > _STOOD_S:  # the machine stood still: it goes on where it was
                    begun = begun + late_s
                    due = due + late_s
                self._stopped.wait(max(due[begin] - time.monotonic(), 0))
                if self._stopped.is_set():
                    return False
                later = due[begin:] > time.monotonic()
                end = begin + max(int(later.argmax()), 1) if later.any() else len(block)
                yield _marked(block[begin:end])
                begin = end
        return True

    def describe(self) -> dict[str, Any]:
        """Return the description of the instrument from the sidecar."""
        return {**self.recording.describe(), "full_scale_pF": self.recording.full_scale_pF}


def open_file(address: str, options: Mapping[str, Any]) -> FileSource:
    """Return the source of a path; `map` is `columns` as text."""
    given = dict(options)
    if "map" in given:
        given["columns"] = parse_map(str(given.pop("map")))
    return FileSource(address, **checked("file", given, _ALLOWED))


def _marked(block: Block) -> Block:
    """Return samples with status LOST where a value is missing and the file, as most tables, has no status for it."""
    known = np.isfinite(block["hard"]) & np.isfinite(block["soft"])
    unsaid = ~known & (block["status"] == int(Status.OK))
    if unsaid.any():
        block = block.copy()
        block["status"][unsaid] = int(Status.LOST)
    return block


# which checks its values
_ALLOWED: dict[str, Check] = dict.fromkeys((each.name for each in fields(ReadOptions)), anything)
_ALLOWED |= {"unit": checked_unit, **dict.fromkeys(("rate", "speed"), number(0, above=True))}
