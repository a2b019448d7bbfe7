"""The thread that reads a source, independent of the disk and of the consumer."""

import math
import time
from threading import Event, RLock, Thread

from palpate._core import SampleRing
from palpate.errors import ProtocolError
from palpate.recording.recorder import Recorder
from palpate.recording.rows import LARGEST_CODE, LARGEST_STATUS
from palpate.samples import Sample
from palpate.sources import Source

_AHEAD = 16  # a source that can wait is at most this many samples ahead of the consumer
_WAIT_S = 0.0005
_LATE = 1.5  # periods after the sample before


class Reader:
    """Reads a source in a thread; writes the samples to a ring and a recorder.

    Parameters
    ----------
    source : Source
        After `__enter__`.
    ring : SampleRing
        Closed at the end of the source.
    recorder : Recorder, optional
    period_s : float
        Time from one pair to the next; nan: unknown.

    Attributes
    ----------
    read, lost, late : int
        As in `StreamCounters`.
    last : Sample or None
    ready : Event
        Set after each new sample, and at the end.
    error : BaseException or None
        The error that ended the thread.
    lock : RLock
        Held while a sample is counted and stored. With it a caller sees complete samples, and may change the recorder.
    recorder : Recorder or None
    """

    def __init__(self, source: Source, ring: SampleRing, recorder: Recorder | None, period_s: float = math.nan) -> None:
        self.read: int = 0
        self.lost: int = 0
        self.late: int = 0
        self.last: Sample | None = None
        self.ready: Event = Event()
        self.error: BaseException | None = None
        self._source = source
        self._ring = ring
        self.lock: RLock = RLock()
        self.recorder = recorder
        self._late_ns = _LATE * period_s * 1e9
        self._stopping = Event()
        self._thread = Thread(target=self._run, name="palpate-reader", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """Request the end; returns at once."""
        self._stopping.set()
        self._source.interrupt()

    def join(self, timeout_s: float) -> bool:
        """Wait for the end; return whether the thread has ended."""
        if self._thread.ident is not None:
            self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            for sample in self._source:
                self._take(sample)
                if self._stopping.is_set():
                    break
        except BaseException as error:  # noqa: BLE001  the consumer gets any error of a source
            self.error = error
        finally:
            self._ring.close()
            self.ready.set()

    def _take(self, sample: Sample) -> None:
        if not self._source.live and not self._has_room():
            return
        with self.lock:
            if self.recorder and self.recorder.error:
                raise self.recorder.error
            self._count(sample)
            self.read += 1
            if self.recorder:
                self.recorder.push(sample)
            self._ring.push(sample)
        self.ready.set()

    def _count(self, sample: Sample) -> None:
        before = self.last
        _check(sample, before.seq if before else -1)
        if before:
            self.lost += sample.seq - before.seq - 1
            self.late += sample.t_hard_ns - before.t_hard_ns > self._late_ns
        elif self._source.live:
            self.lost += sample.seq
        self.last = sample

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


def _check(sample: Sample, last: int) -> None:
    """Raise ProtocolError for a sample that a recording cannot store."""
    codes = min(sample.hard_raw, sample.soft_raw) >= -1 and max(sample.hard_raw, sample.soft_raw) <= LARGEST_CODE
    if not (codes and last < sample.seq < 2**63 and 0 <= sample.status <= LARGEST_STATUS):
        raise ProtocolError(
            f"source: got {sample}, allowed: seq above {last}, codes of 24 bits or -1, status 0 to {LARGEST_STATUS}"
        )
