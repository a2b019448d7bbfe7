"""The thread that reads a source: it checks and counts the samples, and passes them to recorder, memory and queue."""

import math
import time
from collections.abc import Iterator
from threading import Event, RLock, Thread
from typing import Any

import numpy as np

from palpate.errors import ProtocolError, SourceTimeout
from palpate.recording.recorder import Recorder
from palpate.recording.rows import codes_of
from palpate.recording.sidecar import marked
from palpate.samples import Block, Sample, block_of, samples_of
from palpate.sources import Source
from palpate.sources.base import Gap, blocks_of, first_wrong
from palpate.stream.buffers import Memory, SampleQueue

_LATE = 1.5  # periods after the sample before
_MOST_CONDITIONS = 2000


class Reader:
    """Reads a source in a thread of its own, independent of the disk and of the consumer."""

    def __init__(
        self,
        source: Source,
        device: dict[str, Any],
        queue: SampleQueue,
        memory: Memory | None,
        *,
        outlives: bool,
    ) -> None:
        self.read = self.lost = self.late = 0  # as in `StreamCounters`
        self.last: Sample | None = None
        # `time.monotonic_ns()` at t = 0; None: the source has no times of this computer, or gave no sample yet.
        self.zero_ns: int | None = None
        # Held while samples are counted and stored: a caller that has it sees complete samples, and may change the recorder.
        self.lock: RLock = RLock()
        self.error: BaseException | None = None  # that ended the thread
        self._source, self._queue, self._memory = source, queue, memory
        self._late_ns, self._codes = (
            _LATE * float(device.get("period_s", math.nan)) * 1e9,
            codes_of(device),
        )
        self._outlives_recording = outlives
        self._stopping = Event()
        self._conditions = 0
        self._thread = Thread(target=self._run, name="palpate-reader", daemon=True)
        self._recorder: Recorder | None = None

    def record(self, recorder: Recorder | None) -> None:
        """Record from now on; the recorder wakes a source that waits for it. None: no recording."""
        if recorder:
            recorder.popped = self._queue.wake_source
            self._conditions = 0
        self._recorder = recorder

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """Request the end; returns at once. Later samples are neither counted nor stored."""
        self._stopping.set()
        self._queue.wake_source()
        self._source.interrupt()

    def end(self, limit_s: float) -> None:
        """Request the end, and wait for it; raises SourceTimeout if the thread still runs after this time."""
        try:
            self.stop()
        finally:
            if not self.join(limit_s):
                raise SourceTimeout(f"the source did not stop within {limit_s:g} s; it still runs")

    def join(self, limit_s: float) -> bool:
        """Wait for the end; return whether the thread has ended."""
        for _ in range(10):  # a time in which the whole program stood still counts as one part
            if self._thread.ident is not None:
                self._thread.join(limit_s / 10)
        with self.lock:  # a sample that is being stored is complete now
            return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            for block in self._blocks():
                self._take(block)
                if self._stopping.is_set():
                    break
        except BaseException as error:  # noqa: BLE001  the consumer gets any error of a source
            self.error = error
        finally:
            with self.lock:
                self._pass_conditions()
            self._queue.close()

    def _blocks(self) -> Iterator[Block]:
        if hasattr(self._source, "read_block"):
            yield from blocks_of(self._source)
            return
        for sample in self._source:
            try:
                yield block_of([sample])
            except (TypeError, ValueError) as error:
                where = f"after seq {self.last.seq}" if self.last else "first sample"
                raise ProtocolError(f"source, {where}: {error}") from error

    def _take(self, block: Block) -> None:
        """Store samples; of a source that can wait, as many at a time as there is room for."""
        wrong = first_wrong(block, self.last.seq if self.last else -1, self._codes)
        block, rest = (block, None) if wrong is None else (block[: wrong[0]], wrong[1])
        while len(block) and (room := len(block) if self._source.live else self._room()):
            self._store(block[:room])
            block = block[room:]
        if rest:
            raise ProtocolError(rest)

    def _store(self, block: Block) -> None:
        """Count and store samples, each gap directly before its sample."""
        gaps, begin = self._source.gaps_before(int(block["seq"][-1])), 0
        with self.lock:
            if self._is_over():
                return
            for gap in gaps:
                at = max(begin, int(np.searchsorted(block["seq"], gap.seq)))
                self._put(block[begin:at])
                self._pass_gap(gap._replace(seq=int(block["seq"][at])))
                begin = at
            self._put(block[begin:])
            self._pass_conditions()

    def _put(self, block: Block) -> None:
        if len(block):
            self._count(block)
            if self._memory:
                self._memory.push_many(block)
            if self._recorder:
                self._recorder.push_many(block)
            self._queue.push_many(block)

    def _is_over(self) -> bool:
        """Return whether the end was requested; raise the error of the recording, or go on without it."""
        if self._recorder and self._recorder.error and not self._stopping.is_set():
            if not self._outlives_recording:
                raise self._recorder.error
            self._recorder = None
        return self._stopping.is_set()

    def _pass_gap(self, gap: Gap) -> None:
        """Pass on a gap before its sample; before the first sample there is no baseline."""
        if self.last:
            self._queue.gaps.append(gap)
            if self._memory:
                self._memory.marks.append(marked(gap.text, self.last, tare=True, gap=True))
            if self._recorder:
                self._recorder.gap(gap.text)

    def _pass_conditions(self) -> None:
        """Pass on what the source measured beside the samples; of very many only some, evenly."""
        given = self._source.conditions
        if self._recorder and len(given) > self._conditions:
            self._conditions = len(given)
            step = len(given) // _MOST_CONDITIONS + 1
            self._recorder.conditions = [dict(each) for each in [*given[:-1:step], given[-1]]]

    def _count(self, block: Block) -> None:
        times, newest, before = block["t_hard_ns"], samples_of(block[-1:])[0], self.last
        steps = np.diff(times, prepend=before.t_hard_ns if before else times[0])
        self.late += int(np.count_nonzero(steps > self._late_ns))
        if before is None and self._source.live:
            self.zero_ns = self._zero(newest)
        expected = before.seq + 1 if before else 0 if self._source.live else int(block["seq"][0])
        self.lost += newest.seq + 1 - expected - len(block)
        self.last = newest
        self.read += len(block)

    def _zero(self, newest: Sample) -> int | None:
        """Return `time.monotonic_ns()` at t = 0: as the source knows it, else from the arrival of the newest sample."""
        if not getattr(self._source, "real_time", True):
            return None
        zero_ns = self._source.zero_ns
        return (
            time.monotonic_ns() - max(newest.t_hard_ns, newest.t_soft_ns)
            if zero_ns is None
            else zero_ns
        )

    def _room(self) -> int:
        """Wait until consumer and recorder have room; return for how many samples, 0 if the end was requested before."""
        while not self._stopping.is_set():
            recorder = self._recorder
            room = min(self._queue.room, recorder.room) if recorder else self._queue.room
            if room > 0:
                return room
            self._queue.wait_for_room()
        return 0
