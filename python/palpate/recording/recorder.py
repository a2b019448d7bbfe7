"""Writes a recording in its own thread: a slow disk does not delay the source.

Rows are written every 0.1 s; they survive if the process is killed. Each second they are synced to
the disk, and then a checkpoint of the synced rows goes to the sidecar: so a recording without an
end can be verified up to it.

What cannot be written is tried again: the rows wait in a queue, and the changes of the sidecar in
memory. Only a full queue loses rows; the recording then resumes after a gap.
"""

import math
import os
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Event, Thread
from typing import Any

import numpy as np

from palpate._core import SampleRing
from palpate.clocks import epoch_at
from palpate.errors import RecordingError
from palpate.files import Json
from palpate.recording import sidecar
from palpate.recording.retry_state import reason_of
from palpate.recording.session import Plan
from palpate.recording.sidecar import MarkKind, SidecarMark
from palpate.recording.sidecar_file import SidecarFile
from palpate.recording.writer import Writer
from palpate.samples import DTYPE, Block, Instrument, Sample, block_of, samples_of
from palpate.source_events import Conditions

FLUSH_S = 0.1
SYNC_S = 1.0
PATIENCE_S = 5.0
"""How long a source that can wait, and the end of a recording, wait for a disk that fails."""
CAPACITY = 32768  # samples: a disk may hang for 14 minutes at 38 pairs a second
_HANGS_S = 3.0  # a disk may hang this long at any rate, within the next limit
_MOST = 2**20  # samples


