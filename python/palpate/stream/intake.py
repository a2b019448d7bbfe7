"""What the thread of a source does with each sample, or block of samples: checks, counts, and stores it."""

import math
import time
from collections import deque
from threading import Event, RLock
from typing import Any

import numpy as np

from palpate.recording.codes import Codes
from palpate.recording.recorder import Recorder
from palpate.recording.remarks import marked
from palpate.samples import Block, Sample, samples_of
from palpate.sources import Source
from palpate.sources.base import Gap
from palpate.sources.claims import Conditions, conditions_of, gap_of, zero_of
from palpate.stream.checks import all_good, checked
from palpate.stream.kept import Kept
from palpate.stream.waiting import Waiting

_LATE = 1.5  # periods after the sample before


class Intake:
    """Takes the samples of a source: into the ring, the recording, and the counters.

    Parameters
    ----------
    source : Source
    waiting : Waiting
        Gets the samples.
    gaps : deque of Gap
        Gets each gap of the source before the ring gets the first sample after it.
    recorder : Recorder, optional
    period_s : float
        Time from one pair to the next; nan: unknown.
    codes : Codes
        Scale of the codes: a reading has to be the one that a replay computes from its code.
    kept : Kept, optional
        Gets the samples and gaps, too.
    outlives : bool
        Go on when the recording has failed, without it; else its error ends the source.

    Attributes
    ----------
    read, lost, late : int
        As in `StreamCounters`.
    last : Sample or None
    zero_ns : int or None
        `time.monotonic_ns()` at t = 0, after the first sample; None: the source has no times of this computer.
    lock : RLock
        Held while samples are counted and stored. With it a caller sees complete samples, and may change the recorder.
    stopping : Event
        Set when the end was requested: later samples are neither counted nor stored.
    """

    def __init__(
        self,
        source: Source,
        waiting: Waiting,
        gaps: deque[Gap],
        recorder: Recorder | None,
        period_s: float = math.nan,
        codes: Codes = Codes(),  # noqa: B008  it cannot be changed
        kept: Kept | None = None,
        *,
        outlives: bool = False,
    ) -> None:
        self.read: int = 0
        self.lost: int = 0
        self.late: int = 0
        self.last: Sample | None = None
        self.zero_ns: int | None = None
        self.lock: RLock = RLock()
        self.stopping: Event = Event()
        self._source = source
        self._live = bool(source.live)
        self._waiting, self._gaps = waiting, gaps
        self._passed = 0  # gaps
        self._conditions = Conditions([], 0)
        self._late_ns = _LATE * period_s * 1e9
        self._codes = codes
        self._kept, self._outlives = kept, outlives
        self.recorder = recorder

    @property
    def recorder(self) -> Recorder | None:
        """The recorder, which wakes a source that waits for it; None: no recording."""
        return self._recorder

    @recorder.setter
    def recorder(self, recorder: Recorder | None) -> None:
        if recorder:
            recorder.popped = self._waiting.wake_source
        self._recorder = recorder

    def stop(self) -> None:
        """Take no more samples; returns at once."""
        self.stopping.set()
        self._waiting.wake_source()

    def take(self, given: Any) -> None:
        """Take a sample of the source.

        Raises
        ------
        ProtocolError
            It cannot be stored; nothing is counted then.
        RecordingError
            The recording failed.
        """
        if not self._live and not self._room():
            return
        sample = checked(given, self._last_seq, self._codes)
        gaps = self._gaps_until(sample.seq)
        with self.lock:
            if self._is_over():
                return
            for gap in gaps:
                self._pass(gap, sample.seq)
            self._count(sample)
            self.pass_conditions()
            if self._kept:
                self._kept.add(sample)
            if self._recorder:
                self._recorder.push(sample)
            self._waiting.push(sample)

    def take_block(self, block: Block) -> None:
        """Take consecutive samples; errors as in `take`, after the samples before the wrong one."""
        if not all_good(block, self._last_seq, self._codes):
            for sample in samples_of(block):
                self.take(sample)
            return
        while len(block) and (room := len(block) if self._live else self._room()):
            self._store(block[:room])
            block = block[room:]

    def pass_conditions(self) -> None:
        """Pass on what the source measured beside the samples."""
        self._conditions = conditions_of(self._source, self._conditions)
        if self._recorder:
            self._recorder.conditions = self._conditions.kept

    @property
    def _last_seq(self) -> int | None:
        return self.last.seq if self.last else None

    def _is_over(self) -> bool:
        """Return whether the end was requested; raise the error of the recording, or leave it."""
        if self.stopping.is_set():
            return True
        if self._recorder and self._recorder.error:
            if not self._outlives:
                raise self._recorder.error
            self._recorder = None
        return False

    def _store(self, block: Block) -> None:
        """Count and store samples, each gap directly before its sample."""
        gaps, begin = self._gaps_until(int(block["seq"][-1])), 0
        with self.lock:
            if self._is_over():
                return
            for gap in gaps:
                at = max(begin, int(np.searchsorted(block["seq"], gap.seq)))
                self._put(block[begin:at])
                self._pass(gap, int(block["seq"][at]))
                begin = at
            self._put(block[begin:])
            self.pass_conditions()

    def _put(self, block: Block) -> None:
        if len(block):
            self._count_block(block)
            if self._kept:
                self._kept.add_block(block)
            if self._recorder:
                self._recorder.push_many(block)
            self._waiting.push_many(block)

    def _gaps_until(self, seq: int) -> list[Gap]:
        """Return the gaps between the last sample and this one."""
        found = []
        while (gap := gap_of(self._source, self._passed)) and gap.seq <= seq:
            self._passed += 1
            found.append(gap)
        return found

    def _pass(self, gap: Gap, seq: int) -> None:
        """Pass on a gap before this sample; before the first sample there is no baseline."""
        if self.last:
            self._gaps.append(gap._replace(seq=seq))
            if self._kept:
                self._kept.marks.append(marked(gap.text, self.last, tare=True, gap=True))
            if self._recorder:
                self._recorder.gap(gap.text)

    def _count(self, sample: Sample) -> None:
        if before := self.last:
            self.lost += sample.seq - before.seq - 1
            self.late += sample.t_hard_ns - before.t_hard_ns > self._late_ns
        elif self._live:
            self.lost += sample.seq
            self.zero_ns = self._zero(sample)
        self.last = sample
        self.read += 1

    def _count_block(self, block: Block) -> None:
        times, newest = block["t_hard_ns"], samples_of(block[-1:])[0]
        self.late += int(np.count_nonzero(np.diff(times) > self._late_ns))
        if before := self.last:
            self.lost += newest.seq - before.seq - len(block)
            self.late += int(times[0]) - before.t_hard_ns > self._late_ns
        elif self._live:
            self.lost += newest.seq + 1 - len(block)
            self.zero_ns = self._zero(newest)
        else:
            self.lost += newest.seq + 1 - len(block) - int(block["seq"][0])
        self.last = newest
        self.read += len(block)

    def _zero(self, newest: Sample) -> int | None:
        """Return `time.monotonic_ns()` at t = 0: as the source knows it, else from the arrival of the newest sample."""
        if not getattr(self._source, "real_time", True):
            return None
        zero_ns = zero_of(self._source)
        return time.monotonic_ns() - max(newest.t_hard_ns, newest.t_soft_ns) if zero_ns is None else zero_ns

    def _room(self) -> int:
        """Wait until consumer and recorder have room; return for how many samples, 0 if the end was requested before."""
        while not self.stopping.is_set():
            recorder = self._recorder
            room = min(self._waiting.room, recorder.room) if recorder else self._waiting.room
            if room > 0:
                return room
            self._waiting.wait_for_room()
        return 0
