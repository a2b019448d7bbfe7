"""The recordings of a stream, as its caller begins, marks and ends them."""

import os
from threading import RLock
from typing import Any

from palpate._core import Tracker
from palpate.recording.recorder import Recorder
from palpate.recording.remarks import marked
from palpate.samples import Sample
from palpate.sources import Source
from palpate.stream.beginning import Memory
from palpate.stream.feeding import Feeding
from palpate.stream.reader import Reader
from palpate.stream.recording_slot import RecordingSlot


class RecordingStream:
    """That part of a `Stream` which is about its recordings: one at a time.

    Attributes
    ----------
    source : Source
    tracker : Tracker
    """

    source: Source
    tracker: Tracker
    _feeding: Feeding
    _recordings: RecordingSlot
    _memory: Memory | None

    def __init__(self) -> None:
        self._recording = RLock()  # held while a recording begins or ends
        self._seen: Sample | None = None  # by the caller, of a source that waits for the caller
        self._reader: Reader | None = None
        self._closed = self._raised = False

    @property
    def recorder(self) -> Recorder | None:
        """The recorder; None: no recording."""
        return self._recordings.recorder

    def start_recording(
        self, record: str | os.PathLike[str], notes: list[str] | None = None, *, earlier: bool = False
    ) -> Recorder:
        """Record to NAME.csv; from any thread.

        Parameters
        ----------
        record : path-like
        notes : list of str, optional
        earlier : bool
            Begin with the samples that are kept (`keep` of the stream), with the begin of the measurement, if it is still
            there: a replay has the same touches, bit for bit. Else begin with the first reading of the oldest baseline that
            was measured again, after a release, a tare or a gap: all touches after it have the same bits, but for their
            number `start`. Without such a place, or with times of the computer (scene "handheld" and "sliding"), they agree
            within their uncertainty; a note in the recording says which. The next recording begins at the last such place
            before the end of this one, so that no sample is missing between them.

            False: begin with the next sample. A replay measures the baseline there: begin without contact.

        Raises
        ------
        ValueError, RecordingError
            A recording is running, the stream has ended, the file exists, or no samples are kept.
        """
        reader = self._begun()
        if earlier and not self._memory:
            raise ValueError("earlier: got True, allowed: with Stream(..., keep=65536), which keeps so many samples")
        with self._recording:
            if self._closed or self.recorder:
                raise ValueError("record: already recording, or the stream has ended; allowed: one recording at a time")
            return self._recordings.begin(reader.intake, record, notes or [], self._memory if earlier else None)

    def stop_recording(self) -> Recorder | None:
        """Close the recording and continue the measurement; from any thread. None: there was no recording.

        Raises
        ------
        RecordingError
            A sample that was read could not be recorded.
        """
        reader = self._begun()
        with self._recording:
            return None if self._closed else self._recordings.end(reader.intake)

    def note(self, text: str) -> None:
        """Add a note to the recording."""
        with self._recordings.lock:
            if self.recorder:
                self.recorder.note(text)

    def mark(self, text: str, t_s: float | None = None) -> int | None:
        """Add a mark to the recording, at the last sample that was read; of a file, at the one that the caller has.

        Parameters
        ----------
        text : str
        t_s : float, optional
            Another time, s, on the clock of the samples, not before the first one of the recording.

        Returns
        -------
        int or None
            Its number, for `rename_mark`; None: there is no recording.

        Raises
        ------
        ValueError
            The recording began after `t_s`, or has no room for more marks.
        """
        with self._recordings.lock:
            if not self.recorder:
                return None
            if t_s is not None:
                return self.recorder.mark_at(t_s, text)
            seen = None if self.source.live else self._seen
            return self.recorder.mark(text, seen or self._begun().intake.last)

    def rename_mark(self, number: int, text: str) -> None:
        """Give a mark of the running recording another text.

        Raises
        ------
        ValueError
            There is no recording, or no such mark in it.
        """
        with self._recordings.lock:
            if not self.recorder:
                raise ValueError(f"mark: got number {number}, allowed: those of a running recording; there is none")
            self.recorder.rename_mark(number, text)

    def tare(self, *, force: bool = False) -> None:
        """Measure the baseline again, and mark it in the recording; from the thread that iterates.

        Parameters
        ----------
        force : bool
            Also in contact: after a jump of the baseline, which looks like a touch without end.

        Raises
        ------
        RuntimeError
            The probe is in contact, and `force` is False.
        """
        with self._feeding.lock, self._recordings.lock:
            self.tracker.tare(force)
            if self._reader and self._feeding.last:
                recorder = self._keep_mark(self._reader, marked("tare", self._feeding.last, tare=True))
                if recorder:
                    recorder.mark("tare", self._feeding.last, tare=True)

    def _keep_mark(self, reader: Reader, mark: dict[str, Any]) -> Recorder | None:
        """Keep a mark for a later recording; return the one that is running, which has to get it."""
        with reader.intake.lock:
            if self._memory:
                self._memory.kept.marks.append(mark)
            return self.recorder

    def _begun(self) -> Reader:
        if self._reader is None:
            raise ValueError("stream: not started, allowed: with palpate.Stream(...) as stream")
        return self._reader

    def _close_recording(self, error: BaseException | None) -> None:
        with self._recording:
            self._recordings.close(error or (self._reader.error if self._reader else None))

    def _raise_unrecorded(self) -> None:
        if self.recorder and self.recorder.error and not self._raised:
            raise self.recorder.error
