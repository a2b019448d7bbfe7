"""A measurement behind the page, in a thread of its own, which never waits for a page."""

import math
import time
from abc import abstractmethod
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import count
from math import nan
from pathlib import Path
from threading import Event, Lock, Thread
from typing import Any

import numpy as np

from palpate import sources
from palpate._core import Tracker
from palpate.errors import PalpateError, RecordingError
from palpate.files import Json
from palpate.live.multiresolution import MultiresolutionRows
from palpate.live.page_frames import ends_of, rows_of
from palpate.live.protocol import (
    FilesState,
    RefusedCommand,
    ReviewedFile,
    RunningRecording,
    ShownCounters,
)
from palpate.live.run_files import RunFiles
from palpate.recording.recorder import Recorder
from palpate.recording.session import Entry
from palpate.recording.session import Plan as StoredPlan
from palpate.recording.sidecar import Sidecar
from palpate.samples import Sample, samples_of
from palpate.sources import Source
from palpate.sources.options import is_path, split
from palpate.sources.simulated_hand import SimulatedHand, Truth
from palpate.stream import Batch, Listener, Stream
from palpate.stream.listeners import Listeners
from palpate.stream.lsl_outlets import Outlets
from palpate.touch import Touch

Keywords = Mapping[str, Any]
"""Keywords for functions of other rooms: of `Stream` and `Tracker`, or options of a source."""
MOST = 500  # marks of a measurement that the page shows; older ones are in the recording only
LONGEST_WAIT_S = 8.0  # of a simulation, for the first page
KEPT = 1 << 16  # samples that a later recording begins with, at most: 28 min at 38 pairs a second
# after a batch: the next pair of a slow source comes later, those of a fast one come together
_PAUSE_S = 1 / 120
_BEHIND = 256  # pairs that wait: no pause
PRESSED = ("contact", "done")  # states in contact
_TOUCHES_WANTED = 4  # of a specimen, in a new plan


@dataclass(frozen=True)
class TrackerState:
    """State of the tracker ("ended" after the measurement), ratio, standard error, and alarm in the last batch."""

    state: str = "baseline"
    ratio: float = nan
    standard_error: float = nan
    alarm: bool = False


@dataclass
class PageMark:
    """A mark: its number, its time and text; the sample at which it was stamped, and its number in a recording."""

    id: int
    t_s: float
    text: str = ""
    sample: Sample | None = None
    within: tuple[Recorder, int] | None = None


@dataclass(frozen=True)
class MarkAnswer:
    """The answer to a mark: its number, and the message."""

    id: int
    message: str


@dataclass(frozen=True)
class EndedRecording:
    """A recording that has ended; `first_s`: time of its first sample, `recorder`: None, of an earlier run."""

    path: Path
    first_s: float
    recorder: Recorder | None


