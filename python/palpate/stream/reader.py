"""The thread that reads a source: it checks, counts and stores samples, and passes them on."""

import math
import time
from collections.abc import Mapping
from threading import Event, RLock, Thread
from typing import Any

import numpy as np

from palpate.clocks import Clocks, ClockWatch, ahead_of_monotonic_ns
from palpate.errors import ProtocolError, SourceTimeout
from palpate.recording.recorder import Recorder
from palpate.recording.rows import Codes, codes_of
from palpate.recording.sidecar import SidecarMark
from palpate.samples import DTYPE, Block, Instrument, Sample, samples_of
from palpate.source_events import Conditions, Gap, SourceEvent
from palpate.sources import Source
from palpate.sources.base import first_wrong
from palpate.stream.buffers import Backlog, SampleQueue
from palpate.stream.pauses import PauseGaps, clock_set, is_jump

_SLEPT_NS = 1_000_000  # less is an error of two readings of clocks
_SETTLED = 32  # pairs whose mean is the time from pair to pair, if the source does not say it
_LATE = 1.5  # periods after the sample before
_MOST_CONDITIONS = 2000
# These may be on their way when the source is interrupted; its last events come after them.
_BLOCKS_AFTER_STOP = 1


class Reader:
    """Reads a source in a thread of its own, independent of the disk and of the consumer."""

    def __init__(
        self, source: Source, queue: SampleQueue, backlog: Backlog | None, *, outlives: bool
    ) -> None:
        self.read = self.lost = self.late = 0  # as in `StreamCounters`
        self.last: Sample | None = None
        # `time.monotonic_ns()` at t = 0, and `ahead_of_monotonic_ns()`, at the first sample
        self._zero_ns: int | None = None
        self._ahead_ns = 0
        self._first_ns = 0  # time of the first sample
        # Held while samples are counted and stored: a caller that has it sees complete samples,
        # and may change the recorder.
        self.lock: RLock = RLock()
        self.error: BaseException | None = None  # that ended the thread
        self._source = source
        self._queue = queue
        self._backlog = backlog
        self._late_ns = math.inf
        self._codes = Codes()
        self._outlives_recording = outlives
        self._stopping = Event()
        self._own_clocks: ClockWatch | None = None
        if source.clocks is None and source.live and source.real_time:
            self._own_clocks = ClockWatch()
        self._clocks: Clocks | None = source.clocks or self._own_clocks
        self._pauses = PauseGaps()
        self._period_s = 0.0  # 0: unknown
        self._waiting: list[SourceEvent] = []  # a gap, and the events after it, until its sample
        self._conditions: list[Conditions] = []
        self._thread = Thread(target=self._run, name="palpate-reader", daemon=True)
        self._recorder: Recorder | None = None

    def record(self, recorder: Recorder | None) -> None:
        """Record from now on; the recorder wakes a source that waits for it. None: no recording."""
        if recorder:
            recorder.popped = self._queue.wake_source
        self._recorder = recorder
        self._record_conditions()

    def start(self, device: Mapping[str, Any]) -> None:
        """Start the thread; `device` is the description of the source, which has begun."""
        self._codes = codes_of(device)
        period_s = Instrument.of(device).period_s
        if period_s:
            self._period_s = period_s
            self._late_ns = _LATE * period_s * 1e9
        self._thread.start()

    @property
    def zero_ns(self) -> int | None:
        """`time.monotonic_ns()` at t = 0, on this clock as it is now.

        None: the source has no times of this computer, or has given no sample yet.
        """
        if self._zero_ns is None:
            return None
        slept_ns = ahead_of_monotonic_ns() - self._ahead_ns
        if slept_ns < _SLEPT_NS:
            slept_ns = 0
        return self._zero_ns - slept_ns

    @property
    def is_started(self) -> bool:
        """Whether the thread was started."""
        return self._thread.ident is not None

    def stop(self) -> None:
        """Request the end; returns at once. Later samples are neither counted nor stored."""
        try:
            self._source.interrupt()
        finally:
            self._stopping.set()
            self._queue.wake_source()

    def end(self, limit_s: float) -> None:
        """Request the end, and wait for it; SourceTimeout if the thread runs longer than this."""
        try:
            self.stop()
        finally:
            if not self.join(limit_s):
                raise SourceTimeout(f"the source did not stop within {limit_s:g} s; it still runs")

    def join(self, limit_s: float) -> bool:
        """Wait for the end; return whether the thread has ended."""
        for _ in range(10):  # a time in which the whole program stood still counts as one part
            if self.is_started:
                self._thread.join(limit_s / 10)
        with self.lock:  # a sample that is being stored is complete now
            return not self._thread.is_alive()

    def _run(self) -> None:
        left = _BLOCKS_AFTER_STOP
        if self._own_clocks:
            self._own_clocks.start()
        try:
            for item in self._source:
                if isinstance(item, np.ndarray):
                    block = np.ascontiguousarray(item, DTYPE)
                    self._look_at_clocks(block)
                    self._take(block)
                    left -= self._stopping.is_set()
                elif isinstance(item, SourceEvent):
                    self._take_event(item)
                else:
                    raise ProtocolError(_not_an_item(item))
                if left < 0:
                    break
        except BaseException as error:  # noqa: BLE001  the consumer gets any error of a source
            self.error = error
        finally:
            if self._own_clocks:
                self._own_clocks.stop()
            for event in self._waiting:
                if not isinstance(event, Gap):
                    self._queue.push_event(event)
            self._queue.close()

    def _take_event(self, event: SourceEvent) -> None:
        """Pass on an event; a gap waits for its sample, and later events wait for the gap."""
        with self.lock:
            if isinstance(event, Conditions):
                self._conditions.append(event)
                self._record_conditions()
            if self._stopping.is_set():
                return
            if self._waiting or isinstance(event, Gap):
                self._waiting.append(event)
            else:
                self._queue.push_event(event)

    def _look_at_clocks(self, block: Block) -> None:
        """Put a gap before samples after a pause of the computer; report a wall clock that was set."""
        if not self._clocks or not len(block):
            return
        pause = self._clocks.passed()
        if pause.set_s and not is_jump(pause.set_s, self._period_s):
            self._report(clock_set(pause.set_s))
        if not self.last:  # there is no baseline yet
            return
        hole_s = (int(block["t_hard_ns"][0]) - self.last.t_hard_ns) / 1e9
        gap = self._pauses.gap(pause, len(block), hole_s, self._period_s)
        if gap:
            self._take_event(self._with_gap_of_source(gap))

    def _report(self, text: str) -> None:
        """Report what changes no sample: to the user, and as a mark in the recording."""
        with self.lock:
            if self._recorder:
                self._recorder.gap(text, "mark")
        self._source.notify(text)

    def _with_gap_of_source(self, gap: Gap) -> Gap:
        """Join the gap at a pause with one that the source found there."""
        texts = [gap.text]
        for event in self._waiting:
            if isinstance(event, Gap):
                texts.append(event.text)
        self._waiting = [event for event in self._waiting if not isinstance(event, Gap)]
        return Gap(gap.cause, "; ".join(texts))

    def _take(self, block: Block) -> None:
        """Store samples; of a source that can wait, as many at a time as there is room for."""
        last_seq = self.last.seq if self.last else -1
        wrong = first_wrong(block, last_seq, self._codes)
        if wrong is not None:
            block = block[: wrong.position]
        while len(block):
            room = len(block)
            if not self._source.live:
                room = self._wait_for_room()
            if not room:
                break
            self._store(block[:room])
            block = block[room:]
        if wrong is not None:
            raise ProtocolError(wrong.text)

    def _store(self, block: Block) -> None:
        """Count and store samples, and the events that waited for them."""
        with self.lock:
            if self._is_over():
                return
            for event in self._waiting:
                self._store_event(event)
            self._waiting.clear()
            self._count(block)
            if self._backlog:
                self._backlog.push_many(block)
            if self._recorder:
                self._recorder.push_many(block)
            self._queue.push_many(block)

    def _is_over(self) -> bool:
        """Return whether the end was requested; raise the recording's error, or go on without."""
        if self._recorder and self._recorder.error and not self._stopping.is_set():
            if not self._outlives_recording:
                raise self._recorder.error
            self._recorder = None
        return self._stopping.is_set()

    def _store_event(self, event: SourceEvent) -> None:
        """Pass on an event before its sample; before the first sample a gap changes nothing."""
        if isinstance(event, Gap):
            if self.last is None:
                return
            if self._backlog:
                self._backlog.marks.append(SidecarMark.at(self.last, event.text, "gap"))
            if self._recorder:
                self._recorder.gap(event.text)
        self._queue.push_event(event)

    def _record_conditions(self) -> None:
        """Store the conditions so far in the recording; of very many only some, evenly."""
        if self._recorder and self._conditions:
            step = len(self._conditions) // _MOST_CONDITIONS + 1
            self._recorder.conditions = [*self._conditions[:-1:step], self._conditions[-1]]

    def _count(self, block: Block) -> None:
        times = block["t_hard_ns"]
        if not self.read:
            self._first_ns = int(times[0])
        steps_so_far = self.read + self.lost
        if not self._period_s and steps_so_far >= _SETTLED:
            self._period_s = (int(times[0]) - self._first_ns) / 1e9 / steps_so_far
        newest = samples_of(block[-1:])[0]
        before = self.last
        time_before = times[0]
        expected = 0
        if before is not None:
            time_before = before.t_hard_ns
            expected = before.seq + 1
        elif self._source.live:
            self._zero_ns = self._zero(newest)
            self._ahead_ns = ahead_of_monotonic_ns()
        else:
            expected = int(block["seq"][0])
            self._zero_ns = self._source.zero_ns
            self._ahead_ns = ahead_of_monotonic_ns()
        steps = np.diff(times, prepend=time_before)
        self.late += int(np.count_nonzero(steps > self._late_ns))
        self.lost += newest.seq + 1 - expected - len(block)
        self.last = newest
        self.read += len(block)

    def _zero(self, newest: Sample) -> int | None:
        """Return `time.monotonic_ns()` at t = 0: from the source, else from the newest arrival."""
        if not self._source.real_time:
            return None
        zero_ns = self._source.zero_ns
        if zero_ns is None:
            zero_ns = time.monotonic_ns() - max(newest.t_hard_ns, newest.t_soft_ns)
        return zero_ns

    def _wait_for_room(self) -> int:
        """Wait until consumer and recorder have room for some samples; 0: the end was requested."""
        while not self._stopping.is_set():
            room = self._queue.room
            recorder = self._recorder
            if recorder:
                room = min(room, recorder.room)
            if room > 0:
                return room
            self._queue.wait_for_room()
        return 0


def _not_an_item(item: object) -> str:
    got = f"got an object of type {type(item).__name__} while iterating"
    allowed = "blocks of samples, palpate.sources.Gap and the other events of palpate.sources"
    single = "a source of single samples derives from palpate.sources.SampleSource"
    return f"source: {got}, allowed: {allowed}; {single}"
