"""The thread that reads a source, independent of the disk and of the consumer."""

import math
import time
from collections import deque
from contextlib import suppress
from threading import Event, RLock, Thread, current_thread
from typing import Any

from palpate._core import SampleRing
from palpate.errors import ProtocolError, SourceTimeout
from palpate.recording.codes import Codes
from palpate.recording.recorder import Recorder
from palpate.samples import Sample
from palpate.sources import Source
from palpate.sources.base import Gap
from palpate.sources.claims import Conditions, conditions_of, gap_of, zero_of
from palpate.stream.limited import limited

_AHEAD = 16  # a source that can wait is at most this many samples ahead of the consumer
_WAIT_S = 0.0005
_made = tuple.__new__  # as Sample._make, in a third of its time
_LATE = 1.5  # periods after the sample before


class Reader:
    """Reads a source in a thread; writes the samples to a ring and a recorder.

    Parameters
    ----------
    source : Source
        After `__enter__`.
    ring : SampleRing
        Closed at the end of the source.
    gaps : deque of Gap
        Gets each gap of the source before the ring gets the first sample after it.
    recorder : Recorder, optional
    period_s : float
        Time from one pair to the next; nan: unknown.
    codes : Codes
        Scale of the codes: a reading has to be the one that a replay computes from its code.

    Attributes
    ----------
    read, lost, late : int
        As in `StreamCounters`.
    last : Sample or None
    zero_ns : int or None
        `time.monotonic_ns()` at t = 0, after the first sample; None: the source has no times of this computer.
    ready : Event
        Set after each new sample, and at the end.
    error : BaseException or None
        The error that ended the thread.
    lock : RLock
        Held while a sample is counted and stored. With it a caller sees complete samples, and may change the recorder.
    recorder : Recorder or None
    """

    def __init__(
        self,
        source: Source,
        ring: SampleRing,
        gaps: deque[Gap],
        recorder: Recorder | None,
        period_s: float = math.nan,
        codes: Codes = Codes(),  # noqa: B008  it cannot be changed
    ) -> None:
        self.read: int = 0
        self.lost: int = 0
        self.late: int = 0
        self.last: Sample | None = None
        self.zero_ns: int | None = None
        self.ready: Event = Event()
        self.error: BaseException | None = None
        self._source = source
        self._live = bool(source.live)
        self._ring, self._gaps = ring, gaps
        self._passed = 0  # gaps
        self._conditions = Conditions([], 0)
        self.lock: RLock = RLock()
        self.recorder = recorder
        self._late_ns = _LATE * period_s * 1e9
        self._disagreement = codes.disagreement
        self._stopping = Event()
        self._thread = Thread(target=self._run, name="palpate-reader", daemon=True)

    @property
    def is_this_thread(self) -> bool:
        """Whether the caller is the thread that reads."""
        return self._thread is current_thread()

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """Request the end; returns at once. Later samples are neither counted nor stored."""
        self._stopping.set()
        self._source.interrupt()

    def end(self, limit_s: float) -> None:
        """Request the end, and wait for it.

        Raises
        ------
        SourceTimeout
            The source did not stop within this time; its thread still runs.
        Exception
            What its `interrupt` raises.
        """
        what = "the source did not stop"
        try:
            limited(self.stop, limit_s, what)
        finally:
            if not self.join(limit_s):
                raise SourceTimeout(f"{what} within {limit_s:g} s; it still runs")

    def join(self, timeout_s: float) -> bool:
        """Wait for the end; return whether the thread has ended."""
        if self._thread.ident is not None:
            self._thread.join(timeout_s)
        with self.lock:  # a sample that is being stored is complete now
            return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            for sample in self._source:
                self._take(sample)
                if self._stopping.is_set():
                    break
        except BaseException as error:  # noqa: BLE001  the consumer gets any error of a source
            self.error = _told(error)
        finally:
            self._finish()
            self._ring.close()
            self.ready.set()

    def _finish(self) -> None:
        """Pass on what the source measured at its end."""
        with self.lock:
            try:
                self._pass_conditions()
            except ProtocolError as error:
                self.error = self.error or error

    def _pass_conditions(self) -> None:
        self._conditions = conditions_of(self._source, self._conditions)
        if self.recorder:
            self.recorder.conditions = self._conditions.kept

    def _take(self, given: Any) -> None:
        if not self._live and not self._has_room():
            return
        sample = self._checked(given)
        gaps = self._gaps_before(sample)
        with self.lock:
            if self._stopping.is_set():
                return
            if self.recorder and self.recorder.error:
                raise self.recorder.error
            for gap in gaps:
                self._gaps.append(gap)
                if self.recorder:
                    self.recorder.gap(gap.text)
            self._count(sample)
            self._pass_conditions()
            if self.recorder:
                self.recorder.push(sample)
            self._ring.push(sample)
        self.ready.set()

    def _checked(self, given: Any) -> Sample:
        """Return a sample with fields of int and float that a recording can store; nothing is counted before this."""
        last = self.last.seq if self.last else -1
        try:
            sample = self._agreeing(_made(Sample, self._ring.row(given)))
        except Exception as error:
            where = f"after seq {last}" if self.last else "first sample"
            raise ProtocolError(f"source, {where}: {error}") from error
        if sample.seq <= last:
            raise ProtocolError(f"source: seq: got {sample.seq}, allowed: above {last}")
        return sample

    def _agreeing(self, sample: Sample) -> Sample:
        """Return a sample whose readings are those of its codes: else a replay would have other ones."""
        for name, code, value in (("hard", sample.hard_raw, sample.hard), ("soft", sample.soft_raw, sample.soft)):
            if code >= 0 and (wrong := self._disagreement(name, code, value)):
                raise ValueError(wrong)
        return sample

    def _gaps_before(self, sample: Sample) -> list[Gap]:
        """Return the gaps between the last sample and this one; before the first sample there is no baseline."""
        found = []
        while (gap := gap_of(self._source, self._passed)) and gap.seq <= sample.seq:
            self._passed += 1
            found.append(gap._replace(seq=sample.seq))
        return found if self.last else []

    def _count(self, sample: Sample) -> None:
        if before := self.last:
            self.lost += sample.seq - before.seq - 1
            self.late += sample.t_hard_ns - before.t_hard_ns > self._late_ns
        elif self._live:
            self.lost += sample.seq
            self.zero_ns = self._zero(sample)
        self.last = sample
        self.read += 1

    def _zero(self, first: Sample) -> int | None:
        """Return `time.monotonic_ns()` at t = 0: as the source knows it, else from the arrival of the first sample."""
        if not getattr(self._source, "real_time", True):
            return None
        zero_ns = zero_of(self._source)
        return time.monotonic_ns() - max(first.t_hard_ns, first.t_soft_ns) if zero_ns is None else zero_ns

    def _has_room(self) -> bool:
        """Wait until consumer and recorder have room; False: the end was requested before."""
        most = min(_AHEAD, self._ring.capacity - 1)
        while len(self._ring) > most or self._recorder_is_behind():
            if self._stopping.is_set():
                return False
            time.sleep(_WAIT_S)
        return True

    def _recorder_is_behind(self) -> bool:
        recorder = self.recorder
        return recorder is not None and recorder.is_behind


def _told(error: BaseException) -> BaseException:
    """Return the error of a source; another one for it, if it cannot be printed or a generator cannot raise it."""
    with suppress(Exception):  # of the error's own text
        str(error)
        if not isinstance(error, StopIteration):
            return error
    told = ProtocolError(f"source: raised {type(error).__name__}, allowed: an error with a text, SourceError")
    told.__cause__ = error
    return told