class Recorder:
    """Writes a recording while it is measured.

    What fails is tried again, and `rows_trouble` and `sidecar_trouble` say it: rows wait in a queue
    of some minutes. If the queue is full, rows are lost; they are counted, and the recording
    resumes with a gap mark. If the file is removed, renamed, replaced, or changed by another
    program, `error` is set, and nothing more is written.

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
    notify : callable
        Called with a message when writing fails, when rows are lost, and when it works again; from
        any thread.

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
        notify: Callable[[str], object] = lambda _: None,
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
        self._earlier: Block = np.empty(0, DTYPE)  # samples that were read before
        self._last: Sample | None = None  # in the ring
        self._marks: deque[SidecarMark] = deque()  # for the sidecar, from threads that never wait
        self._gap = _LostRows()
        self._notify = notify
        self._waiting: Block = np.empty(0, DTYPE)  # from the ring, to be written
        self._wake = Event()
        self._closing = False
        self._lost_reason = ""  # of the last rows that had no room
        self._synced_s = time.monotonic()
        self._writer = Writer(self.path, document)
        self._thread = Thread(target=self._run, name="palpate-recorder", daemon=True)
        self._thread.start()

    @property
    def error(self) -> RecordingError | None:
        """Why nothing more is written; at the end also why rows are missing."""
        return self._writer.error

    @property
    def rows_trouble(self) -> str:
        """Why rows wait or are lost, for the user; empty: they are written."""
        disk = self._writer.disk
        if self._gap.rows:
            return f"{self.path.name}: {self._gap.text}, and more are lost"
        if not disk.is_lasting:
            return ""
        waiting = self._count_waiting()
        return (
            f"{self.path.name}: cannot be written: {disk.reason}; {waiting:,} rows wait, and there "
            f"is room for {self._ring.capacity - len(self._ring):,} more; it is tried again"
        )

    @property
    def sidecar_trouble(self) -> str:
        """Why notes, marks and session are not on the disk; empty: they are."""
        file = self._writer.sidecar
        if not file.retry.reason:
            return ""
        rows = "" if self.rows_trouble else "; rows are written"
        if file.is_foreign:
            lost = "notes, marks and checkpoints are in no file"
            return f"{file.path.name}: {file.retry.reason}; {lost}{rows}"
        waits = "notes, marks and checkpoints wait in memory, and it is tried again each second"
        return f"{file.path.name}: cannot be written: {file.retry.reason}; {waits}{rows}"

    @property
    def failures(self) -> int:
        """How often a write, a sync or a replacement has failed; most were tried again."""
        return self._writer.disk.failures + self._writer.sidecar.retry.failures

    @property
    def rows(self) -> int:
        """Number of rows in the file."""
        return self._writer.written.rows

    @property
    def dropped(self) -> int:
        """Number of samples that are not in the file, and will not be."""
        waiting = self._count_waiting() if self.error else 0
        return self._ring.dropped + waiting

    def _count_waiting(self) -> int:
        return len(self._ring) + len(self._waiting) + len(self._earlier)

    @property
    def room(self) -> int:
        """Samples a pausable source may push: half the free space.

        Unlimited after an error, or if the disk fails for longer than `PATIENCE_S`: such a source
        would wait for ever.
        """
        if self.error is not None or self._writer.disk.lasts_s > PATIENCE_S:
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
        self._marks.extend(marks)
        if note:
            self._writer.sidecar.put(note)
        self._earlier = earlier

    def push(self, sample: Sample) -> bool:
        """Add a sample; return whether there was room. Call it from one thread only."""
        return self.push_many(block_of([sample])) == 1

    def push_many(self, block: Block) -> int:
        """Add consecutive samples; return how many had room. Call it from the thread of `push`."""
        if len(block):
            self._begin_clock(int(block["t_hard_ns"][0]))
        if self._gap.rows and len(self._ring) < self._ring.capacity:
            self.mark_later(SidecarMark.at(self._last, self._gap.text, "gap"))
            self._message(f"{self.path.name}: is written again; {self._gap.text}")
            self._gap = _LostRows()
        taken = self._ring.push_many(block)
        if taken:
            self._last = samples_of(block[taken - 1 : taken])[0]
        if taken < len(block):
            self._lose(len(block) - taken)
        if self.is_behind and not self._writer.disk.reason:
            self._wake.set()
        return taken

    def _lose(self, rows: int) -> None:
        """Count rows that have no room; say it at the first one."""
        is_first = not self._gap.rows
        reason = self._writer.disk.reason or "the disk is too slow"
        self._gap = _LostRows(self._gap.rows + rows, self._gap.reason or reason)
        self._lost_reason = self._gap.reason
        if is_first and not self.error:
            waiting = self._count_waiting()
            self._message(
                f"{self.path.name}: rows are lost from here on: {reason}, and {waiting:,} rows "
                "wait already; the measurement goes on"
            )

    def gap(self, text: str, kind: MarkKind = "gap") -> None:
        """Mark that the earlier baseline is not valid any more; from the thread that pushes.

        The mark is at the last sample before it, as for a tare. It is saved before any later row is
        written, unless the sidecar cannot be written. With the kind "mark" it only says what happened
        there.
        """
        self.mark_later(SidecarMark.at(self._last, text, kind))

    def mark_later(self, mark: SidecarMark) -> None:
        """Add a mark within 0.1 s; from any thread: does not wait for the disk, and never fails."""
        self._marks.append(mark)

    def note(self, text: str) -> None:
        """Add a note to the sidecar; from any thread.

        It is on the disk when this returns. If that fails, it waits in memory: `sidecar_trouble`
        says so, and `close` raises an error if it never could be written.

        Raises
        ------
        ValueError
            There is no room for more notes in this recording, which goes on; or it is closed.
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

    def session(self, plan: Plan, *, wait: bool = True) -> None:
        """Store the session, as `note`; with `wait` False it is saved within 0.1 s."""
        self._change(lambda file: file.set("session", plan.as_dict()), wait=wait)

    def _change(self, change: Callable[[SidecarFile], Any], *, wait: bool = True) -> Any:
        if self._closing:
            raise ValueError(
                f"{self.path.name}: got a change of a closed recording, allowed: until it is closed"
            )
        result = change(self._writer.sidecar)
        if wait:
            self._writer.sidecar.save()
        return result

    def close(
        self, counters: Callable[[], dict[str, int]] = dict, error: str | None = None
    ) -> None:
        """Write the remaining samples and the end of the sidecar, and close the file.

        What fails is tried again for `PATIENCE_S`.

        Parameters
        ----------
        counters : callable
            Returns the counters for the sidecar; called when all rows are written.
        error : str, optional
            The error that ended the source.

        Raises
        ------
        RecordingError
            The end cannot be written. `error` says if rows are missing.
        """
        if self._closing:
            return
        self._ring.close()
        self._closing = True
        self._wake.set()
        self._thread.join()
        patience_s = 0.0 if self.error else PATIENCE_S
        self._move_marks()
        self._writer.miss_rows(self.dropped, self._lost_reason)
        end: Json = {"dropped": self.dropped, "counters": counters()}
        if error:
            end["error"] = error
        zero_ns = self._find_zero_at_end()
        if "zero_monotonic_ns" in self._clock and zero_ns is not None:
            self._clock = {**self._clock, "zero_utc_ns_at_end": epoch_at(zero_ns).utc_ns}
        self._writer.end(self._entries, end, patience_s)

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
        buffer = np.empty(self._ring.capacity, DTYPE)
        until_s = math.inf
        is_complete = False
        while not self.error and not is_complete:
            closing = self._closing  # before the ring is emptied
            if closing:
                until_s = min(until_s, time.monotonic() + PATIENCE_S)
            try:
                is_complete = self._step(buffer, closing=closing)
            except Exception as error:  # noqa: BLE001  the thread must not end in silence
                self._writer.disk.failed(reason_of(error))
            self._report()
            if closing and time.monotonic() > until_s and not is_complete:
                self._writer.give_up()
            if not is_complete:
                self._wake.wait(FLUSH_S)
                self._wake.clear()
        self.popped()  # after an error nothing waits for this disk

    def _step(self, buffer: Block, *, closing: bool) -> bool:
        """Write what waits; return whether this was the last step of a recording that is closed."""
        if not len(self._waiting):
            count = self._ring.pop_many(buffer)
            self._waiting = buffer[:count]
        self.popped()
        is_due = time.monotonic() - self._synced_s >= SYNC_S
        self._move_marks()
        self._save(is_due=is_due)  # before the rows that come after the marks
        if not self._write_earlier():  # after the pop: what was popped came later
            return False
        if not self._writer.write(self._waiting):
            return False
        self._waiting = buffer[:0]
        if closing or is_due:
            if not self._writer.checkpoint(self._entries):
                return False
            self._synced_s = time.monotonic()
            self._save(is_due=is_due)
        return closing and not len(self._ring)

    def _save(self, *, is_due: bool) -> None:
        """Save what is new in the sidecar; after a failure only each second."""
        file = self._writer.sidecar
        if is_due or not file.retry.reason:
            file.save()

    def _move_marks(self) -> None:
        """Put the marks of other threads into the sidecar."""
        while self._marks:
            try:
                self._writer.sidecar.add("marks", self._marks.popleft().as_dict())
            except ValueError as error:  # there is no room for more
                self._message(f"{self.path.name}: a mark is in no file: {error}")

    def _write_earlier(self) -> bool:
        """Write the samples that were read before; return False if that failed."""
        earlier = self._earlier  # `begin` may set it at any moment, once
        if len(earlier):
            if not self._writer.write(earlier):
                return False
            self._earlier = earlier[:0]
        return True

    def _report(self) -> None:
        """Say once that writing fails, and once that it works again."""
        disk = self._writer.disk.change()
        if disk == "fails":
            self._message(self.rows_trouble)
        elif disk == "works" and not self._gap.rows:
            self._message(f"{self.path.name}: is written again")
        sidecar_file = self._writer.sidecar
        beside = sidecar_file.retry.change()
        if beside == "fails":
            self._message(self.sidecar_trouble)
        elif beside == "works":
            self._message(f"{sidecar_file.path.name}: is written again, with all notes and marks")

    def _message(self, text: str) -> None:
        with suppress(Exception):  # what shows messages never ends a recording
            self._notify(text)


@dataclass(frozen=True)
class _LostRows:
    """Rows that had no room in the queue, one after the other, and why."""

    rows: int = 0
    reason: str = ""

    @property
    def text(self) -> str:
        """The text of the mark."""
        return f"{self.rows:,} rows are missing: {self.reason}"


def capacity_for(period_s: float, seconds: float = _HANGS_S, least: int = CAPACITY) -> int:
    """Return the room for the samples of some seconds; with an unknown period of 0 the least."""
    count = least
    if period_s:
        count = max(least, round(seconds / period_s))
    return min(count, _MOST)
