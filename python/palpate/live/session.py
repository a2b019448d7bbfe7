"""The measurement behind the page: in its own thread, which never waits for a page."""

import time
from collections.abc import Callable
from math import nan
from threading import Lock, Thread
from typing import Any, NamedTuple

from palpate._core import Touch
from palpate.errors import PalpateError, RecordingError
from palpate.live.feed import ends_of, rows_of
from palpate.live.levels import Levels
from palpate.live.protocol import Command, Refused
from palpate.live.recordings import Recordings
from palpate.lsl import Outlets
from palpate.recording.recorder import Recorder
from palpate.samples import Sample, samples_of
from palpate.sources import Source
from palpate.stream import Stream
from palpate.stream.estimate import Batch, StreamCounters

KEPT = 1 << 16
"""Samples that a later recording begins with, at most: 28 min at 38 pairs a second."""
_PAUSE_S = 1 / 120  # after a batch: the next pair of a slow source comes later, those of a fast one come together
_BEHIND = 256  # pairs that wait: no pause
_MESSAGES = 8


class Moment(NamedTuple):
    """State of the tracker ("ended" after the measurement), ratio, standard error, and alarm in the last batch."""

    state: str = "baseline"
    ratio: float = nan
    standard_error: float = nan
    alarm: bool = False


