"""The newest samples of a measurement, for a recording that begins later."""

from collections import deque
from typing import Any, NamedTuple

import numpy as np

from palpate.recording.sidecar import BEGUN, marked
from palpate.samples import DTYPE, Block, samples_of

_FEWEST, _MOST, _MOST_MARKS = 1024, 2**24, 10_000
_BYTES = np.dtype((np.void, DTYPE.itemsize))
NO_BASELINE = "a replay has no baseline from them"
BEGIN = "begin of the recording"
"""Text of the tare mark with which a recording begins that was started later than the measurement."""
MAY_DIFFER = "the baseline is measured there: the touches of a replay may differ until it is measured again"
WITHIN = "; later ones agree within their uncertainty, as the times are those of the computer"


class Beginning(NamedTuple):
    """The first rows of a recording, the tares and gaps in them, and a note on where they begin; "": with the measurement."""

    block: Block
    marks: list[dict[str, Any]]
    note: str


class Memory:
    """Keeps the newest samples, in memory of a fixed size; the caller has the lock of the reader.

    Examples
    --------
    >>> from palpate.samples import blank
    >>> memory = Memory(1024)
    >>> memory.push_many(blank(1500))
    >>> memory.block()["seq"][[0, -1]].tolist()
    [476, 1499]
    """

    def __init__(self, most: int) -> None:
        if not _FEWEST <= most <= _MOST:
            raise ValueError(f"keep: got {most}, allowed: {_FEWEST} to {_MOST} samples")
        self.marks: deque[dict[str, Any]] = deque(maxlen=_MOST_MARKS)  # tares and gaps, as in the sidecar
        self._rows = np.zeros(most, DTYPE)
        self._count = 0  # of all samples so far

    def push_many(self, block: Block) -> None:
        """Add consecutive samples; the oldest ones go, if there is no room."""
        most = len(self._rows)
        newest = block[-most:]
        begin = (self._count + len(block) - len(newest)) % most
        before_end = newest[: most - begin]
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

    def beginning(self, recorded: int | None, *, host_stamps: bool) -> Beginning:
        """Return how a recording begins: with all samples that are kept, after the last one that was `recorded` before."""
        block = self.block()
        if recorded is not None:
            block = block[np.searchsorted(block["seq"], recorded, "right") :]
        before = self._count - len(block)
        if not before:
            return Beginning(block, list(self.marks), "")
        note = f"{BEGUN}{before} pairs: {MAY_DIFFER}{WITHIN if host_stamps else ''}"
        if not len(block):
            return Beginning(block, [], note)
        first = samples_of(block[:1])[0]
        marks = [mark for mark in self.marks if mark["seq"] >= first.seq]
        return Beginning(block, [marked(BEGIN, first, tare=True), *marks], note)
