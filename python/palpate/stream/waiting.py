"""The samples that wait for the consumer: a ring, and two events by which its ends wake each other."""

from collections.abc import Mapping
from threading import Event
from typing import Any

import numpy as np

from palpate._core import SampleRing
from palpate.samples import DTYPE, Block, Sample

_AHEAD = 2048  # a source that can wait is at most this many samples ahead of the consumer
_LEAST, _MOST, _LAG_S = 4096, 2**20, 1.0


class Waiting:
    """Samples on their way from the thread that reads to the consumer.

    Each end sets the event of the other one after its change of the ring; the other one clears its event before it looks
    at the ring, first whether it is closed: so no change is missed, and neither end has to look again and again.

    Parameters
    ----------
    capacity : int
        As of `SampleRing`.

    Attributes
    ----------
    ring : SampleRing
    """

    def __init__(self, capacity: int) -> None:
        self.ring: SampleRing = SampleRing(capacity)
        self._ahead = min(_AHEAD, self.ring.capacity)
        self._arrived, self._taken = Event(), Event()

    @property
    def room(self) -> int:
        """Samples that a source that can wait may add now."""
        return self._ahead - len(self.ring)

    def push(self, sample: Sample) -> None:
        """Add a sample, or drop it, and wake the consumer."""
        self.ring.push(sample)
        self._arrived.set()

    def push_many(self, block: Block) -> None:
        """Add samples, drop those that have no room, and wake the consumer."""
        self.ring.push_many(block)
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


def capacity_for(device: Mapping[str, Any]) -> int:
    """Return the room for the samples of an instrument: a second of them, at least 4096.

    Examples
    --------
    >>> capacity_for({}), capacity_for({"period_s": 0.026}), capacity_for({"period_s": 1e-5})
    (4096, 4096, 100000)
    """
    return min(max(_LEAST, round(_LAG_S / float(device.get("period_s", _LAG_S)))), _MOST)
