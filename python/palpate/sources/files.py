"""A recording as a source: a recording made by palpate, or a table of another logger."""

import time
from collections.abc import Generator, Iterator, Mapping
from contextlib import suppress
from threading import Event
from typing import Any

import numpy as np

from palpate.errors import RecordingError
from palpate.recording.columns import RATE
from palpate.recording.foreign import AnyRecording, recorded
from palpate.samples import DTYPE, Block, Sample, Status, samples_of
from palpate.sources.base import Gap, Source
from palpate.sources.options import anything, checked, choice, number
from palpate.tables.table import DECIMALS, parsed_map
from palpate.tables.units import PICOFARADS, SECONDS

_NOTHING = np.empty(0, DTYPE)
# Message of a source that was stopped before the end of its file, where the checksum is compared.
UNREAD = "not read to its end: its rows are not verified"
_STOOD_S = 0.25


class FileSource(Source):
    """The samples of a file, as fast as possible or with the timing of the recording."""

    def __init__(self, path: str, speed: float | None = None, **asked: Any) -> None:
        self.recording: AnyRecording = recorded(path, **asked)
        if not self.recording.timed:
            raise ValueError(f"rate: got none, allowed: {RATE}")
        self.live: bool = speed is not None
        self.real_time: bool = False
        self._speed = speed
        self._stopped = Event()
        self._reading: Generator[Block] | None = None
        self._gaps = [Gap(seq + 1, text) for seq, text in self.gap_marks]

    def __iter__(self) -> Iterator[Sample]:
        """Return the samples, from the first one; raises RecordingError after the last one if a checksum differs."""
        for block in self._blocks():
            for sample in samples_of(block):
                if self._stopped.is_set():
                    return
                yield sample

    def read_block(self) -> Block:
        """Return the next samples, with `speed` those that are due; empty at the end. Errors as of the iteration."""
        self._reading = self._reading or self._blocks()
        return next(self._reading, _NOTHING)

    def _blocks(self) -> Generator[Block]:
        whole = False
        if self.recording.understood:
            self.notify(f"{self.recording.path}: {self.recording.understood}")
        try:
            whole = yield from self._due(self._speed) if self._speed else self._all()
        finally:  # also if the reader wants no more
            if not whole:
                self.notify(f"{self.recording.path}: {UNREAD}")
        if whole:
            self._tell()

    def _all(self) -> Generator[Block, None, bool]:
        """Yield the samples; return whether all of them."""
        for block in self.recording.blocks():
            if self._stopped.is_set():
                return False
            yield _marked(block)
        return True

    def _due(self, speed: float) -> Generator[Block, None, bool]:
        """Yield the samples at their times; return whether all of them."""
        begun, first_ns = time.monotonic(), None
        for block in self.recording.blocks():
            first_ns = block["t_hard_ns"][0] if first_ns is None else first_ns
            due = begun + (block["t_hard_ns"] - first_ns) / 1e9 / speed
            begin = 0
            while begin < len(block):
                late_s = time.monotonic() - due[begin]
                if late_s > _STOOD_S:  # the machine stood still: it goes on where it was
                    begun, due = begun + late_s, due + late_s
                self._stopped.wait(max(due[begin] - time.monotonic(), 0))
                if self._stopped.is_set():
                    return False
                later = due[begin:] > time.monotonic()
                end = begin + max(int(later.argmax()), 1) if later.any() else len(block)
                yield _marked(block[begin:end])
                begin = end
        return True

    def _tell(self) -> None:
        doubts = self.recording.doubts
        for note in self.recording.notes:
            if note not in doubts:
                self.notify(f"{self.recording.path}: {note}")
        if doubts:
            raise RecordingError(self.recording.path, "; ".join(doubts))

    def describe(self) -> dict[str, Any]:
        """Return the description of the instrument from the sidecar."""
        return {**self.recording.describe(), "full_scale_pF": self.full_scale_pF}

    def interrupt(self) -> None:
        """Stop the iteration."""
        self._stopped.set()

    def close(self) -> None:
        """End the reading in blocks."""
        if self._reading:
            with suppress(ValueError):  # another thread is in it, and was interrupted before
                self._reading.close()

    @property
    def full_scale_pF(self) -> float:
        """Smallest absolute reading that counts as saturated, pF."""
        return self.recording.full_scale_pF

    @property
    def host_stamps(self) -> bool:
        """Whether the times are arrivals at the computer."""
        return self.recording.host_stamps

    @property
    def timed(self) -> bool:
        """Whether the file has times."""
        return self.recording.timed

    @property
    def tares(self) -> frozenset[int]:
        """As `tares` of the recording."""
        return self.recording.tares

    @property
    def gap_marks(self) -> list[tuple[int, str]]:
        """As `gap_marks` of the recording."""
        return self.recording.gap_marks

    @property
    def gaps(self) -> list[Gap]:
        """The gaps of the measurement."""
        return self._gaps

    def blocks(self) -> Iterator[Block]:
        """Return the samples as arrays of some thousand; `palpate.touches` reads these."""
        return self.recording.blocks()


def open_file(address: str, options: Mapping[str, Any]) -> FileSource:
    """Return the source of a path; `map` is `columns` as text."""
    given = dict(options)
    if "map" in given:
        given["columns"] = parsed_map(str(given.pop("map")))
    return FileSource(address, **checked("file", given, _ALLOWED))


def _marked(block: Block) -> Block:
    """Return samples with status LOST where a value is missing and the file, as most tables, has no status for it."""
    known = np.isfinite(block["hard"]) & np.isfinite(block["soft"])
    unsaid = ~known & (block["status"] == int(Status.OK))
    if unsaid.any():
        block = block.copy()
        block["status"][unsaid] = int(Status.LOST)
    return block


_ALLOWED = {
    "columns": anything,
    "unit": choice(*PICOFARADS),
    "time_unit": choice(*SECONDS),
    "rate": number(0, above=True),
    "decimal": choice(*DECIMALS),
    "soft": anything,
    "part": anything,
    "speed": number(0, above=True),
}
