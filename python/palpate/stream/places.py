"""The places from which a replay has the same state as the measurement: where the baseline begins to be measured.

After a release the baseline is measured from 32 new readings. What the tracker knew before has no more effect then: a
replay that begins with the first of these readings gives the same bits for all later touches. The same holds after a tare
and after a gap.
"""

from collections import deque
from threading import Lock
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate.samples import Block

BASELINE = 32
"""Readings from which a tracker measures a baseline."""
_MOST = 65536


class Measured(NamedTuple):
    """A baseline that was measured after a release: number of the reading before its first one, and of its last one."""

    before: int
    last: int


class Places:
    """Follows the readings that a tracker takes; asked from any thread."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._measured: deque[Measured] = deque(maxlen=_MOST)
        self._turns: deque[int] = deque([0], maxlen=_MOST)  # numbers with which contact ended, began, ended, ...
        self._before = np.empty(0, np.int64)  # numbers of the last readings
        self._contact = False

    def measured(self) -> list[Measured]:
        """Return the baselines that were measured after a release, the oldest first."""
        with self._lock:
            return list(self._measured)

    def without_contact(self) -> list[tuple[int, int]]:
        """Return the times without contact, the oldest first: number of the first reading, and of the one after the last."""
        with self._lock:
            turns, last = list(self._turns), self._before[-1:].tolist()
            turns += [] if self._contact or not last else [last[0] + 1]
        return list(zip(turns[-2::-2], turns[::-2], strict=False))[::-1]

    def follow(self, block: Block, rows: NDArray[Any]) -> None:
        """Take the next samples, and the rows that `Tracker.process` returned for them."""
        contact = rows["contact"] | (rows["touch"] > 0)
        with self._lock:
            seqs = np.concatenate([self._before, block["seq"]])
            for end in np.flatnonzero(rows["revised"]) + len(self._before):
                if end >= BASELINE:
                    self._measured.append(Measured(int(seqs[end - BASELINE]), int(seqs[end])))
            self._before = seqs[-BASELINE:]
            turned = np.flatnonzero(np.diff(contact, prepend=self._contact))
            self._turns.extend(block["seq"][turned].tolist())
            self._contact = bool(contact[-1])
