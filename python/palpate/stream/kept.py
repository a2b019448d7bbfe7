"""The newest samples of a source, for a recording that begins later."""

from collections import deque
from typing import Any

import numpy as np

from palpate.samples import DTYPE, Block, Sample

FEWEST, MOST = 1024, 2**24
_MOST_MARKS = 10_000
_BYTES = np.dtype((np.void, DTYPE.itemsize))


class Kept:
    """Keeps the newest samples, in memory of a fixed size; the caller has a lock.

    Parameters
    ----------
    most : int
        How many samples, 1024 to 2**24.

    Attributes
    ----------
    marks : deque of dict
        Tares and gaps, as in the sidecar; some may be before the first sample that is kept.

    Raises
    ------
    ValueError
        `most` is outside its range.

    Examples
    --------
    >>> from palpate.samples import blank
    >>> kept = Kept(1024)
    >>> kept.add_block(blank(1500))
    >>> kept.has_all, kept.block()["seq"][[0, -1]].tolist()
    (False, [476, 1499])
    """

    def __init__(self, most: int) -> None:
        if not FEWEST <= most <= MOST:
            raise ValueError(f"keep: got {most}, allowed: {FEWEST} to {MOST} samples")
        self.marks: deque[dict[str, Any]] = deque(maxlen=_MOST_MARKS)
        self._rows = np.zeros(most, DTYPE)
        self._count = 0  # of all samples so far

    @property
    def has_all(self) -> bool:
        """Whether all samples since the begin are kept."""
        return self._count <= len(self._rows)

    def add(self, sample: Sample) -> None:
        """Add a sample; the oldest one goes, if there is no room."""
        self._rows[self._count % len(self._rows)] = sample
        self._count += 1

    def add_block(self, block: Block) -> None:
        """Add consecutive samples, as `add`."""
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
        if self.has_all:
            return rows[: self._count].copy().view(DTYPE)
        oldest = self._count % len(rows)
        return np.concatenate([rows[oldest:], rows[:oldest]]).view(DTYPE)