class Measurement(Listener):
    """What the page shows: a measurement that runs, or a recording. Its parts listen to the same events.

    Attributes
    ----------
    files : RunFiles
    number : int
        Of the measurement, counted from 1.
    sidecar : Sidecar
        Of a recording that is shown.
    error : str
        That ended the measurement.
    failed : bool
        Whether a recording failed: the one written, or a file as the source.
    listeners : list of Listener
        The measurement itself, and its parts.
    recording_begun : list of callable
        Called with each new recorder.
    on_rows : callable
        Called from any thread when there is something to show.
    commands : threading.Lock
        Held while a command runs.
    notify : callable
        Shows a message in the terminal.
    touches : list of Touch
        Completed; a revised one in place of its first result.
    ends : dict
        Number of a touch -> time of its last sample, s.
    marks, tares : deque
        The newest marks; times after which the baseline was measured again, s.
    newest_recorder : Recorder or None
        Of this measurement, also after its end.
    hand : SimulatedHand or None
        Of a simulation that runs.
    """

    tracker: Tracker
    hand: SimulatedHand | None = None
    touches_wanted: int = _TOUCHES_WANTED  # of a specimen, in a plan without specimens

    def __init__(
        self, files: RunFiles, notify: Callable[[str], None], *, whole: bool = False
    ) -> None:
        self.files = files
        self.number: int = 0
        self.sidecar: Sidecar = Sidecar()
        self.error: str = ""
        self.failed: bool = False
        self.events = Listeners(notify)
        self.listeners: list[Listener] = self.events.all
        self.listeners.append(self)
        self.recording_begun: list[Callable[[Recorder], None]] = []
        self.on_rows: Callable[[], None] = _nothing
        self.commands = Lock()
        self.notify = notify
        self._whole = whole
        self._forget()

    def _forget(self) -> None:
        self.touches: list[Touch] = []
        self.ends: dict[int, float] = {}
        self.marks: deque[PageMark] = deque(maxlen=MOST)
        self.tares: deque[float] = deque(maxlen=MOST)
        self.levels: MultiresolutionRows = MultiresolutionRows(whole=self._whole)
        self.tracker_state: TrackerState = TrackerState()
        self.newest_recorder: Recorder | None = None

    @abstractmethod
    def start(self) -> None:
        """Begin to measure, or to read."""

    @abstractmethod
    def close(self) -> None:
        """Stop, and close what is open."""

    @abstractmethod
    def device(self) -> Json:
        """Return what the source, or the recording, says of the device."""

    @abstractmethod
    def recording_state(self) -> FilesState:
        """Return the recording that runs, the name of the next one, and all files."""

    @property
    @abstractmethod
    def last_s(self) -> float:
        """Time of the last sample that was estimated, s; 0 before the first one, and of a recording."""

    @property
    def file(self) -> ReviewedFile | None:
        """The recording that is shown; None: something is measured."""
        return None

    @property
    def recorder(self) -> Recorder | None:
        """The recorder of the recording that runs; None: there is none."""
        return None

    @property
    def ended_recording(self) -> EndedRecording | None:
        """The recording that has ended, for changes of its session; None: there is none."""
        return None

    def require_amendable(self) -> None:
        """Raise `RefusedCommand` if the session of a recording cannot be changed."""

    def stored_entries(self, plan: StoredPlan) -> list[Entry | None]:
        """Return what a plan says of each touch; None: nothing."""
        return [None] * len(self.touches)

    @property
    def truths(self) -> Sequence[Truth]:
        """The presses of a simulated hand so far and to come, in order; empty: it is no simulation."""
        return tuple(self.hand.truths) if self.hand else ()

    def batch(self, batch: Batch) -> None:
        """Keep the rows of a batch, and where its touches end."""
        rows = rows_of(batch)
        # times of a file may go back
        if self.levels.span:
            rows["t_s"] = np.maximum(rows["t_s"], self.levels.span[1])
        rows["t_s"] = np.maximum.accumulate(rows["t_s"])
        self.levels.add(rows)
        self.ends |= ends_of(batch)

    @property
    def running(self) -> bool:
        """Whether it is measured, or read, still."""
        return self.tracker_state.state != "ended"

    @property
    def state(self) -> str:
        """The state as the page names it."""
        tracker = self.tracker_state
        if tracker.state == "waiting":
            return "no contact"
        if tracker.state != "contact":
            return tracker.state
        has_error = self.tracker.scene in ("handheld", "sliding")
        if tracker.alarm or (has_error and math.isnan(tracker.standard_error)):
            return "adapting"
        return "contact"


