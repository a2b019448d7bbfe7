"""Writes a recording in its own thread: a slow disk does not delay the source.

Rows are written every 0.1 s; they survive if the process is killed. Each second they are synced to
the disk, and then a checkpoint of the synced rows goes to the sidecar: so a recording without an
end can be verified up to it.
"""

import os
import time
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from threading import Event, Thread
from typing import Any

import numpy as np

from palpate._core import SampleRing
from palpate.clocks import epoch_at
from palpate.errors import RecordingError
from palpate.files import Json, file_errors
from palpate.recording import sidecar
from palpate.recording.session import Plan
from palpate.recording.sidecar import MarkKind, SidecarMark
from palpate.recording.writer import SidecarFile, Writer
from palpate.samples import DTYPE, Block, Instrument, Sample, block_of, samples_of
from palpate.source_events import Conditions

FLUSH_S = 0.1
SYNC_S = 1.0
CAPACITY = 32768  # samples: a disk may hang for 14 minutes at 38 pairs a second
_HANGS_S = 3.0  # a disk may hang this long at any rate, within the next limit
_MOST = 2**20  # samples


class Recorder:
    """Writes a recording while it is measured.

    If the file is removed, renamed, replaced, or changed by another program, or its disk fails or
    is full, `error` is set, and nothing more is written: it says how many rows are on the disk.

    Parameters
    ----------
    path : path-like
        NAME.csv; the sidecar becomes NAME.json.
    device : dict
        Description of the instrument, from `Source.describe`.
    settings : dict
        Scene and settings of the tracker.
    notes : list of str
    zero_ns : callable
        Returns `time.monotonic_ns()` at t = 0, or None; called at the first sample. The sidecar
        gets it, and UTC of the same moment as the wall clock shows it at the begin, `zero_utc_ns`,
        and at the end, `zero_utc_ns_at_end`.

    Attributes
    ----------
    path : pathlib.Path
        NAME.csv, absolute.
    first_s : float or None
        Time of the first sample of the recording, s; None: there is none yet.
    conditions : list of Conditions
        Conditions measured so far (temperature, supply); a longer list replaces it. It goes to the
        sidecar with each checkpoint, and at the end.
    popped : callable
        Called, in the thread that writes, when there is room again.

    Raises
    ------
    RecordingError
        One of the two files already exists, or cannot be written.
    ValueError
        The name does not end in ".csv", or the notes are too long.

    Examples
    --------
    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> recorder = Recorder(folder / "run.csv", {}, {}, ["a note"])
    >>> recorder.push(Sample(0, 0, 13_000_000, 8388608, 8388608, 0.0, 0.0))
    True
    >>> recorder.close()
    >>> (folder / "run.csv").read_text().splitlines()[1]
    '0,0.000000000,0.013000000,8388608,8388608,0.0,0.0,-1,0'
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        device: Json,
        settings: Json,
        notes: list[str],
        *,
        zero_ns: Callable[[], int | None] = lambda: None,
    ) -> None:
        document = sidecar.fresh(device, settings, list(notes))
        self.path: Path = Path(path).absolute()
        self.first_s: float | None = None
        self.conditions: list[Conditions] = []
        self.popped: Callable[[], None] = lambda: None
        self._clock: dict[str, int] = document["clock"]
        self._find_zero: Callable[[], int | None] | None = zero_ns
        self._find_zero_at_end = zero_ns
        self._ring = SampleRing(capacity_for(Instrument.of(device).period_s))
        # Samples that were read before, and a note on where they begin.
        self._earlier: tuple[Block, str] | None = None
        self._last: Sample | None = None  # in the ring
        self._gaps: deque[SidecarMark] = deque()
        self._wake = Event()
        self._closing = False
        self._writer = Writer(self.path, document)
        self._thread = Thread(target=self._run, name="palpate-recorder", daemon=True)
        self._thread.start()

    @property
    def error(self) -> RecordingError | None:
        """The error that ended the recording; a source ends then."""
        return self._writer.error

    @property
    def rows(self) -> int:
        """Number of rows in the file."""
        return self._writer.written.rows

    @property
    def dropped(self) -> int:
        """Number of samples that are not in the file: the disk failed or was too slow."""
        waiting = len(self._ring) if self.error else 0
        return self._ring.dropped + self._writer.missing + waiting

    @property
    def room(self) -> int:
        """Samples a pausable source may push: half the free space; unlimited after an error."""
        if self.error is not None:
            return self._ring.capacity
        return self._ring.capacity // 2 - len(self._ring)

    @property
    def is_behind(self) -> bool:
        """Whether a pausable source should wait for the disk."""
        return self.room <= 0

    def begin(self, earlier: Block, marks: Sequence[SidecarMark], note: str) -> None:
        """Begin with samples that were read before. Call it once, before any other sample.

        Parameters
        ----------
        earlier : numpy.ndarray of `DTYPE`, shape (n,)
            Consecutive samples, before all that are pushed.
        marks : sequence of SidecarMark
            Tares and gaps in them.
        note : str
            Where they begin; empty: no note.
        """
        if len(earlier):
            self._begin_clock(int(earlier["t_hard_ns"][0]))
            self._last = samples_of(earlier[-1:])[0]
        self._gaps.extend(marks)
        self._earlier = earlier, note

    def push(self, sample: Sample) -> bool:
        """Add a sample; return whether there was room. Call it from one thread only."""
        return self.push_many(block_of([sample])) == 1

    def push_many(self, block: Block) -> int:
        """Add consecutive samples; return how many had room. Call it from the thread of `push`."""
        if len(block):
            self._begin_clock(int(block["t_hard_ns"][0]))
        taken = self._ring.push_many(block)
        if taken:
            self._last = samples_of(block[taken - 1 : taken])[0]
        if self.is_behind:
            self._wake.set()
        return taken

    def gap(self, text: str, kind: MarkKind = "gap") -> None:
        """Mark that the earlier baseline is not valid any more; from the thread that pushes.

        The mark is at the last sample before it, as for a tare, and is in the sidecar before any
        later row is in the file. With the kind "mark" it only says what happened there.
        """
        self._gaps.append(SidecarMark.at(self._last, text, kind))

    def note(self, text: str) -> None:
        """Add a note to the sidecar; from any thread.

        Raises
        ------
        ValueError
            There is no room for more notes in this recording, which goes on; or it is closed.
        RecordingError
            The sidecar cannot be written.
        """
        self._change(lambda file: file.add("notes", text))

    def mark(self, text: str, sample: Sample | None, kind: MarkKind = "mark") -> int:
        """Add a mark at a sample to the sidecar; return its number, from 1. Errors as in `note`."""
        return self._add_mark(SidecarMark.at(sample, text, kind))

    def mark_at(self, t_s: float, text: str) -> int:
        """Add a mark at a time, s, as `mark`; ValueError, too, if the recording began later."""
        if self.first_s is None or not t_s >= self.first_s:
            begins = "it has no row yet"
            if self.first_s is not None:
                begins = f"from {self.first_s:.3f} s on, where it begins"
            raise ValueError(
                f"mark: got {t_s:.3f} s, allowed: a time that is in the recording: {begins}"
            )
        return self._add_mark(SidecarMark(-1, t_s, text))

    def _add_mark(self, mark: SidecarMark) -> int:
        return int(self._change(lambda file: file.add("marks", mark.as_dict())))

    def rename_mark(self, number: int, text: str) -> None:
        """Give a mark another text; ValueError, too, if it is a tare or a gap, or does not exist."""
        self._change(lambda file: file.rename(number, text))

    def session(self, plan: Plan) -> None:
        """Store the session; it is saved with the next checkpoint. Errors as in `note`."""
        self._change(lambda file: file.set("session", plan.as_dict()))

    def _change(self, change: Callable[[SidecarFile], Any]) -> Any:
        if self._closing:
            raise ValueError(
                f"{self.path.name}: got a change of a closed recording, allowed: until it is closed"
            )
        with file_errors(self.path, "cannot be written"):
            return change(self._writer.sidecar)

    def close(
        self, counters: Callable[[], dict[str, int]] = dict, error: str | None = None
    ) -> None:
        """Write the remaining samples and the end of the sidecar, and close the file.

        Parameters
        ----------
        counters : callable
            Returns the counters for the sidecar; called when all rows are written.
        error : str, optional
            The error that ended the source.

        Raises
        ------
        RecordingError
            The end cannot be written.
        """
        if self._closing:
            return
        self._ring.close()
        self._closing = True
        self._wake.set()
        self._thread.join()
        end: Json = {"dropped": self.dropped, "counters": counters()}
        if error:
            end["error"] = error
        zero_ns = self._find_zero_at_end()
        if "zero_monotonic_ns" in self._clock and zero_ns is not None:
            self._clock = {**self._clock, "zero_utc_ns_at_end": epoch_at(zero_ns).utc_ns}
        self._writer.end(self._entries, end)

    @property
    def _entries(self) -> Json:
        entries: Json = {"clock": self._clock}
        if self.conditions:
            entries["conditions"] = [each.as_dict() for each in self.conditions]
        return entries

    def _begin_clock(self, first_ns: int) -> None:
        """At the first sample: its clock is known now."""
        if self.first_s is None:
            self.first_s = first_ns / 1e9
        zero_ns = self._find_zero() if self._find_zero else None
        if zero_ns is not None:
            self._clock = {
                **self._clock,
                "zero_monotonic_ns": zero_ns,
                "zero_utc_ns": epoch_at(zero_ns).utc_ns,
            }
        self._find_zero = None

    def _run(self) -> None:
        waiting = np.empty(self._ring.capacity, DTYPE)
        synced = time.monotonic()
        closing = False
        while not closing and not self.error:
            closing = self._closing
            count = self._ring.pop_many(waiting)
            self.popped()
            while self._gaps:
                mark = self._gaps.popleft().as_dict()
                self._writer.attempt(partial(self._writer.sidecar.add, "marks", mark))
            self._write_earlier()  # after the pop: what was popped came later
            self._writer.write(waiting[:count])
            if closing or time.monotonic() - synced >= SYNC_S:
                self._writer.checkpoint(self._entries)
                synced = time.monotonic()
            if not closing:
                self._wake.wait(FLUSH_S)
                self._wake.clear()
        self.popped()  # after an error nothing waits for this disk

    def _write_earlier(self) -> None:
        if self._earlier:
            block, note = self._earlier
            if note:
                self._writer.attempt(lambda: self._writer.sidecar.put(note))
            self._writer.write(block)
            self._earlier = None


def capacity_for(period_s: float, seconds: float = _HANGS_S, least: int = CAPACITY) -> int:
    """Return the room for the samples of some seconds; with an unknown period of 0 the least."""
    count = least
    if period_s:
        count = max(least, round(seconds / period_s))
    return min(count, _MOST)
