"""The measurement behind the page: in its own thread, which never waits for a page."""

import time
from collections.abc import Callable
from math import nan
from threading import Event, Lock, Thread
from typing import Any, NamedTuple

from palpate._core import Touch
from palpate.errors import PalpateError, RecordingError
from palpate.live.feed import ends_of, rows_of
from palpate.live.levels import Levels
from palpate.live.protocol import Command, Refused
from palpate.live.recordings import Recordings
from palpate.lsl import Outlets
from palpate.recording.recorder import Recorder
from palpate.sources import Source
from palpate.stream import Stream
from palpate.stream.estimate import Batch, StreamCounters

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
        Opens the source and returns it.
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
    on_rows : callable
        Called in the thread of the measurement when there are new rows.
    error : str
        The error that ended the measurement; empty without an error.
    failed : bool
        Whether a recording failed in any of the measurements: the one written, or a file as the source.
    messages : list of str
        Messages of the source and of the stream, newest last.
    marks : list of (float, str)
        Time, s, and text.
    commands : threading.Lock
        Held while a command runs.
    """

    kind = "live"
    file: dict[str, Any] | None = None
    """Of a recording that is opened: what `hello` says of the file."""

    def __init__(
        self,
        open_source: Callable[[], Source],
        recordings: Recordings,
        how: dict[str, Any],
        tell: Callable[[str], object] = lambda _: None,
        lsl: str | None = None,
    ) -> None:
        self.recordings = recordings
        self.number: int = 0
        self.touches: list[Touch] = []
        self.marks: list[tuple[float, str]] = []
        self.messages: list[str] = []
        self.moment: Moment = Moment()
        self.on_rows: Callable[[], None] = lambda: None
        self.error: str = ""
        self.failed: bool = False
        self._open, self._how, self._tell = open_source, how, tell
        self.commands: Any = Lock()
        self._batches = Lock()
        self.ends: dict[int, float] = {}
        self.levels: Levels = Levels()
        self._tare, self._forced = Event(), Event()
        self._last_s = 0.0
        self._lsl = lsl
        self._outlets: Outlets | None = None

    def start(self) -> None:
        """Start to measure and, if recording is allowed, to record.

        Raises
        ------
        ValueError, PalpateError
            As `Stream` does.
        """
        record = self.recordings.next() if self.recordings.allowed else None
        try:
            stream = Stream(self._open(), record=record, notify=self._note, **self._how)
            self._send_from(stream)
            stream.__enter__()
        except BaseException:
            if record:
                self.recordings.forget(record)
            raise
        with self._batches:
            self.stream: Stream = stream
            self.number += 1
            self.touches, self.marks, self.ends, self.levels = [], [], {}, Levels()
            self.moment, self.error = Moment(), ""
            self._tare.clear()
            self._forced.clear()
        self._thread = Thread(target=self._run, args=[stream], name="palpate-session", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop the measurement and close the recording."""
        with self.commands:
            self.stream.stop()
            self._thread.join()
            if self._outlets:
                self._outlets.close()

    @property
    def orders(self) -> dict[str, Callable[[Command], str]]:
        """What a page may order: name of the command -> function; they may wait for the disk."""
        return {
            "tare": lambda _: self._do_tare(),
            "tare anyway": lambda _: self._do_force(),
            "record": lambda _: self._do_record(),
            "stop": lambda _: self._do_stop(),
            "again": lambda _: self._do_again(),
            "mark": lambda _: self._do_mark("mark"),
        }

    @property
    def running(self) -> bool:
        """Whether the measurement runs."""
        return self.moment.state != "ended"

    @property
    def zero_utc_ns(self) -> int | None:
        """UTC of t = 0, ns since 1970; None: unknown."""
        epoch = self.stream.epoch
        return epoch and epoch.utc_ns

    @property
    def counters(self) -> StreamCounters:
        """Numbers of samples read, used, dropped and lost."""
        return self.stream.counters

    def _require_running(self, what: str) -> None:
        if not self.running:
            raise Refused(f"{what}: the measurement has ended; press Measure again first")

    def _pressed(self) -> bool:
        return self.moment.state in ("contact", "adapting", "done")

    def _do_tare(self) -> str:
        self._require_running("tare")
        if self._pressed():
            raise Refused("tare: the probe is in contact; lift it first. If nothing is touched, press Tare anyway")
        self._tare.set()
        return "Measuring the baseline: do not touch anything."

    def _do_force(self) -> str:
        self._require_running("tare")
        self._forced.set()
        self._tare.set()
        return "Measuring the baseline: do not touch anything."

    def _do_mark(self, text: str) -> str:
        self._require_running("mark")
        if not self.stream.recorder:
            raise Refused("mark: no recording is running; press Record first")
        self.stream.mark(text)
        if self._outlets:
            self._outlets.mark("mark", text)
        with self._batches:
            self.marks = [*self.marks, (self._last_s, text)][-200:]
        return f"Marked: {text}"

    def _do_record(self) -> str:
        self._require_running("record")
        if self.stream.recorder:
            raise Refused("record: a recording is already running; stop it first")
        path = self.recordings.next()
        try:
            self.stream.start_recording(path)
        except BaseException:
            self.recordings.forget(path)
            raise
        warning = "; it starts during contact, so a replay has no baseline for this touch" if self._pressed() else ""
        return f"Recording to {path}{warning}"

    def _do_stop(self) -> str:
        try:
            recorder = self.stream.stop_recording()
        except PalpateError as error:
            self.failed = True
            self._tell(f"Error: {error}")
            raise
        if recorder is None:
            raise Refused("stop: no recording is running")
        return self._closed(recorder)

    def _closed(self, recorder: Recorder) -> str:
        line = f"{recorder.path.name}: {recorder.rows} rows; file closed"
        self._tell(line)
        return line

    def _do_again(self) -> str:
        if self.running:
            raise Refused("again: the measurement still runs")
        self._thread.join()
        self.start()
        return "A new measurement has started."

    def _note(self, message: str) -> None:
        self.messages = [*self.messages, message][-_MESSAGES:]
        self._tell(message)

    def _run(self, stream: Stream) -> None:
        failures = [self._attempt(lambda: self._measure(stream)), self._attempt(stream.close)]
        with self._batches:
            self.touches = stream.touches
            self.error = "; ".join(dict.fromkeys(str(e) or type(e).__name__ for e in failures if e))
            self.failed |= any(isinstance(e, RecordingError) for e in failures)
            self.moment = self.moment._replace(state="ended")
        if stream.recorder:
            self._closed(stream.recorder)
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
        if self._outlets:
            self._outlets.follow(stream)
        elif self._lsl is not None:
            self._outlets = Outlets(stream, self._lsl)

    def _measure(self, stream: Stream) -> None:
        for batch in stream.batches():
            if self._outlets:
                self._outlets.send(batch)
            tared = self._tare.is_set()
            if tared:
                self._measure_baseline(stream)
            self._take(batch, stream, changed=tared or bool(batch.touches or batch.revised))
            self.on_rows()
            if stream.counters.waiting < _BEHIND:
                time.sleep(_PAUSE_S)

    def _measure_baseline(self, stream: Stream) -> None:
        self._tare.clear()
        forced = self._forced.is_set()
        self._forced.clear()
        try:
            stream.tare(force=forced)
            if self._outlets:
                self._outlets.mark("tare")
        except RuntimeError as refusal:  # pressed after the command
            self._note(str(refusal))

    def _take(self, batch: Batch, stream: Stream, *, changed: bool) -> None:
        rows = rows_of(batch)
        with self._batches:
            self.levels.add(rows)
            self.ends |= ends_of(batch)
            tracker, alarm = stream.tracker, bool(batch.rows["alarm"].any())
            self.moment = Moment(tracker.state, tracker.ratio, tracker.standard_error, alarm)
            if len(rows):
                self._last_s = float(rows["t_s"][-1])
            if changed:
                self.touches = stream.touches