class Session:
    """Consecutive measurements with one source.

    Parameters
    ----------
    open_source : callable
        Opens the source and returns it; options that were changed come as keywords.
    recordings : Recordings
    how : dict
        Scene and settings of `Stream`.
    tell : callable, optional
        Called with each message and each error when it comes, and with a line for each recording that is closed.
    lsl : str, optional
        Name of the streams of Lab Streaming Layer that the measurements are sent to.

    Attributes
    ----------
    number : int
        Number of the measurement, counted from 1.
    stream : Stream
    touches : list of Touch
        The completed touches; a revised one in place of its first result.
    ends : dict
        Number of a touch -> time of its last sample, s.
    levels : Levels
        The rows.
    moment : Moment
    last : Sample or None
        The last sample that was estimated.
    on_rows : callable
        Called when there are rows to take or a message came; from any thread.
    followers : list of callable
        Called in the thread of the measurement with each batch and the stream; the last batch comes before the
        recording is closed.
    begun : list of callable
        Called with each recorder when its recording has begun.
    records : bool
        Whether this measurement, and so the next one, is recorded.
    error : str
        The error that ended the measurement; empty without an error.
    failed : bool
        Whether a recording failed in any of the measurements: the one written, or a file as the source.
    messages : list of str
        Messages of the source and of the stream, newest last.
    outlets : Outlets or None
        To Lab Streaming Layer.
    commands : threading.Lock
        Held while a command runs.
    """

    kind = "live"
    file: dict[str, Any] | None = None
    """Of a recording that is opened: what `hello` says of the file."""

    def __init__(
        self,
        open_source: Callable[..., Source],
        recordings: Recordings,
        how: dict[str, Any],
        tell: Callable[[str], object] = lambda _: None,
        lsl: str | None = None,
    ) -> None:
        self.recordings = recordings
        self.number: int = 0
        self.touches: list[Touch] = []
        self.messages: list[str] = []
        self.moment: Moment = Moment()
        self.last: Sample | None = None
        self.on_rows: Callable[[], None] = lambda: None
        self.followers: list[Callable[[Batch, Stream], None]] = []
        self.begun: list[Callable[[Recorder], None]] = []
        self.records: bool = recordings.allowed
        self.error: str = ""
        self.failed: bool = False
        self.outlets: Outlets | None = None
        self._options: dict[str, Any] = {}
        self.commands: Any = Lock()
        self._open, self._how, self._tell = open_source, how, tell
        self._batches = Lock()
        self.ends: dict[int, float] = {}
        self.levels: Levels = Levels()
        self._lsl = lsl

    def start(self) -> None:
        """Start to measure and, if the measurement before was recorded or the user has named a file, to record.

        Raises
        ------
        ValueError, PalpateError
            As `Stream` does.
        """
        record = self.recordings.next() if self.records else None
        try:
            stream = Stream(
                self._open(**self._options),
                record=record,
                keep=KEPT,
                outlives_recording=True,
                notify=self.say,
                **self._how,
            )
            self._send_from(stream)
            stream.__enter__()
        except BaseException:
            if record:
                self.recordings.forget(record)
            raise
        with self._batches:
            self.stream: Stream = stream
            self.number += 1
            self.touches, self.ends, self.levels = [], {}, Levels()
            self.moment, self.error, self.last = Moment(), "", None
        if stream.recorder:
            self.tell_begun(stream.recorder)
        self._thread = Thread(target=self._run, args=[stream], name="palpate-session", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop the measurement and close the recording."""
        with self.commands:
            self.stream.stop()
            self._thread.join()
            if self.outlets:
                self.outlets.close()

    def reopen(self, options: dict[str, Any], note: str) -> None:
        """End this measurement, and begin the next one with other options of the source; both recordings get the note.

        Raises
        ------
        ValueError, PalpateError
            As `start`: the measurement has ended then, and the next one has the options from before.
        """
        before, self._options = self._options, {**self._options, **options}
        self.stream.note(note)
        self.stream.stop()
        self._thread.join()
        try:
            self.start()
        except BaseException:
            self._options = before
            raise
        self.stream.note(note)

    def measured(self) -> tuple[int, list[Touch]]:
        """Return the number of the measurement and its touches."""
        with self._batches:
            return self.number, self.touches

    @property
    def orders(self) -> dict[str, Callable[[Command], str]]:
        """What a page may order: name of the command -> function."""
        return {"again": lambda _: self._do_again()}

    @property
    def running(self) -> bool:
        """Whether the measurement runs."""
        return self.moment.state != "ended"

    @property
    def last_s(self) -> float:
        """Time of the last sample that was estimated, s; 0 before the first one."""
        return self.last.t_hard_ns / 1e9 if self.last else 0.0

    @property
    def recorder(self) -> Recorder | None:
        """The recorder of the recording that runs; None: there is none."""
        return self.stream.recorder if self.running else None

    @property
    def zero_utc_ns(self) -> int | None:
        """UTC of t = 0, ns since 1970; None: unknown."""
        epoch = self.stream.epoch
        return epoch and epoch.utc_ns

    @property
    def counters(self) -> StreamCounters:
        """Numbers of samples read, used, dropped and lost."""
        return self.stream.counters

    def require_running(self, what: str) -> None:
        """Raise `Refused` if the measurement has ended."""
        if not self.running:
            raise Refused(f"{what}: the measurement has ended; press Measure again first")

    def say(self, message: str) -> None:
        """Show a message on the page, and tell it."""
        self.messages = [*self.messages, message][-_MESSAGES:]
        self._tell(message)
        self.on_rows()

    def tell_begun(self, recorder: Recorder) -> None:
        """Tell those who add to a recording that one has begun."""
        for add in self.begun:
            add(recorder)

    def tell_closed(self, recorder: Recorder) -> str:
        """Tell that a recording is closed; return the line."""
        line = f"{recorder.path.name}: {recorder.rows} rows; file closed"
        self._tell(line)
        return line

    def lost(self, recorder: Recorder, error: PalpateError) -> None:
        """Tell that a recording failed; the measurement goes on. A rescue recording is offered in its place."""
        self.failed, self.records = True, False
        if recorder.path.exists() and recorder.path.name not in self.recordings.names:
            self.recordings.made(recorder.path, "recording")
        self.say(f"Error: {error}")

    def _do_again(self) -> str:
        if self.running:
            raise Refused("again: the measurement still runs")
        self._thread.join()
        self.start()
        return "A new measurement has started."

    def _run(self, stream: Stream) -> None:
        failures = [self._attempt(lambda: self._measure(stream)), self._attempt(stream.close)]
        with self._batches:
            self.touches = stream.touches
            self.error = "; ".join(dict.fromkeys(str(e) or type(e).__name__ for e in failures if e))
            self.failed |= any(isinstance(e, RecordingError) for e in failures)
            self.moment = self.moment._replace(state="ended")
        self.on_rows()
        if stream.recorder:
            self.tell_closed(stream.recorder)
        if self.error:
            self._tell(f"Error: {self.error}")

    @staticmethod
    def _attempt(step: Callable[[], None]) -> Exception | None:
        try:
            step()
        except Exception as error:  # noqa: BLE001  the page shows any error of a source
            return error
        return None

    def _send_from(self, stream: Stream) -> None:
        """Send this measurement to Lab Streaming Layer, if that was asked for."""
        if self.outlets:
            self.outlets.follow(stream)
        elif self._lsl is not None:
            self.outlets = Outlets(stream, self._lsl)

    def _measure(self, stream: Stream) -> None:
        for batch in stream.batches():
            if self.outlets:
                self.outlets.send(batch)
            self._take(batch, stream)
            for follow in self.followers:
                follow(batch, stream)
            self.on_rows()
            if stream.counters.waiting < _BEHIND:
                time.sleep(_PAUSE_S)

    def _take(self, batch: Batch, stream: Stream) -> None:
        rows = rows_of(batch)
        with self._batches:
            self.levels.add(rows)
            self.ends |= ends_of(batch)
            tracker, alarm = stream.tracker, bool(batch.rows["alarm"].any())
            self.moment = Moment(tracker.state, tracker.ratio, tracker.standard_error, alarm)
            if len(rows):
                self.last = samples_of(batch.samples[-1:])[0]
            if batch.touches or batch.revised:
                self.touches = stream.touches
