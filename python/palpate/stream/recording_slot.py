"""The recordings of a running measurement: one at a time, or none."""

import os
from collections.abc import Callable
from threading import RLock

from palpate._core import Tracker
from palpate.recording.recorder import Recorder
from palpate.recording.sidecar import BEGUN
from palpate.sources import Source
from palpate.sources.claims import described
from palpate.stream.beginning import NO_BASELINE, Memory
from palpate.stream.counting import before
from palpate.stream.estimate import StreamCounters
from palpate.stream.intake import Intake

_LONGEST = 2000  # characters of an error in the sidecar


class RecordingSlot:
    """Begins and ends the recordings of a stream.

    Parameters
    ----------
    source : Source
    tracker : Tracker
    counters : callable
        Returns the `StreamCounters` of the stream.
    path : path-like, optional
        Path of the first recording, which begins with the measurement.
    notes : list of str
        Notes of the first recording.
    zero_ns : callable
        Returns `time.monotonic_ns()` at t = 0, once there is a sample; or None.

    Attributes
    ----------
    recorder : Recorder or None
        The recording that is running, or that was running when the stream was closed.
    lock : RLock
        Held while something is written beside the samples, so that the recording is not closed meanwhile. Before
        `Intake.lock`.
    """

    def __init__(
        self,
        source: Source,
        tracker: Tracker,
        counters: Callable[[], StreamCounters],
        path: str | os.PathLike[str] | None,
        notes: list[str],
        zero_ns: Callable[[], int | None],
    ) -> None:
        self.recorder: Recorder | None = None
        self.lock: RLock = RLock()
        self._source, self._tracker, self._counters = source, tracker, counters
        self._first, self._zero_ns = (path, notes), zero_ns
        self._before = StreamCounters()
        self._ended: int | None = None  # number of the last sample of the recording before

    def first(self) -> None:
        """Open the recording that begins with the measurement, if there is a path for it."""
        path, notes = self._first
        if path is not None:
            self.recorder = self._new(path, notes)

    def begin(
        self, intake: Intake, path: str | os.PathLike[str], notes: list[str], memory: Memory | None = None
    ) -> Recorder:
        """Record from the next sample on, or from the place in the memory on from which a replay has the same touches."""
        begun = [f"{BEGUN}{intake.read} pairs; {NO_BASELINE}"] if intake.read and not memory else []
        recorder = self._new(path, [*notes, *begun])
        with intake.lock:
            self._before = self._counters()
            if memory:
                beginning = memory.beginning(self._tracker, intake.read, self._ended)
                recorder.begin(*beginning)
                self._before = before(beginning.block, self._before)
            self.recorder = intake.recorder = recorder
        return recorder

    def end(self, intake: Intake) -> Recorder | None:
        """Close the recording and continue the measurement; None: there was no recording."""
        recorder = self.recorder
        if recorder is None:
            return None
        with self.lock, intake.lock:
            intake.recorder, counters = None, self._counters()
            self._ended = intake.last.seq if intake.last else None
            self.recorder = None  # before it closes, which takes time: a tare meanwhile is no mark in it
        recorder.close(lambda: self._counted(counters, recorder))
        if recorder.error:
            self._ended = None  # the next one has all that is kept
            raise recorder.error
        return recorder

    def close(self, error: BaseException | None) -> None:
        """Close the recording at the end of the measurement, and store the error that ended it."""
        if recorder := self.recorder:
            told = None if error is None or error is recorder.error else _told(error)  # the recorder knows its own
            recorder.close(lambda: self._counted(self._counters(), recorder), told)

    def _new(self, path: str | os.PathLike[str], notes: list[str]) -> Recorder:
        settings = {"scene": self._tracker.scene, **self._tracker.settings}
        return Recorder(path, described(self._source), settings, notes, zero_ns=self._zero_ns)

    def _counted(self, counters: StreamCounters, recorder: Recorder) -> dict[str, int]:
        """Return the counters of the samples since the recording began."""
        return counters.since(self._before) | {"recorded": recorder.rows, "unrecorded": recorder.dropped}


def _told(error: BaseException) -> str:
    """Return the text of an error for the recording, or its type if it has no text."""
    return f"{str(error) or type(error).__name__:.{_LONGEST}}"
