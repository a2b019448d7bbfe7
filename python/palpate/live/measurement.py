"""A measurement behind the page: one that runs, or a recording; in a thread of its own, which never waits for a page."""

import math
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from copy import copy
from dataclasses import dataclass
from itertools import count
from math import nan
from pathlib import Path
from threading import Event, Lock, Thread
from typing import Any, NamedTuple

import numpy as np

from palpate import sources
from palpate._core import Tracker
from palpate.errors import PalpateError, RecordingError
from palpate.live.feed import Document, RefusedCommand, Rows, ends_of, rows_of
from palpate.live.files import RunFiles
from palpate.live.levels import Levels
from palpate.recording.convert import RATE
from palpate.recording.counts import Survey
from palpate.recording.csv_reader import RecordingFile
from palpate.recording.opened import OpenedRecording
from palpate.recording.recorder import Recorder
from palpate.recording.sidecar import Sidecar
from palpate.recording.verification import verification_of
from palpate.samples import DTYPE, Block, Sample, feed, samples_of, usable_readings
from palpate.sources import Gap, GapCause, Source
from palpate.sources.options import split
from palpate.stream import Batch, Listener, Stream
from palpate.stream.listeners import Listeners
from palpate.stream.lsl_outlets import Outlets
from palpate.touch import Touch
from palpate.touch_readings.stiffening_watch import StiffeningWatch
from palpate.tracking import tracked, tracker_of

MOST = 500  # marks of a measurement that the page shows; older ones are in the recording only
KEPT = 1 << 16  # samples that a later recording begins with, at most: 28 min at 38 pairs a second
# after a batch: the next pair of a slow source comes later, those of a fast one come together
_PAUSE_S = 1 / 120
_BEHIND = 256  # pairs that wait: no pause
PRESSED = ("contact", "done")  # states in contact


class Moment(NamedTuple):
    """State of the tracker ("ended" after the measurement), ratio, standard error, and alarm in the last batch."""

    state: str = "baseline"
    ratio: float = nan
    standard_error: float = nan
    alarm: bool = False


@dataclass
class Mark:
    """A mark: its number, its time and text; the sample at which it was stamped, and its number in a recording."""

    id: int
    t_s: float
    text: str = ""
    sample: Sample | None = None
    within: tuple[Recorder, int] | None = None


class Measurement(Listener):
    """What the page shows of a measurement, from whichever source; its parts listen to the same events."""

    tracker: Tracker
    file: Any = None  # what the page says of a file that is shown; None: something is measured
    last_s: Any = (
        0.0  # time of the last sample that was estimated, s; 0 before the first one, and of a file
    )
    demo: bool = False  # a simulation that is explained, and begins again
    truths: Any = ()  # what a simulated hand presses on, in order: begin, s, true ratio and name, where there is one of it
    recorder: Any = None  # of the recording that runs; None: there is none

    def __init__(
        self, files: RunFiles, tell: Callable[[str], None], *, whole: bool = False
    ) -> None:
        self.files = files
        self.number: int = 0  # of the measurement, counted from 1
        self.sidecar: Sidecar = Sidecar()  # of a file that is shown
        self.error: str = ""  # that ended the measurement
        self.failed: bool = False  # a recording failed: the one written, or a file as the source
        self.events = Listeners(tell)
        self.listeners: list[Listener] = self.events.all  # the measurement itself, and its parts
        self.listeners.append(self)
        self.recording_begun: list[Callable[[Recorder], None]] = []
        # called from any thread when there is something to show
        self.on_rows: Callable[[], None] = lambda: None
        self.commands: Any = Lock()  # held while a command runs
        self.say, self._whole = tell, whole  # show a message in the terminal
        self._forget()

    def _forget(self) -> None:
        self.touches: list[Touch] = []  # completed; a revised one in place of its first result
        self.ends: dict[int, float] = {}  # number of a touch -> time of its last sample, s
        self.marks: deque[Mark] = deque(maxlen=MOST)
        # times after which the baseline was measured again, s
        self.tares: deque[float] = deque(maxlen=MOST)
        self.levels: Levels = Levels(whole=self._whole)
        self.moment: Moment = Moment()
        self.newest_recorder: Recorder | None = None  # of this measurement, also after its end

    def batch(self, batch: Batch) -> None:
        """Keep the rows of a batch, and where its touches end."""
        rows = rows_of(batch)
        last = self.levels.span[1] if self.levels.span else -math.inf
        # times of a file may go back
        rows["t_s"] = np.maximum.accumulate(np.maximum(rows["t_s"], last))
        self.levels.add(rows)
        self.ends |= ends_of(batch)

    @property
    def running(self) -> bool:
        """Whether it is measured, or read, still."""
        return self.moment.state != "ended"

    @property
    def state(self) -> str:
        """The state as the page names it."""
        moment = self.moment
        if moment.state != "contact":
            return "no contact" if moment.state == "waiting" else moment.state
        knows = self.tracker.scene in ("handheld", "sliding")
        return (
            "adapting"
            if moment.alarm or (knows and math.isnan(moment.standard_error))
            else "contact"
        )