class LiveMeasurement(Measurement):
    """Consecutive measurements with one source, and their recordings.

    `open_source` opens the source; options that were changed come as keywords. `settings`: scene and settings of `Stream`.
    `notify` gets each message and error, and a line for each recording that is closed. `lsl`: name of the streams of Lab
    Streaming Layer that the measurements are sent to. `first_page`: a simulation begins when it is set, or after some
    seconds.
    """

    def __init__(
        self,
        open_source: Callable[..., Source],
        files: RunFiles,
        settings: Keywords,
        notify: Callable[[str], None] = lambda _: None,
        lsl: str | None = None,
        *,
        first_page: Event | None = None,
    ) -> None:
        super().__init__(files, notify)
        self._first_page = first_page
        self.forced: bool = False  # the newest tare was to be done also in contact
        self.last: Sample | None = None  # that was estimated
        # whether this measurement, and so the next one, is recorded
        self.records: bool = files.first is not None
        self.outlets: Outlets | None = None
        self.settings = settings
        self._open = open_source
        self._lsl = lsl
        self._options: Keywords = {}
        self._tare: bool | None = None  # asked for, and whether also in contact
        self._mark_numbers = count(1)
        self.tracker_state = TrackerState("ended")  # until it starts

    def start(self, **options: Any) -> None:
        """Start to measure and, if the measurement before was recorded or the user has named a file, to record.

        Options of the source hold for later measurements, too. Raises what `Stream` raises.
        """
        stream = self._begin(options)
        self._thread = Thread(
            target=self._run, args=[stream], name="palpate-measurement", daemon=True
        )
        self._thread.start()

    def _begin(self, changed: Keywords) -> Stream:
        options = {**self._options, **changed}
        path = None
        if self.records:
            path = self.files.next()
        source = self._open(**options)
        if source.hand and self._first_page:
            source.hand.wait_for(self._first_page, LONGEST_WAIT_S)
        stream = Stream(
            source,
            record=path,
            keep=KEPT,
            outlives_recording=True,
            notify=self.notify,
            **self.settings,
        )
        if self.outlets:
            self.outlets.follow(stream)
        elif self._lsl is not None:
            self.outlets = Outlets(stream, self._lsl)
        for listener in self.listeners:
            stream.listen(listener)
        stream.__enter__()
        self._options = options
        if stream.recorder:
            self._begin_recording(stream.recorder)
        return stream

    def close(self) -> None:
        """Stop the measurement and close the recording."""
        with self.commands:
            self._halt()
            if self.outlets:
                self.outlets.close()

    def _halt(self) -> None:
        self.stream.stop()
        self._thread.join()

    def reopen(self, options: Keywords, note: str) -> None:
        """End this measurement, and begin the next one with other options of the source; both recordings get the note.

        Raises as `start`: the measurement has ended then, and the next one has the options from before.
        """
        self.stream.note(note)
        self._halt()
        self.start(**options)
        self.stream.note(note)

    def use(self, settings: Keywords, note: str) -> None:
        """Go on with these settings of the tracker: with another measurement, if one runs with other ones."""
        if settings != self.settings:
            self.settings = settings
            if self.running:
                self.reopen({}, note)

    def begun(self, stream: Stream) -> None:
        """Begin with the next measurement."""
        self.stream: Stream = stream
        self.tracker = stream.tracker
        self.hand = stream.source.hand
        self.error = ""
        self.last = None
        self._forget()
        self.number += 1

    def batch(self, batch: Batch) -> None:
        """Keep a batch; close a recording that failed: the measurement goes on."""
        super().batch(batch)
        tracker = self.tracker
        self.tracker_state = TrackerState(
            tracker.state, tracker.ratio, tracker.standard_error, bool(batch.rows["alarm"].any())
        )
        if len(batch.samples):
            self.last = samples_of(batch.samples[-1:])[0]
        if batch.touches or batch.revised:
            self.touches = self.stream.touches
        recorder = self.stream.recorder
        if recorder and recorder.error:
            with suppress(PalpateError):
                self._end_recording()
        force = self._tare
        self._tare = None
        if force is not None:
            self._tare_now(force=force)

    def _tare_now(self, *, force: bool) -> None:
        """Measure the baseline again, which only the thread of the measurement may do."""
        try:
            self.stream.tare(force=force)
        except RuntimeError as refusal:  # pressed after the command
            self.notify(str(refusal))
            return
        self.tares.append(self.last_s)
        if self.outlets:
            self.outlets.mark("tare")

    @property
    def last_s(self) -> float:
        """Time of the last sample that was estimated, s; 0 before the first one."""
        return self.last.t_hard_ns / 1e9 if self.last else 0.0

    @property
    def recorder(self) -> Recorder | None:
        """The recorder of the recording that runs; None: there is none."""
        return self.stream.recorder if self.running else None

    @property
    def ended_recording(self) -> EndedRecording | None:
        """The recording of this measurement that has ended; None: there is none, or it has no sample."""
        ended = self.newest_recorder
        if ended is None or ended.first_s is None:
            return None
        return EndedRecording(ended.path, ended.first_s, ended)

    def device(self) -> Json:
        """Return what the source says of itself."""
        return self.stream.source.describe()

    def require_running(self, command: str) -> None:
        """Raise `RefusedCommand` if the measurement has ended."""
        if not self.running:
            raise RefusedCommand(f"{command}: the measurement has ended; press Measure again first")

    def recording_state(self) -> FilesState:
        """Return the recording that runs, the counts, the name of the next one, and all files."""
        running = None
        recorder = self.recorder
        if recorder:
            seconds = None
            if recorder.first_s is not None:
                seconds = max(self.last_s - recorder.first_s, 0.0)
            running = RunningRecording(recorder.path.name, recorder.rows, seconds)
        return FilesState(
            running,
            ShownCounters(**self.stream.counters.as_dict()),
            self.files.next().name,
            self.files.named,
            self.files.progress,
            len(self.files.compared()),
        )

    def record(self, name: str | None = None) -> str:
        """Begin a recording, with the samples that are kept; return the message."""
        self.require_running("record")
        path = self.files.next(name)
        recorder = self.stream.start_recording(path, earlier=True)
        self._begin_recording(recorder)
        message = f"Recording to {path.name}"
        if recorder.first_s is not None and self.last_s - recorder.first_s >= 1:
            message += f"; it begins {self.last_s - recorder.first_s:.0f} s ago"
        return message

    def stop(self) -> str:
        """End the recording; return the message."""
        recorder = self.recorder
        if not recorder:
            raise RefusedCommand("stop: no recording is running")
        self._end_recording()
        return self._notify_closed(recorder)

    def again(self) -> str:
        """Begin the next measurement after one that has ended; return the message."""
        if self.running:
            raise RefusedCommand("again: the measurement still runs")
        self._thread.join()
        self.start()
        return "A new measurement has started."

    def tare(self, *, force: bool = False) -> str:
        """Ask for a tare; `force`: also in contact. Return the message."""
        self.require_running("tare")
        if not force and self.tracker_state.state in PRESSED:
            raise RefusedCommand(
                "tare: the probe is in contact; lift it first. If nothing is touched, press Tare anyway"
            )
        self.forced = force
        self._tare = force
        return "Measuring the baseline: do not touch anything."

    def mark(self) -> MarkAnswer:
        """Stamp a mark now, with the last sample that the page could show."""
        self.require_running("mark")
        if self.last is None:
            raise RefusedCommand("mark: no sample has come yet; wait a moment")
        mark = PageMark(next(self._mark_numbers), self.last_s, sample=self.last)
        recorder = self.recorder
        if recorder:
            self._put(mark, recorder)
        self.marks.append(mark)
        if self.outlets:
            self.outlets.mark("mark", "")
        message = "Marked." if recorder else "Marked; nothing is recorded yet."
        return MarkAnswer(mark.id, message + _waiting(recorder))

    def mark_text(self, id: int, text: str) -> MarkAnswer:
        """Give a mark its text."""
        mark = next((mark for mark in self.marks if mark.id == id), None)
        if mark is None:
            raise RefusedCommand(
                f"id: got {id}, allowed: one of the newest {MOST} marks of this measurement"
            )
        mark.text = text
        message = f"Marked: {text}" if text else "Marked."
        if mark.within and mark.within[0] is self.recorder:
            recorder, number = mark.within
            recorder.rename_mark(number, text)
            message += _waiting(recorder)
        elif mark.within:
            message += " Its recording is closed, and keeps the text it had."
        return MarkAnswer(id, message)

    def _put(self, mark: PageMark, recorder: Recorder) -> None:
        try:
            mark.within = (recorder, recorder.mark(mark.text, mark.sample))
        # a recording with 10,000 marks, or one that fails
        except (ValueError, PalpateError) as error:
            self.notify(str(error))

    def _begin_recording(self, recorder: Recorder) -> None:
        """Announce a recording; the marks that are within it, since it begins earlier, are put into it."""
        self.records = True
        self.newest_recorder = recorder
        self.files.made(recorder.path, "recording")
        for mark in self.marks.copy():
            if recorder.first_s is not None and mark.t_s >= recorder.first_s:
                self._put(mark, recorder)
        for add in self.recording_begun:
            add(recorder)

    def _notify_closed(self, recorder: Recorder | None) -> str:
        if recorder is None:
            return ""
        line = f"{recorder.path.name}: {recorder.rows} rows; file closed"
        self.notify(line)
        return line

    def _end_recording(self) -> None:
        """Close the recording; the next measurement has none."""
        self.records = False
        try:
            self.stream.stop_recording()
        except PalpateError as error:
            self.failed = True
            self.notify(f"Error: {error}")
            raise

    def _run(self, stream: Stream) -> None:
        errors = self._errors_of(stream)
        self.touches = stream.touches
        texts = [str(error) or type(error).__name__ for error in errors]
        self.error = "; ".join(dict.fromkeys(texts))
        self.failed |= any(isinstance(error, RecordingError) for error in errors)
        self.tracker_state = replace(self.tracker_state, state="ended")
        self.on_rows()
        self._notify_closed(stream.recorder)
        if self.error:
            self.notify(f"Error: {self.error}")

    def _errors_of(self, stream: Stream) -> list[Exception]:
        """Measure to the end of a stream, and close it; return what failed."""
        errors: list[Exception] = []
        for step in (self._measure, Stream.close):
            try:
                step(stream)
            except Exception as error:  # noqa: BLE001  the page shows any error of a source
                errors.append(error)
        return errors

    def _measure(self, stream: Stream) -> None:
        for _ in stream.batches():
            self.on_rows()
            if stream.counters.waiting < _BEHIND:
                time.sleep(_PAUSE_S)


def _nothing() -> None:
    """Do nothing."""


def _waiting(recorder: Recorder | None) -> str:
    """Return what an answer adds if a mark is not on the disk yet."""
    if recorder is None or not recorder.sidecar_trouble:
        return ""
    return f" {recorder.sidecar_trouble}."


def opener(source: str, keywords: Keywords) -> Callable[..., Source]:
    """Return a function that opens the source; simulations and files run in real time unless `speed` is given.

    Keywords of that function take the place of options with the same names.
    """
    scheme, address, given = split(source)
    options = dict(keywords)
    has_speed = bool({"speed", "paced"} & {*given, *options})
    waits = scheme in ("sim", "") or is_path(source)
    if waits and not has_speed:
        options["speed"] = 1
    if scheme == "demo":
        options["page"] = True

    def opened(**changed: Any) -> Source:
        if not changed:
            return sources.open(source, **options)
        return sources.open(f"{scheme}:{address}", **{**given, **options, **changed})

    return opened
