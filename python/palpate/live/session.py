"""The measurement behind the page: in a thread of its own, which no page can make wait."""

import time
from collections.abc import Callable
from math import nan
from threading import Event, Lock, Thread
from typing import Any, NamedTuple

from palpate._core import Touch
from palpate.live.feed import Rows, rows_of
from palpate.live.protocol import Command, Refused
from palpate.live.recordings import Recordings
from palpate.sources import Source
from palpate.stream import Stream
from palpate.stream.estimate import Batch, StreamCounters

_PAUSE_S = 1 / 60  # from batch to batch: a page is drawn half as often
_UNREAD = 4096  # batches: a minute of a server that stands still
_MESSAGES = 8


class Moment(NamedTuple):
    """What the tracker said last: its state ("ended" after it), ratio, standard error; an alarm since the last time."""

    state: str = "baseline"
    ratio: float = nan
    standard_error: float = nan
    alarm: bool = False


class Session:
    """One measurement after another, on one source.

    Parameters
    ----------
    open_source : callable
        Returns the source, opened anew.
    recordings : Recordings
    how : dict
        `Stream`'s scene and settings.

    Attributes
    ----------
    number : int
        Which measurement it is, counted from 1.
    stream : Stream
    touches : list of Touch
        Those that have ended.
    moment : Moment
    error : str
        Why the measurement ended, where that was not asked for.
    messages : list of str
        What the source had to tell, newest last.
    marks : list of (float, str)
        Time, s, and text.
    """

    def __init__(self, open_source: Callable[[], Source], recordings: Recordings, how: dict[str, Any]) -> None:
        self.recordings = recordings
        self.number: int = 0
        self.touches: list[Touch] = []
        self.marks: list[tuple[float, str]] = []
        self.messages: list[str] = []
        self.moment: Moment = Moment()
        self.error: str = ""
        self._open, self._how = open_source, how
        self._commands, self._batches = Lock(), Lock()
        self._unread: list[Rows] = []
        self._tare = Event()
        self._last_s = 0.0

    def start(self) -> None:
        """Begin to measure; where a recording is allowed, begin to record.

        Raises
        ------
        ValueError, PalpateError
            As `Stream` does.
        """
        record = self.recordings.next() if self.recordings.allowed else None
        try:
            stream = Stream(self._open(), record=record, notify=self._note, **self._how)
            stream.__enter__()
        except BaseException:
            if record:
                self.recordings.forget(record)
            raise
        with self._batches:
            self.stream: Stream = stream
            self.number += 1
            self.touches, self.marks, self._unread = [], [], []
            self.moment, self.error = Moment(), ""
            self._tare.clear()
        self._thread = Thread(target=self._run, args=[stream], name="palpate-session", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop measuring; close the recording."""
        with self._commands:
            self.stream.stop()
            self._thread.join()

    def take(self) -> list[Rows]:
        """Return what has been measured since the last call."""
        with self._batches:
            unread, self._unread = self._unread, []
            return unread

    def do(self, command: Command) -> str:
        """Obey a page; return what was done, as a sentence. May wait for a disk.

        Raises
        ------
        Refused
            Not now; the text says why.
        ValueError, PalpateError
            As `Stream` does.
        """
        orders = {"tare": self._do_tare, "record": self._do_record, "stop": self._do_stop, "again": self._do_again}
        with self._commands:
            return self._do_mark(command.text) if command.do == "mark" else orders[command.do]()

    @property
    def running(self) -> bool:
        """Whether it measures."""
        return self.moment.state != "ended"

    @property
    def counters(self) -> StreamCounters:
        """What became of the samples."""
        return self.stream.counters

    def _require_running(self, what: str) -> None:
        if not self.running:
            raise Refused(f"{what}: got a measurement that has ended, allowed: while it runs")

    def _pressed(self) -> bool:
        return self.moment.state in ("contact", "adapting", "done")

    def _do_tare(self) -> str:
        self._require_running("tare")
        self._tare.set()
        warning = " It was in contact: lift the probe, and tare again." if self._pressed() else ""
        return "The baseline is measured anew: touch nothing." + warning

    def _do_mark(self, text: str) -> str:
        self._require_running("mark")
        if not self.stream.recorder:
            raise Refused("mark: got no recording, allowed: while one is made")
        self.stream.mark(text)
        with self._batches:
            self.marks = [*self.marks, (self._last_s, text)][-200:]
        return f"Marked: {text}"

    def _do_record(self) -> str:
        self._require_running("record")
        if self.stream.recorder:
            raise Refused("record: got a second recording, allowed: one at a time")
        path = self.recordings.next()
        try:
            self.stream.start_recording(path)
        except BaseException:
            self.recordings.forget(path)
            raise
        warning = ", begun in contact: its replay has no baseline for this touch" if self._pressed() else ""
        return f"Recording to {path}{warning}"

    def _do_stop(self) -> str:
        recorder = self.stream.stop_recording()
        if recorder is None:
            raise Refused("stop: got no recording, allowed: while one is made")
        return f"{recorder.path.name}: {recorder.rows} rows; closed"

    def _do_again(self) -> str:
        if self.running:
            raise Refused("again: got a measurement that runs, allowed: when it has ended")
        self._thread.join()
        self.start()
        return "Measuring again, from the start."

    def _note(self, message: str) -> None:
        self.messages = [*self.messages, message][-_MESSAGES:]

    def _run(self, stream: Stream) -> None:
        failures = [self._attempt(lambda: self._measure(stream)), self._attempt(stream.close)]
        with self._batches:
            self.touches = stream.touches
            self.error = next(filter(None, failures), "")
            self.moment = self.moment._replace(state="ended")

    @staticmethod
    def _attempt(step: Callable[[], None]) -> str:
        try:
            step()
        except Exception as error:  # noqa: BLE001  whatever a source raises is the user's to see
            return str(error) or type(error).__name__
        return ""

    def _measure(self, stream: Stream) -> None:
        for batch in stream.batches():
            if self._tare.is_set():
                self._tare.clear()
                stream.tare()
                self._take(batch, stream, ended=True)
            else:
                self._take(batch, stream, ended=len(batch.touches) > 0)
            time.sleep(_PAUSE_S)

    def _take(self, batch: Batch, stream: Stream, *, ended: bool) -> None:
        rows = rows_of(batch)
        with self._batches:
            self._unread = [*self._unread, rows][-_UNREAD:]
            tracker, alarm = stream.tracker, bool(batch.rows["alarm"].any())
            self.moment = Moment(tracker.state, tracker.ratio, tracker.standard_error, alarm)
            if len(rows):
                self._last_s = float(rows["t_s"][-1])
            if ended:
                self.touches = stream.touches
