"""The consumer's side of a stream: samples go to the tracker, results to the listeners."""

from collections.abc import Iterator
from threading import RLock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate._core import Tracker
from palpate.samples import (
    DTYPE,
    RETAKEN,
    Block,
    Sample,
    Status,
    columns_for,
    feed,
    refused_samples,
    samples_of,
    saturated_samples,
)
from palpate.source_events import Gap
from palpate.stream.batches import Batch
from palpate.stream.buffers import SampleQueue
from palpate.stream.listeners import Listeners
from palpate.touch import Touch
from palpate.touch_readings.stiffening_watch import StiffeningWatch

# Shortest time outside the range of the converter that is reported, s: without a touch, and since a
# touch that has samples.
IDLE_S = 2.0
PRESSED_S = 10.0
_CHANNELS = (("hard", Status.HARD_SATURATED), ("soft", Status.SOFT_SATURATED))
# Samples sent at once: the baseline after a touch takes as many, so a touch is not revised in the
# part in which it ends.
_PART = 32


class Pipeline:
    """Sends the queued samples to a tracker, and the results to the listeners."""

    def __init__(self, queue: SampleQueue, tracker: Tracker, listeners: Listeners) -> None:
        # Held while samples go to the tracker: one thread may iterate while another one closes.
        self.lock: RLock = RLock()
        settings = tracker.settings
        self.range: RangeWatch = RangeWatch(settings["full_scale"], settings["initial_ratio"])
        self.delivered = self.refused = self.saturated = 0  # as in `StreamCounters`
        self.last: Sample | None = None
        self._queue = queue
        self._tracker = tracker
        self._watch = StiffeningWatch(tracker)
        self._listeners = listeners
        # in batches so far
        self._touches = tracker.touch_count
        self._revisions = tracker.revision_count
        self._judgements = len(tracker.judgements)
        self._retaken = self._reported = tracker.retaken
        self._ended: list[Touch] = []
        self._revised: list[tuple[int, Touch]] = []
        self._finished = False

    @property
    def retaken(self) -> int:
        """How often the baseline was found to be wrong, and measured again."""
        return self._tracker.retaken - self._retaken

    @property
    def touches(self) -> list[Touch]:
        """The touches of the tracker, those on objects that stiffen with the flag."""
        return self._watch.touches

    def take(self, limit: int = 1024) -> Batch | None:
        """Feed at most this number of queued samples to the tracker; None: the queue is empty."""
        while True:
            with self.lock:
                item = self._queue.take(limit)
                if item is None:
                    return None
                if isinstance(item, np.ndarray):
                    batch, messages = self._send(item)
                    break
                if isinstance(item, Gap):
                    self._tracker.gap()
            self._listeners.event(item)
            if isinstance(item, Gap):
                self._listeners.message(
                    f"{item.text}: the baseline is measured again: touch nothing"
                )
        for message in messages:  # when all is done: a listener may raise
            self._listeners.message(message)
        self._listeners.batch(batch)
        return batch

    def drain(self) -> None:
        """Send all samples that wait, and end a touch that is still running."""
        while self.take():
            pass
        self.finish()

    def finish(self) -> Batch | None:
        """End a touch that is still running; return the last batch, None if nothing ended."""
        with self.lock:
            if self._finished:
                return None
            self._finished = True
            self._watch.finish()
            nothing = np.empty(0, DTYPE)
            last = self._batch(nothing, feed(self._tracker, nothing))
        if not last.touches and not last.judgements:
            return None
        self._listeners.batch(last)
        return last

    def _send(self, block: Block) -> tuple[Batch, list[str]]:
        """Return the estimates of samples, and messages."""
        self.delivered += len(block)
        parts = list(self._parts(block))
        rows = np.concatenate(parts, out=np.empty(len(block), parts[0].dtype))
        self.last = samples_of(block[-1:])[0]
        self.refused += int(np.count_nonzero(refused_samples(block)))
        if block["status"].any():
            self.saturated += int(np.count_nonzero(saturated_samples(block)))
        messages = [RETAKEN] * (self._tracker.retaken - self._reported)
        self._reported = self._tracker.retaken
        return self._batch(block, rows), messages + self.range.follow(block, rows)

    def _parts(self, block: Block) -> Iterator[NDArray[Any]]:
        """Send samples in small parts; note each touch at its end, before it is revised."""
        t_hard, t_soft, hard, soft = map(np.ascontiguousarray, columns_for(self._tracker, block))
        for begin in range(0, len(block), _PART):
            end = begin + _PART
            yield self._watch.process(
                t_hard[begin:end], t_soft[begin:end], hard[begin:end], soft[begin:end]
            )
            self._note_touches()

    def _note_touches(self) -> None:
        touches = self._watch.touches_since(self._touches)
        numbers = self._tracker.revisions_since(self._revisions)
        self._touches += len(touches)
        self._revisions += len(numbers)
        self._ended += touches
        for number in numbers:
            self._revised.append((number, self._watch.touches_since(number - 1)[0]))

    def _batch(self, block: Block, rows: NDArray[Any]) -> Batch:
        """Return a batch with the touches that ended or were revised since the last one."""
        self._note_touches()
        ended = self._ended
        self._ended = []
        revised = self._revised
        self._revised = []
        judgements = self._tracker.judgements_since(self._judgements)
        self._judgements += len(judgements)
        first = self._touches - len(ended) + 1
        return Batch(block, rows, ended, first, revised, judgements)


class RangeWatch:
    """Follows which channels are outside the range of the converter, and for how long."""

    def __init__(self, full_scale_pF: float, initial_ratio: float) -> None:
        # of "hard" and "soft": outside the range, and not because of a touch
        self.channels: tuple[str, ...] = ()
        self._full_scale_pF = full_scale_pF
        self._initial_ratio = initial_ratio
        self._since_ns: dict[str, int] = {}

    def follow(self, block: Block, rows: NDArray[Any]) -> list[str]:
        """Take at least one sample, with its row of `Tracker.process`; return messages."""
        outside = {}
        for name, flag in _CHANNELS:
            is_saturated = block["status"] & int(flag) != 0
            outside[name] = is_saturated | (np.abs(block[name]) >= self._full_scale_pF)
        is_inside = not (outside["hard"].any() or outside["soft"].any())
        if is_inside and not self._since_ns:
            return []
        # A channel that left its range begins a touch without any samples.
        pressed = rows["contact"] & (rows["ratio"] != self._initial_ratio)
        messages: list[str] = []
        for row, t_ns in enumerate(block["t_hard_ns"].tolist()):
            longest_s = PRESSED_S if pressed[row] else IDLE_S
            now: list[str] = []
            for name, are_outside in outside.items():
                if are_outside[row]:
                    self._since_ns.setdefault(name, t_ns)
                elif np.isfinite(block[name][row]):  # a lost reading changes nothing
                    self._since_ns.pop(name, None)
                if t_ns - self._since_ns.get(name, t_ns) >= longest_s * 1e9:
                    now.append(name)
            if set(now) - set(self.channels):
                messages.append(_out_of_range(now, longest_s))
            self.channels = tuple(now)
        return messages


def _out_of_range(channels: list[str], longest_s: float) -> str:
    return (
        f"{' and '.join(channels)}: outside the range of the converter for {longest_s:g} s, and "
        "nothing is measured: lift the probe; if it stays so, the range has to be set again, "
        "without contact (Stream.centre; record --recentre)"
    )
