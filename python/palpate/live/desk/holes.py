"""Where pairs are missing in a measurement: what the page shows as gaps."""

from itertools import count, takewhile
from typing import NamedTuple

import numpy as np

from palpate.samples import Block
from palpate.sources import Source
from palpate.sources.base import Gap
from palpate.sources.claims import gap_of

SHORTEST_S = 0.25
"""A hole without a message of the source is shown from here on; all are counted."""
_MOST = 200


class Hole(NamedTuple):
    """Times of the samples before and after it, s, how many pairs are missing, and what happened."""

    from_s: float
    to_s: float
    lost: int
    text: str


class Holes:
    """Finds holes in the samples of a source, as they come.

    Parameters
    ----------
    source : Source

    Attributes
    ----------
    source : Source
    found : tuple of Hole
        The newest ones, in order of time.

    Examples
    --------
    >>> import palpate
    >>> from palpate.samples import blank
    >>> block = blank(4)
    >>> block["seq"], block["t_hard_ns"] = [0, 1, 40, 41], np.array([0.0, 0.25, 10.0, 10.25]) * 1e9
    >>> holes = Holes(palpate.open("sim:"))
    >>> holes.follow(block)
    >>> holes.found
    (Hole(from_s=0.25, to_s=10.0, lost=38, text='38 pairs are missing'),)
    """

    def __init__(self, source: Source) -> None:
        self.source: Source = source
        self.found: tuple[Hole, ...] = ()
        self._passed = 0  # gaps of the source
        self._last = np.empty(0, np.int64), np.empty(0)

    def follow(self, block: Block) -> None:
        """Look at the next samples."""
        if not len(block):
            return
        seq, t_s = (
            np.append(last, new)
            for last, new in zip(self._last, (block["seq"], block["t_hard_ns"] * 1e-9), strict=True)
        )
        self._last = seq[-1:], t_s[-1:]
        texts = {int(np.searchsorted(seq, gap.seq)): gap.text for gap in self._gaps(int(seq[-1]))}
        long = np.flatnonzero((np.diff(seq) > 1) & (np.diff(t_s) >= SHORTEST_S)) + 1
        for at in sorted({*texts, *long.tolist()} - {0}):
            missing = int(seq[at] - seq[at - 1]) - 1
            text = texts.get(at, f"{missing} pairs are missing")
            self.found = (*self.found, Hole(float(t_s[at - 1]), float(t_s[at]), missing, text))[-_MOST:]

    def _gaps(self, seq: int) -> list[Gap]:
        """Return those gaps of the source that are before this sample, once each."""
        gaps = (gap_of(self.source, number) for number in count(self._passed))
        found = [gap for gap in takewhile(lambda gap: gap is not None and gap.seq <= seq, gaps) if gap]
        self._passed += len(found)
        return found
