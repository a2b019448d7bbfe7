"""The consumer's side of a stream: sends samples to the tracker, and counts them."""

from collections import deque
from collections.abc import Callable, Iterator
from threading import RLock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate._core import Touch, Tracker
from palpate.samples import DTYPE, RETAKEN, Block, Sample, columns_for, feed, refused, samples_of, saturated
from palpate.sources.base import Gap
from palpate.stream.estimate import Batch
from palpate.stream.places import Places
from palpate.stream.promise_watch import PromiseWatch
from palpate.stream.range_watch import RangeWatch
from palpate.stream.waiting import Waiting

_PART = 32  # samples: the baseline after a touch takes as many, so a touch is not revised in the part in which it ends


class Feeding:
    """Sends the samples that wait to a tracker.

    Parameters
    ----------
    waiting : Waiting
    tracker : Tracker
    gaps : deque of Gap
        Those that the samples that wait have not yet passed: at each the baseline is measured again.
    notify : callable
        Called with a message at a gap, when the baseline is found to be wrong, when the range is left without a touch,
        and at the first sample of each kind that no source should give.
    places : Places, optional
        Follows what the tracker takes.

    Attributes
    ----------
    delivered, refused, saturated : int
        As in `StreamCounters`.
    last : Sample or None
        The last sample that was sent.
    range : RangeWatch
    lock : RLock
        Held while samples go to the tracker: one thread may iterate while another one closes.
    """

    def __init__(
        self,
        waiting: Waiting,
        tracker: Tracker,
        gaps: deque[Gap],
        notify: Callable[[str], None],
        places: Places | None = None,
    ) -> None:
        self.lock: RLock = RLock()
        settings = tracker.settings
        self.range: RangeWatch = RangeWatch(settings["full_scale"], settings["initial_ratio"])
        self._promises = PromiseWatch()
        self._waiting, self._gaps = waiting, gaps
        self.delivered = self.refused = self.saturated = 0
        self.last: Sample | None = None
        self._tracker, self._notify, self._places = tracker, notify, places
        self._touches, self._revisions = tracker.touch_count, tracker.revision_count  # in batches so far
        self._retaken = self._told = tracker.retaken
        self._ended: list[Touch] = []
        self._revised: list[tuple[int, Touch]] = []
        self._finished = False

    @property
    def dropped(self) -> int:
        """Samples that had no room."""
        return self._waiting.ring.dropped

    @property
    def retaken(self) -> int:
        """How often the baseline was found to be wrong, and measured again."""
        return self._tracker.retaken - self._retaken

    def take(self, most: int = 1024) -> Batch | None:
        """Send the samples that wait, so many at most, to the tracker; None: none waits."""
        with self.lock:
            block = self._waiting.take(most)
            return self._send(block) if len(block) else None

    def drain(self) -> None:
        """Send all samples that wait, and end a touch that is still running."""
        while self.take():
            pass
        self.finish()

    def _send(self, block: Block) -> Batch:
        self.delivered += len(block)
        rows, messages = self._feed(block)
        self.last = samples_of(block[-1:])[0]
        if self._places:
            self._places.follow(block, rows)
        found = int(np.count_nonzero(refused(block)))
        self.refused += found
        if block["status"].any():
            self.saturated += int(np.count_nonzero(saturated(block)))
        while self._told < self._tracker.retaken:
            self._told += 1
            messages.append(RETAKEN)
        messages += self.range.follow(block, rows)
        messages += self._promises.follow(block, has_refused=found > 0)
        for message in messages:  # when all is done: it may raise
            self._notify(message)
        return self._batch(block, rows)

    def _feed(self, block: Block) -> tuple[NDArray[Any], list[str]]:
        """Send samples to the tracker; return its rows, and messages.

        Each gap comes directly before its sample, so that a replay has the same bits.
        """
        parts: list[NDArray[Any]] = []
        messages: list[str] = []
        begin = 0
        while self._gaps and self._gaps[0].seq <= block["seq"][-1]:
            gap = self._gaps.popleft()
            at = max(begin, int(np.searchsorted(block["seq"], gap.seq)))
            parts += self._parts(block[begin:at])
            self._tracker.gap()
            begin = at
            messages.append(f"{gap.text}: the baseline is measured again: touch nothing")
        parts += self._parts(block[begin:])
        if len(parts) == 1:
            return parts[0], messages
        rows = np.empty(len(block), parts[0].dtype)
        begin = 0
        for part in parts:
            rows[begin : begin + len(part)] = part
            begin += len(part)
        return rows, messages

    def _parts(self, block: Block) -> Iterator[NDArray[Any]]:
        """Send samples, few at a time; note each touch as it is at its end, before it is revised."""
        t_hard, t_soft, hard, soft = map(np.ascontiguousarray, columns_for(self._tracker, block))
        for begin in range(0, len(block), _PART):
            end = begin + _PART
            yield self._tracker.process(t_hard[begin:end], t_soft[begin:end], hard[begin:end], soft[begin:end])
            self._note_touches()

    def _note_touches(self) -> None:
        touches, numbers = self._tracker.touches_since(self._touches), self._tracker.revisions_since(self._revisions)
        self._touches += len(touches)
        self._revisions += len(numbers)
        self._ended += touches
        self._revised += [(n, self._tracker.touches_since(n - 1)[0]) for n in numbers]

    def finish(self) -> Batch | None:
        """End a touch that is still running; return the last batch, None if nothing ended."""
        with self.lock:
            if self._finished:
                return None
            self._finished = True
            self._tracker.finish()
            if self._tracker.touch_count == self._touches:
                return None
            nothing = np.empty(0, DTYPE)
            return self._batch(nothing, feed(self._tracker, nothing))

    def _batch(self, block: Block, rows: NDArray[Any]) -> Batch:
        """Return a batch with the touches that ended, and those that were revised, since the last one."""
        self._note_touches()
        ended, self._ended = self._ended, []
        revised, self._revised = self._revised, []
        return Batch(block, rows, ended, self._touches - len(ended) + 1, revised)