class LiveMeasurement(Measurement):
    """Consecutive measurements with one source, and their recordings.

    `open_source` opens the source; options that were changed come as keywords. `how`: scene and settings of `Stream`.
    `tell` gets each message and error, and a line for each recording that is closed. `lsl`: name of the streams of Lab
    Streaming Layer that the measurements are sent to. `demo`: after a measurement with a simulation the next one begins,
    with another seed.
    """

    def __init__(
        self,
        open_source: Callable[..., Source],
        files: RunFiles,
        how: dict[str, Any],
        tell: Callable[[str], None] = lambda _: None,
        lsl: str | None = None,
        *,
        demo: bool = False,
    ) -> None:
        super().__init__(files, tell)
        self.demo = demo
        self.forced: bool = False  # the newest tare was to be done also in contact
        self.last: Sample | None = None  # that was estimated
        # whether this measurement, and so the next one, is recorded
        self.records: bool = files.first is not None
        self.outlets: Outlets | None = None
        self._open, self.how, self._lsl = open_source, how, lsl
        self._options: dict[str, Any] = {}
        self._tare: bool | None = None  # asked for, and whether also in contact
        self._mark_numbers = count(1)
        self.moment = Moment("ended")  # until it starts

    def start(self, **options: Any) -> None:
        """Start to measure and, if the measurement before was recorded or the user has named a file, to record.

        Options of the source hold for later measurements, too. Raises what `Stream` raises.
        """
        stream = self._begin(options)
        self._goes_on = self.demo
        self._thread = Thread(
            target=self._run, args=[stream], name="palpate-measurement", daemon=True
        )
        self._thread.start()

    def _begin(self, options: dict[str, Any]) -> Stream:
        options = {**self._options, **options, **({"seed": self.number} if self.demo else {})}
        path = self.files.next() if self.records else None
        source = self._open(**options)
        stream = Stream(
            source, record=path, keep=KEPT, outlives_recording=True, notify=self.say, **self.how
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
        self._goes_on = False  # before: a round that begins now sees it
        self.stream.stop()
        self._thread.join()

    def reopen(self, options: dict[str, Any], note: str) -> None:
        """End this measurement, and begin the next one with other options of the source; both recordings get the note.

        Raises as `start`: the measurement has ended then, and the next one has the options from before.
        """
        self.stream.note(note)
        self._halt()
        self.start(**options)
        self.stream.note(note)

    def use(self, how: dict[str, Any], note: str) -> None:
        """Go on with these settings of the tracker: with another measurement, if one runs with other ones."""
        if how != self.how:
            self.how = how
            if self.running:
                self.reopen({}, note)

    def begun(self, stream: Stream) -> None:
        """Begin with the next measurement."""
        self.stream: Stream = stream
        self.tracker = stream.tracker
        self.truths = getattr(stream.source, "truths", ())
        self.error, self.last = "", None
        self._forget()
        self.number += 1

    def batch(self, batch: Batch) -> None:
        """Keep a batch; close a recording that failed: the measurement goes on."""
        super().batch(batch)
        tracker = self.tracker
        self.moment = Moment(
            tracker.state, tracker.ratio, tracker.standard_error, bool(batch.rows["alarm"].any())
        )
        if len(batch.samples):
            self.last = samples_of(batch.samples[-1:])[0]
        if batch.touches or batch.revised:
            self.touches = self.stream.touches
        if (recorder := self.stream.recorder) and recorder.error:
            with suppress(PalpateError):
                self._end_recording()
        asked, self._tare = self._tare, None
        if asked is not None:
            self._tare_now(force=asked)

    def _tare_now(self, *, force: bool) -> None:
        """Measure the baseline again, which only the thread of the measurement may do."""
        try:
            self.stream.tare(force=force)
        except RuntimeError as refusal:  # pressed after the command
            self.say(str(refusal))
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

    def device(self) -> Document:
        """Return what the source says of itself."""
        return self.stream.source.describe()

    def pressed(self, t_s: float, later: int = 0) -> str:
        """Return the name of what the simulated hand presses, or pressed last, at a time; or of what it presses so much later."""
        begun = sum(truth.start_s < t_s for truth in self.truths) + later
        return str(self.truths[begun - 1].name) if 0 < begun <= len(self.truths) else ""

    def require_running(self, what: str) -> None:
        """Raise `RefusedCommand` if the measurement has ended."""
        if not self.running:
            raise RefusedCommand(f"{what}: the measurement has ended; press Measure again first")

    def recording_state(self) -> Document:
        """Return the recording that runs, the name of the next one, and all files."""
        now, recorder = None, self.recorder
        if recorder:
            seconds = None if recorder.first_s is None else max(self.last_s - recorder.first_s, 0.0)
            now = {"name": recorder.path.name, "rows": recorder.rows, "seconds": seconds}
        files = {"proposed": self.files.next().name, **self.files.as_dict()}
        return {"recording": now, "counters": self.stream.counters.as_dict(), **files}

    def record(self, name: str | None = None) -> str:
        """Begin a recording, with the samples that are kept; return the message."""
        self.require_running("record")
        path = self.files.next(name)
        recorder = self.stream.start_recording(path, earlier=True)
        self._begin_recording(recorder)
        earlier_s = 0.0 if recorder.first_s is None else self.last_s - recorder.first_s
        return f"Recording to {path.name}{f'; it begins {earlier_s:.0f} s ago' if earlier_s >= 1 else ''}"

    def stop(self) -> str:
        """End the recording; return the message."""
        if not (recorder := self.recorder):
            raise RefusedCommand("stop: no recording is running")
        self._end_recording()
        return self._tell_closed(recorder)

    def again(self) -> str:
        """Begin the next measurement after one that has ended; return the message."""
        if self.running:
            raise RefusedCommand("again: the measurement still runs")
        self._thread.join()
        self.start()
        return "A new measurement has started."

    def tare(self, *, force: bool = False) -> str:
        """Ask for a tare; return the message."""
        self.require_running("tare")
        if not force and self.moment.state in PRESSED:
            raise RefusedCommand(
                "tare: the probe is in contact; lift it first. If nothing is touched, press Tare anyway"
            )
        self._tare = self.forced = force
        return "Measuring the baseline: do not touch anything."

    def tare_anyway(self) -> str:
        """Ask for a tare, also in contact; return the message."""
        return self.tare(force=True)

    def mark(self) -> Document:
        """Stamp a mark now, with the last sample that the page could show."""
        self.require_running("mark")
        if self.last is None:
            raise RefusedCommand("mark: no sample has come yet; wait a moment")
        mark = Mark(next(self._mark_numbers), self.last_s, sample=self.last)
        if recorder := self.recorder:
            self._put(mark, recorder)
        self.marks.append(mark)
        if self.outlets:
            self.outlets.mark("mark", "")
        told = "Marked." if recorder else "Marked; nothing is recorded yet."
        return {"id": mark.id, "message": told + _waiting(recorder)}

    def mark_text(self, id: int, text: str) -> Document:
        """Give a mark its text; return the answer."""
        mark = next((mark for mark in self.marks if mark.id == id), None)
        if mark is None:
            raise RefusedCommand(
                f"id: got {id}, allowed: one of the newest {MOST} marks of this measurement"
            )
        mark.text = text
        told = f"Marked: {text}" if text else "Marked."
        if mark.within and mark.within[0] is self.recorder:
            mark.within[0].rename_mark(mark.within[1], text)
            told += _waiting(mark.within[0])
        elif mark.within:
            told += " Its recording is closed, and keeps the text it had."
        return {"id": id, "message": told}

    def _put(self, mark: Mark, recorder: Recorder) -> None:
        try:
            mark.within = (recorder, recorder.mark(mark.text, mark.sample))
        # a recording with 10,000 marks, or one that fails
        except (ValueError, PalpateError) as error:
            self.say(str(error))

    def _begin_recording(self, recorder: Recorder) -> None:
        """Tell of a recording; the marks that are within it, since it begins earlier, are put into it."""
        self.records, self.newest_recorder = True, recorder
        self.files.made(recorder.path, "recording")
        for mark in self.marks.copy():
            if recorder.first_s is not None and mark.t_s >= recorder.first_s:
                self._put(mark, recorder)
        for add in self.recording_begun:
            add(recorder)

    def _tell_closed(self, recorder: Recorder | None) -> str:
        line = f"{recorder.path.name}: {recorder.rows} rows; file closed" if recorder else ""
        if line:
            self.say(line)
        return line

    def _end_recording(self) -> None:
        """Close the recording; the next measurement has none."""
        self.records = False
        try:
            self.stream.stop_recording()
        except PalpateError as error:
            self.failed = True
            self.say(f"Error: {error}")
            raise

    def _run(self, stream: Stream) -> None:
        while not (errors := self._errors_of(stream)) and self._goes_on:
            self._tell_closed(stream.recorder)
            try:
                stream = self._begin({})
            except (PalpateError, ValueError) as error:
                errors = [error]
                break
            if not self._goes_on:
                stream.stop()
        self.touches = stream.touches
        self.error = "; ".join(
            dict.fromkeys(str(error) or type(error).__name__ for error in errors)
        )
        self.failed |= any(isinstance(error, RecordingError) for error in errors)
        self.moment = self.moment._replace(state="ended")
        self.on_rows()
        self._tell_closed(stream.recorder)
        if self.error:
            self.say(f"Error: {self.error}")

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


class RecordedMeasurement(Measurement):
    """A recording: it is tracked as a whole at once, and nothing is measured. Errors as of `palpate.read`.

    Its touches are those of `palpate replay`, bit for bit. Damaged places are left out. `how`: scene and settings of the
    tracker, in place of those of the recording. A table without times and without a rate is a ValueError. Reports go to
    `folder`, or beside it.
    """

    def __init__(
        self,
        source: str,
        given_beside: dict[str, Any],
        how: dict[str, Any],
        tell: Callable[[str], None] = lambda _: None,
        folder: Path | None = None,
    ) -> None:
        opened: Any = sources.open(source, **given_beside)
        recording: OpenedRecording = opened.recording
        if not recording.timed:
            raise ValueError(f"rate: got none, allowed: {RATE}")
        super().__init__(RunFiles(folder=folder or recording.path.parent), tell, whole=True)
        if isinstance(recording, RecordingFile):
            self.files.made(recording.path, "recording")
        self.number = 1
        own: dict[str, Any] = (
            {} if how.get("scene") else {"scene": "handheld", **recording.settings}
        )
        settings: Any = own | {
            name: value for name, value in how.items() if name != "scene" or value
        }
        recording.skip_damage()
        self.recording = recording
        self.tracker = tracker_of(recording, settings.pop("scene"), settings)
        self._watch = StiffeningWatch(self.tracker)
        self.sidecar = recording.sidecar
        marks = [(m.t_s, m.text) for m in self.sidecar.marks if math.isfinite(m.t_s)]
        self.marks = deque(Mark(number, *mark) for number, mark in enumerate(marks, 1))
        self.moment = Moment("waiting")
        self._judged = 0  # judgements so far
        self._verdict = ""  # what `palpate check` says; nothing while it is read
        self._stopping = Event()
        self._thread = Thread(target=self._run, name="palpate-review", daemon=True)

    def start(self) -> None:
        """Begin to read it."""
        self._thread.start()

    def close(self) -> None:
        """Stop reading."""
        self._stopping.set()
        self._thread.join()

    @property
    def file(self) -> Document:
        """What the page says of the file."""
        survey = self.recording.survey if self._verdict else Survey()
        counts = {"rows": survey.rows, "missing": survey.lost, "refused": survey.refused}
        end = self._verdict or self.error or "being read"
        return {"name": self.recording.path.name, **counts, "end": end, "amendable": self.amendable}

    @property
    def amendable(self) -> bool:
        """Whether specimens can be given to its touches: it has a sidecar, and has ended."""
        return self.recording.path.suffix == ".csv" and "end" in self.sidecar.entries

    def cut(self, from_s: float, to_s: float) -> Touch:
        """Return the touch between two times; as `palpate.touches` with a window."""
        settings: Any = self.tracker.settings
        [touch] = tracked(
            copy(self.recording), scene=self.tracker.scene, windows=[(from_s, to_s)], **settings
        ).touches
        return touch

    def device(self) -> Document:
        """Return what the recording says of its device."""
        return self.recording.describe()

    def recording_state(self) -> Document:
        """Return the files; nothing is recorded."""
        return {"recording": None, "proposed": "", **self.files.as_dict()}

    def _run(self) -> None:
        try:
            self._read()
        except (PalpateError, ValueError, OSError) as error:
            self.error = str(error)
            self.say(f"Error: {error}")
        self.moment = Moment("ended")
        self.on_rows()

    def _read(self) -> None:
        """Estimate block by block, as `palpate.touches`: a block ends at each gap and tare."""
        tracker, watch = self.tracker, self._watch
        gaps, tares = dict(self.recording.gap_marks), self.recording.tares
        for block in self.recording.blocks():
            readings = usable_readings(block, tracker.settings["full_scale"])
            estimates = watch.process(
                np.ascontiguousarray(block["t_hard_ns"]),
                np.ascontiguousarray(block["t_soft_ns"]),
                *readings,
            )
            self.events.batch(self._batch(block, estimates))
            if (last := int(block["seq"][-1])) in gaps:
                tracker.gap()
                self.events.event(Gap(GapCause.RECORDED, gaps[last]))
            elif last in tares:
                tracker.tare(force=True)
                self.tares.append(float(block["t_hard_ns"][-1] * 1e-9))
            self.on_rows()
            if self._stopping.is_set():
                return
        self._finish()

    def _batch(self, block: Block, estimates: Rows) -> Batch:
        """Return a batch with what was judged since the last one; touches are known at the end."""
        judgements = self.tracker.judgements_since(self._judged)
        self._judged += len(judgements)
        return Batch(block, estimates, (), 0, judgements=judgements)

    def _finish(self) -> None:
        self._watch.finish()
        nothing = np.empty(0, DTYPE)
        self.events.batch(self._batch(nothing, feed(self.tracker, nothing)))
        self.touches = self._watch.touches
        self.events.ended(None)
        found = verification_of(self.recording)
        long = "too long to show every sample: at first only lowest and highest values are shown"
        for line in (
            self.recording.understood,
            *found.faults,
            *found.findings,
            "" if self.levels.has_all else long,
        ):
            if line:
                self.say(line)
        self._verdict = found.verdict


def _waiting(recorder: Recorder | None) -> str:
    """Return what an answer adds if a mark is not on the disk yet."""
    if recorder is None or not recorder.sidecar_trouble:
        return ""
    return f" {recorder.sidecar_trouble}."


AnyMeasurement = LiveMeasurement | RecordedMeasurement


def opener(source: str, given_beside: dict[str, Any]) -> Callable[..., Source]:
    """Return a function that opens the source; simulations and files run in real time unless `speed` is given.

    Keywords of that function take the place of options with the same names.
    """
    scheme, address, given = split(source)
    options = dict(given_beside)
    if not {"speed", "paced"} & {*given, *options} and (
        scheme in ("sim", "") or Path(source).exists()
    ):
        options["speed"] = 1

    def opened(**changed: Any) -> Source:
        if not changed:
            return sources.open(source, **options)
        return sources.open(f"{scheme}:{address}", **{**given, **options, **changed})

    return opened
