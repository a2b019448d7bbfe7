"""Samples from the thread that reads: the queue to the consumer, and a backlog for recordings.

A recording that is started later than the measurement can begin with the backlog.
"""

from collections import deque
from threading import Event
from typing import NamedTuple

import numpy as np

from palpate._core import SampleRing
from palpate.recording.sidecar import BEGUN, SidecarMark
from palpate.samples import DTYPE, Block, samples_of
from palpate.source_events import SourceEvent

_FEWEST = 1024
_MOST = 2**24
_MOST_MARKS = 10_000
_BYTES = np.dtype((np.void, DTYPE.itemsize))
NO_BASELINE = "a replay has no baseline from them"
BEGIN = "begin of the recording"
"""Text of the tare mark of a recording that was started later than the measurement."""
MAY_DIFFER = (
    "the baseline is measured there: the touches of a replay may differ until it is measured again"
)
WITHIN = "; later ones agree within their uncertainty, as the times are those of the computer"


class BacklogStart(NamedTuple):
    """The first rows of a recording, the tares and gaps in them, and a note on where they begin.

    The note is empty if they begin with the measurement.
    """

    block: Block
    marks: list[SidecarMark]
    note: str


class Backlog:
    """Keeps the newest samples in memory of a fixed size; the caller holds the reader's lock."""

    def __init__(self, limit: int) -> None:
        if not _FEWEST <= limit <= _MOST:
            raise ValueError(f"keep: got {limit}, allowed: {_FEWEST} to {_MOST} samples")
        self.marks: deque[SidecarMark] = deque(maxlen=_MOST_MARKS)  # tares and gaps
        self._rows = np.zeros(limit, DTYPE)
        self._count = 0  # of all samples so far

    def push_many(self, block: Block) -> None:
        """Add consecutive samples; the oldest ones go, if there is no room."""
        limit = len(self._rows)
        newest = block[-limit:]
        begin = (self._count + len(block) - len(newest)) % limit
        before_end = newest[: limit - begin]
        self._rows[begin : begin + len(before_end)] = before_end
        self._rows[: len(newest) - len(before_end)] = newest[len(before_end) :]
        self._count += len(block)

    def block(self) -> Block:
        """Return a copy of the samples that are kept, in order of time."""
        rows = self._rows.view(_BYTES)  # a copy field by field takes ten times as long
        if self._count <= len(rows):
            return rows[: self._count].copy().view(DTYPE)
        oldest = self._count % len(rows)
        return np.concatenate([rows[oldest:], rows[:oldest]]).view(DTYPE)

    def start_after(self, recorded: int | None, *, host_stamps: bool) -> BacklogStart:
        """Return how a recording begins: with the samples after number `recorded`; None: all."""
        block = self.block()
        if recorded is not None:
            block = block[np.searchsorted(block["seq"], recorded, "right") :]
        before = self._count - len(block)
        if not before:
            return BacklogStart(block, list(self.marks), "")
        note = f"{BEGUN}{before} pairs: {MAY_DIFFER}"
        if host_stamps:
            note += WITHIN
        if not len(block):
            return BacklogStart(block, [], note)
        first = samples_of(block[:1])[0]
        marks = [mark for mark in self.marks if mark.seq >= first.seq]
        return BacklogStart(block, [SidecarMark.at(first, BEGIN, "tare"), *marks], note)


_AHEAD = 2048  # a source that can wait is at most this many samples ahead of the consumer


class SampleQueue:
    """Samples between the thread that reads and the consumer, and the events between them."""

    # Each end changes the ring, then sets the event of the other end; the other end clears its
    # event, then looks at the ring. So no change is missed, and neither end has to poll.

    def __init__(self, capacity: int) -> None:
        self.ring: SampleRing = SampleRing(capacity)
        self._events: deque[tuple[int, SourceEvent]] = deque()  # and the samples pushed before it
        self._pushed = 0
        self._popped = 0
        self._ahead = min(_AHEAD, self.ring.capacity)
        self._arrived = Event()
        self._taken = Event()

    @property
    def room(self) -> int:
        """Samples that a source that can wait may add now."""
        return self._ahead - len(self.ring)

    def push_many(self, block: Block) -> None:
        """Add samples, drop those that have no room, and wake the consumer."""
        self._pushed += self.ring.push_many(block)
        # for each sample again, the two threads would wait for the lock of the event
        if not self._arrived.is_set():
            self._arrived.set()

    def push_event(self, event: SourceEvent) -> None:
        """Add an event after the samples so far, and wake the consumer."""
        self._events.append((self._pushed, event))
        self._arrived.set()

    def take(self, limit: int) -> Block | SourceEvent | None:
        """Remove the next event, or the oldest samples before it; None: the queue is empty.

        Wakes a source that waits if at least half of its room is free.
        """
        # The ring first: an event is added before the samples after it.
        count = min(len(self.ring), limit)
        if self._events:
            place, event = self._events[0]
            if place == self._popped:
                self._events.popleft()
                return event
            count = min(count, place - self._popped)
        block = np.empty(count, DTYPE)
        self._popped += self.ring.pop_many(block)
        if 2 * len(self.ring) <= self._ahead:
            self.wake_source()
        return block if count else None

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
