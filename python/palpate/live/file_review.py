"""A recording behind the page: it is tracked as a whole at once, and nothing is measured."""

import math
from collections.abc import Callable
from copy import copy
from pathlib import Path
from threading import Event, Thread
from typing import Any, cast

import numpy as np
from msgspec import UNSET

from palpate import sources
from palpate.errors import PalpateError
from palpate.files import Json
from palpate.live.measurement import (
    EndedRecording,
    Keywords,
    Measurement,
    PageMark,
    TrackerState,
)
from palpate.live.page_frames import Rows
from palpate.live.protocol import FilesState, RefusedCommand, ReviewedFile
from palpate.live.run_files import RunFiles
from palpate.recording.convert import RATE
from palpate.recording.counts import Survey
from palpate.recording.csv_reader import RecordingFile
from palpate.recording.opened import OpenedRecording
from palpate.recording.session import Entry
from palpate.recording.session import Plan as StoredPlan
from palpate.recording.verification import verification_of
from palpate.samples import DTYPE, Block, feed, usable_readings
from palpate.sources import Gap, GapCause
from palpate.sources.playback import FileSource
from palpate.stream import Batch
from palpate.touch import Touch
from palpate.touch_readings.stiffening_watch import StiffeningWatch
from palpate.tracking import tracked, tracker_of


class RecordedMeasurement(Measurement):
    """A recording. Errors as of `palpate.read`.

    Its touches are those of `palpate replay`, bit for bit. Damaged places are left out. `settings`: scene and settings of the
    tracker, in place of those of the recording. A table without times and without a rate is a ValueError. Reports go to
    `folder`, or beside it.
    """

    touches_wanted = 1
    last_s = 0.0

    def __init__(
        self,
        source: str,
        reading: Keywords,
        settings: Keywords,
        notify: Callable[[str], None] = lambda _: None,
        folder: Path | None = None,
    ) -> None:
        recording = cast(FileSource, sources.open(source, **reading)).recording
        if not recording.timed:
            raise ValueError(f"rate: got none, allowed: {RATE}")
        super().__init__(RunFiles(folder=folder or recording.path.parent), notify, whole=True)
        if isinstance(recording, RecordingFile):
            self.files.made(recording.path, "recording")
        recording.skip_damage()
        self.number = 1
        self.recording: OpenedRecording = recording
        given = dict(settings)
        scene = given.pop("scene", None)
        if not scene:
            given = {**recording.settings, **given}
            scene = given.pop("scene", "handheld")
        self.tracker = tracker_of(recording, scene, cast(Any, given))
        self._watch = StiffeningWatch(self.tracker)
        self.sidecar = recording.sidecar
        stored = [mark for mark in self.sidecar.marks if math.isfinite(mark.t_s)]
        for number, mark in enumerate(stored, 1):
            self.marks.append(PageMark(number, mark.t_s, mark.text))
        self.tracker_state = TrackerState("waiting")
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
    def file(self) -> ReviewedFile:
        """What the page shows of the file."""
        survey = self.recording.survey if self._verdict else Survey()
        return ReviewedFile(
            self.recording.path.name,
            survey.rows,
            survey.lost,
            survey.refused,
            end=self._verdict or self.error or "being read",
            amendable=self._has_end,
        )

    @property
    def _has_end(self) -> bool:
        """Whether it has a sidecar, and has ended."""
        return self.recording.path.suffix == ".csv" and "end" in self.sidecar.entries

    def require_amendable(self) -> None:
        """Raise `RefusedCommand` if its touches can get no specimens."""
        if self.running:
            why = "it is still being read"
        elif not self._has_end:
            why = "it has no sidecar with an end"
        else:
            return
        raise RefusedCommand(
            f"{self.recording.path.name}: cannot be changed: {why}, allowed: a recording of palpate "
            "that has ended; palpate convert, or check --repair, makes one"
        )

    @property
    def ended_recording(self) -> EndedRecording:
        """The recording, for changes of its session."""
        return EndedRecording(self.recording.path, -math.inf, None)

    def stored_entries(self, plan: StoredPlan) -> list[Entry | None]:
        """Return what the sidecar says of each touch; None: nothing."""
        return plan.matched(self.touches, self.recording.survey.period_s)

    def cut(self, from_s: float, to_s: float) -> Touch:
        """Return the touch between two times; as `palpate.touches` with a window."""
        settings = cast(Any, self.tracker.settings)
        recording = copy(self.recording)
        scene = self.tracker.scene
        found = tracked(recording, scene=scene, windows=[(from_s, to_s)], **settings)
        [touch] = found.touches
        return touch

    def device(self) -> Json:
        """Return what the recording says of its device."""
        return self.recording.describe()

    def recording_state(self) -> FilesState:
        """Return the files; nothing is recorded."""
        return FilesState(
            None, UNSET, "", self.files.named, self.files.progress, len(self.files.compared())
        )

    def _run(self) -> None:
        try:
            self._read()
        except (PalpateError, ValueError, OSError) as error:
            self.error = str(error)
            self.notify(f"Error: {error}")
        self.tracker_state = TrackerState("ended")
        self.on_rows()

    def _read(self) -> None:
        """Estimate block by block, as `palpate.touches`: a block ends at each gap and tare."""
        tracker = self.tracker
        gaps = dict(self.recording.gap_marks)
        for block in self.recording.blocks():
            hard, soft = usable_readings(block, tracker.settings["full_scale"])
            estimates = self._watch.process(
                np.ascontiguousarray(block["t_hard_ns"]),
                np.ascontiguousarray(block["t_soft_ns"]),
                hard,
                soft,
            )
            self.events.batch(self._batch(block, estimates))
            last = int(block["seq"][-1])
            if last in gaps:
                tracker.gap()
                self.events.event(Gap(GapCause.RECORDED, gaps[last]))
            elif last in self.recording.tares:
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
        for line in (self.recording.understood, *found.faults, *found.findings):
            if line:
                self.notify(line)
        if not self.levels.has_all:
            self.notify(
                "too long to show every sample: at first only lowest and highest values are shown"
            )
        self._verdict = found.verdict
