"""The queue between the thread that reads and the consumer: a ring, and two events by which its ends wake each other."""

from collections import deque
from threading import Event

import numpy as np

from palpate._core import SampleRing
from palpate.samples import DTYPE, Block
from palpate.sources.base import Gap

_AHEAD = 2048  # a source that can wait is at most this many samples ahead of the consumer


class SampleQueue:
    """Samples on their way from the thread that reads to the consumer, and the gaps between them.

    Each end changes the ring, then sets the event of the other end; the other end clears its event, then looks at the
    ring. So no change is missed, and neither end has to poll.
    """

    def __init__(self, capacity: int) -> None:
        self.ring: SampleRing = SampleRing(capacity)
        self.gaps: deque[Gap] = deque()  # a gap is added before the first sample after it
        self._ahead = min(_AHEAD, self.ring.capacity)
        self._arrived, self._taken = Event(), Event()

    @property
    def room(self) -> int:
        """Samples that a source that can wait may add now."""
        return self._ahead - len(self.ring)

    def push_many(self, block: Block) -> None:
        """Add samples, drop those that have no room, and wake the consumer."""
        self.ring.push_many(block)
        if not self._arrived.is_set():  # for each sample again, the two threads would wait for the lock of the event
            self._arrived.set()

    def take(self, most: int) -> Block:
        """Remove the oldest samples, and wake a source that waits if at least half of its room is free."""
        block = np.empty(min(len(self.ring), most), DTYPE)
        self.ring.pop_many(block)
        if 2 * len(self.ring) <= self._ahead:
            self.wake_source()
        return block

    def close(self) -> None:
        """Accept no more samples, and wake the consumer."""
        self.ring.close()
        self._arrived.set()

    def wait_for_samples(self, limit_s: float) -> None:
        """Wait until something was added or the end came, at most this time."""
        self._arrived.wait(limit_s)
        self._arrived.clear()

    def wait_for_room(self) -> None:
        """Wait until something was taken, or `wake_source` was called."""
        self._taken.wait()
        self._taken.clear()

    def wake_source(self) -> None:
        """End the wait for room: there may be some, or the end was requested."""
        self._taken.set()
