"""An opened recording in place of a measurement: it is tracked as a whole at once, and nothing is measured."""

import math
import time
from collections.abc import Callable, Iterator
from threading import Event, Lock, Thread
from types import SimpleNamespace
from typing import Any

import numpy as np

from palpate._core import Touch
from palpate.errors import PalpateError
from palpate.live.feed import ends_of, rows_of
from palpate.live.levels import Levels
from palpate.live.protocol import Command
from palpate.live.recordings import Recordings
from palpate.live.session import Moment
from palpate.recording import sidecar
from palpate.recording.foreign import RATE, AnyRecording
from palpate.recording.lines import Damage
from palpate.recording.own_file import Recorded
from palpate.recording.session import Plan, plan_of
from palpate.recording.verification import Verification, judged
from palpate.samples import Block
from palpate.stream.estimate import Batch, StreamCounters
from palpate.touch import replayed, tracker_of

_READING = "being read"
_TOUCHES_S = 0.5  # what is told of all touches costs as much as reading them: then after twice the time, and so on
_HOLE_S = 0.25  # a hole without a mark is shown from here on; all are counted


class Review:
    """A recording, with the attributes of `Session` that the page's server uses.

    Its touches are those of `palpate replay`, bit for bit. Damaged places are left out.

    Parameters
    ----------
    recording : Recorded, Foreign or BinaryData
    how : dict
        Scene and settings of the tracker; they replace those of the recording. Without a scene, that of the recording.
    tell : callable, optional
        Called with what is said of the recording.

    Raises
    ------
    ValueError
        A table without times, and no rate.

    Attributes
    ----------
    verification : Verification or None
        What `palpate check` says; None while it is read.
    plan : Plan
        What was touched, from the sidecar.
    tares : list of float
        Times after which the baseline was measured again, s.
    gaps : list of (float, float, int, str)
        Times before and after, s, samples lost, and what happened.
    others
        As of `Session`.
    """

    kind = "file"
    number = 1
    error = ""
    failed = False

    def __init__(
        self, recording: AnyRecording, how: dict[str, Any], tell: Callable[[str], object] = lambda _: None
    ) -> None:
        if not recording.timed:
            raise ValueError(f"rate: got none, allowed: {RATE}")
        given = {name: value for name, value in how.items() if name != "scene"}
        settings = ({"scene": how["scene"]} if how.get("scene") else {"scene": "handheld"} | recording.settings) | given
        self._opened = _Opened(recording)
        self._recording, self._tell = recording, tell
        tracker = tracker_of(self._opened, settings.pop("scene"), settings)  # type: ignore[arg-type]
        source = SimpleNamespace(describe=recording.describe, notify=tell, live=False, path=recording.path)
        self.stream = SimpleNamespace(tracker=tracker, source=source, recorder=None, epoch=None)
        document = recording.document or {}
        self.plan: Plan = plan_of(document)
        self.marks: list[tuple[float, str]] = [mark for mark in sidecar.marks_of(document) if math.isfinite(mark[0])]
        self.recordings = Recordings(None)
        if isinstance(recording, Recorded):
            self.recordings.made(recording.path, "recording")
        self.touches: list[Touch] = []
        self.ends: dict[int, float] = {}
        self.tares: list[float] = []
        self.gaps: list[tuple[float, float, int, str]] = []
        self.levels = Levels(whole=True)
        self.messages: list[str] = [recording.understood] if recording.understood else []
        self.moment = Moment("waiting")
        self.verification: Verification | None = None
        self.on_rows: Callable[[], None] = lambda: None
        self.commands: Any = Lock()
        self.orders: dict[str, Callable[[Command], str]] = {}
        self._seq: int | None = None
        self._begun_s = self._due_s = 0.0
        self._marked = dict(recording.gap_marks)
        self._stopping = Event()
        self._thread = Thread(target=self._run, name="palpate-review", daemon=True)

    def start(self) -> None:
        """Begin to read it."""
        self._begun_s = time.monotonic()
        self._thread.start()

    def close(self) -> None:
        """Stop reading."""
        self._stopping.set()
        self._thread.join()

    @property
    def running(self) -> bool:
        """Whether it is still read."""
        return self.verification is None and not self.error

    @property
    def counters(self) -> StreamCounters:
        """Numbers of samples so far."""
        survey = self._recording.survey
        return StreamCounters(
            read=survey.rows,
            lost=survey.lost,
            delivered=survey.rows,
            refused=survey.refused,
            saturated=survey.hard_saturated + survey.soft_saturated,
            retaken=self.stream.tracker.retaken,
        )

    @property
    def period_s(self) -> float:
        """Mean time from pair to pair, s."""
        return self._recording.survey.period_s

    @property
    def zero_utc_ns(self) -> int | None:
        """UTC of t = 0, ns since 1970; None: unknown."""
        return getattr(self._recording, "zero_utc_ns", None)

    @property
    def file(self) -> dict[str, Any]:
        """What `hello` says of the file."""
        found, survey = self.verification, self._recording.survey
        if found is None:
            return {
                "name": self._recording.path.name,
                "rows": 0,
                "missing": 0,
                "end": self.error or _READING,
                "seconds": 0.0,
            }
        return {
            "name": self._recording.path.name,
            "rows": survey.rows,
            "missing": survey.lost,
            "end": found.verdict,
            "seconds": survey.seconds,
        }

    def _run(self) -> None:
        try:
            for batch in self._batches():
                self._take(batch)
                self.on_rows()
                if self._stopping.is_set():
                    return
            self._finish()
        except (PalpateError, ValueError, OSError) as error:
            self.error = str(error)
            self._tell(f"Error: {error}")
        self.moment = Moment("ended")
        self.on_rows()

    def _batches(self) -> Iterator[Batch]:
        for *_, estimates, _ in replayed(self.stream.tracker, self._opened):
            yield Batch(self._opened.block, estimates, (), 0)

    def _take(self, batch: Batch) -> None:
        rows = rows_of(batch)
        last = self.levels.span[1] if self.levels.span else -math.inf
        self._follow(batch.samples, last)
        rows["t_s"] = np.maximum.accumulate(np.maximum(rows["t_s"], last))  # times of a file may go back
        self.levels.add(rows)
        self.ends |= ends_of(batch)
        now_s = time.monotonic()
        if now_s >= self._due_s and (found := self.stream.tracker.touches_since(len(self.touches))):
            self.touches = [*self.touches, *found]
            self._due_s = now_s + max(_TOUCHES_S, now_s - self._begun_s)

    def _follow(self, block: Block, last_s: float) -> None:
        """Note tares, and gaps: those with a mark, and holes that can be seen."""
        seq, times = block["seq"], block["t_hard_ns"] * 1e-9
        if self._seq is not None:
            self._note_gap(self._seq, int(seq[0]), last_s, float(times[0]))
        for at in np.flatnonzero((np.diff(seq) > 1) & (np.diff(times) >= _HOLE_S)).tolist():
            self._note_gap(int(seq[at]), int(seq[at + 1]), float(times[at]), float(times[at + 1]))
        self._seq = int(seq[-1])
        if self._seq in self._opened.tares and self._seq not in self._marked:
            self.tares.append(float(times[-1]))

    def _note_gap(self, before: int, after: int, from_s: float, to_s: float) -> None:
        lost = max(after - before - 1, 0)
        if before in self._marked or (lost and to_s - from_s >= _HOLE_S):
            self.gaps.append((from_s, to_s, lost, self._marked.get(before, f"{lost} pairs are missing")))

    def _finish(self) -> None:
        tracker = self.stream.tracker
        tracker.finish()
        self.touches = tracker.touches
        found = judged(self._recording, self._opened.damage)
        told = [*found.faults, *found.findings]
        if width_s := self.levels.finest_s:
            told.append(f"too long to show every sample: lowest and highest values of each {width_s:.2g} s are shown")
        self.messages = [*self.messages, *told]
        for line in told:
            self._tell(line)
        self.verification = found


class _Opened:
    """A recording for a tracker: without its damaged places, and with the block that the tracker has."""

    def __init__(self, recording: AnyRecording) -> None:
        self.timed: bool = recording.timed
        self.full_scale_pF: float = recording.full_scale_pF
        self.host_stamps: bool = recording.host_stamps
        self.tares: frozenset[int] = recording.tares
        self.gap_marks = recording.gap_marks
        self.damage: list[Damage] = []
        self._recording = recording

    def blocks(self) -> Iterator[Block]:
        """Yield the samples."""
        recording = self._recording
        for block in recording.blocks(self.damage) if isinstance(recording, Recorded) else recording.blocks():
            self.block = block
            yield block
