"""The recordings of a measurement, one at a time: their begin and end, notes and marks."""

import os
from collections.abc import Callable
from threading import RLock

import numpy as np

from palpate._core import Tracker
from palpate.recording.recorder import Recorder
from palpate.recording.sidecar import BEGUN, SidecarMark
from palpate.samples import DTYPE, Sample
from palpate.sources import Source
from palpate.sources.base import described
from palpate.stream.buffers import NO_BASELINE, Backlog, BacklogStart
from palpate.stream.counters import StreamCounters
from palpate.stream.reader import Reader

_LONGEST_ERROR = 2000  # characters in the sidecar


class RecordingControl:
    """Begins and ends the recordings of a measurement; its methods may be called from any thread.

    Attributes
    ----------
    recorder : Recorder or None
        The recorder; None: no recording.
    is_ended : bool
        Whether the measurement ends: no recording may begin any more.
    """

    def __init__(
        self,
        source: Source,
        tracker: Tracker,
        reader: Reader,
        backlog: Backlog | None,
        counters: Callable[[], StreamCounters],
        notify: Callable[[str], object],
    ) -> None:
        self.recorder: Recorder | None = None
        self.is_ended = False
        self._source = source
        self._tracker = tracker
        self._reader = reader
        self._backlog = backlog
        self._counters = counters
        self._notify = notify
        self._before = StreamCounters()  # when the recording began
        self._recorded: int | None = None  # number of the last sample of the recording before
        self._switching = RLock()  # held while a recording begins or ends: that waits for the disk
        # Held while notes and marks are written; taken before the lock of the reader.
        self._marking = RLock()

    def start(
        self, path: str | os.PathLike[str], notes: list[str], *, earlier: bool = False
    ) -> Recorder:
        """Record from now on, or with the backlog; errors as in `Stream.start_recording`."""
        if earlier and not self._backlog:
            raise ValueError(
                "earlier: got True, allowed: with Stream(..., keep=65536), "
                "which keeps so many samples"
            )
        with self._switching:
            if self.is_ended or self.recorder:
                raise ValueError(
                    "record: already recording, or the stream has ended; "
                    "allowed: one recording at a time"
                )
            recorder = Recorder(
                path,
                described(self._source),
                {"scene": self._tracker.scene, **self._tracker.settings},
                notes,
                zero_ns=lambda: self._reader.zero_ns,
                notify=self._notify,
            )
            with self._reader.lock:
                start = self._backlog_start(earlier=earlier)
                recorder.begin(*start)
                self._before = self._counters().without(start.block)
                self.recorder = recorder
                self._reader.record(recorder)
            return recorder

    def _backlog_start(self, *, earlier: bool) -> BacklogStart:
        if earlier and self._backlog:
            host_stamps = bool(self._tracker.settings.get("host_stamps", False))
            return self._backlog.start_after(self._recorded, host_stamps=host_stamps)
        note = ""
        if self._reader.read:
            note = f"{BEGUN}{self._reader.read} pairs; {NO_BASELINE}"
        return BacklogStart(np.empty(0, DTYPE), [], note)

    def stop(self) -> Recorder | None:
        """Close the recording; None: there was none. RecordingError as in `Stream`."""
        with self._switching:
            recorder = self.recorder
            if self.is_ended or recorder is None:
                return None
            with self._marking, self._reader.lock:
                counters = self._counters()
                last = self._reader.last
                self._recorded = last.seq if last else None
                self.recorder = None  # before it closes, which takes time: no mark of it is late
                self._reader.record(None)
            recorder.close(lambda: self._counts(counters, recorder))
            if recorder.error:
                self._recorded = None  # the next one has all that is kept
                raise recorder.error
            return recorder

    def close(self, error: BaseException | None) -> None:
        """Close the recording at the end of the measurement, which this error has ended."""
        with self._switching:
            recorder = self.recorder
            if not recorder:
                return
            error_text = None
            if error is not None and error is not recorder.error:  # the recorder has its own error
                error_text = f"{str(error) or type(error).__name__:.{_LONGEST_ERROR}}"
            recorder.close(lambda: self._counts(self._counters(), recorder), error_text)

    def _counts(self, counters: StreamCounters, recorder: Recorder) -> dict[str, int]:
        """Return the counters of the samples since the recording began."""
        rows = {"recorded": recorder.rows, "unrecorded": recorder.dropped}
        return counters.since(self._before) | rows

    def tare(self, last: Sample | None, *, force: bool) -> None:
        """Measure the baseline again after this sample, and mark it; RuntimeError: in contact."""
        with self._marking:
            self._tracker.tare(force)
            if not last:
                return
            with self._reader.lock:  # a recording that begins now has the mark from the backlog
                if self._backlog:
                    self._backlog.marks.append(SidecarMark.at(last, "tare", "tare"))
                recorder = self.recorder
            if recorder:
                recorder.mark_later(SidecarMark.at(last, "tare", "tare"))

    def note(self, text: str) -> None:
        """Add a note to the recording."""
        with self._marking:
            if self.recorder:
                self.recorder.note(text)

    def mark(self, text: str, sample: Sample | None, t_s: float | None) -> int | None:
        """Add a mark at a time, s, else at a sample; return its number. None: no recording."""
        with self._marking:
            if not self.recorder:
                return None
            if t_s is not None:
                return self.recorder.mark_at(t_s, text)
            return self.recorder.mark(text, sample)

    def rename_mark(self, number: int, text: str) -> None:
        """Give a mark another text; ValueError: there is no such mark."""
        with self._marking:
            if not self.recorder:
                raise ValueError(
                    f"mark: got number {number}, allowed: those of a running recording; "
                    "there is none"
                )
            self.recorder.rename_mark(number, text)
