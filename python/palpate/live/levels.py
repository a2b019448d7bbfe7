"""The rows of a measurement at several levels of detail, so that a page gets any part of it at any width at once.

A level has two rows in each bin: lowest and highest values. Its bins are four times as wide as those of the level before.
In a live measurement each level keeps its newest rows: the finest one forgets first, the coarsest one never, since a
coarser one begins before.
"""

import math
from bisect import bisect_left, bisect_right
from collections import deque
from threading import Lock

import numpy as np

from palpate.live.feed import BINS_PER_S, ROW, Rows, thinned
from palpate.live.newest import Newest

KEPT = 16384
"""Rows that are kept for a page that is opened later: 160 s at 100 pairs per second, 16 s at 1,000 and more."""
NEWEST = 8192
"""Rows, as they came, that are kept for the noise."""
FINEST, COARSER = 1 << 17, 1 << 16
"""Rows of the finest level of a live measurement, 57 min at 38 pairs a second; and of each coarser one."""
WHOLE = 1 << 21
"""Rows of the finest level of a recording: 15 h at 38 pairs a second, 100 MB."""
_AT_ONCE = 4096  # rows that go to the coarser levels together
_SPLIT = 16384  # rows of the coarsest level, with which a coarser one begins
_WIDER = 4
_ENOUGH = 2 * _WIDER  # times the rows asked for: of more rows the next coarser level has enough, too; of a level _WIDER


class _Level(Newest):
    """A level: two rows in each bin; per_s: bins in a second, 0 for the finest one with all rows."""

    def __init__(self, per_s: float, most: int, room: int = 0) -> None:
        super().__init__(most, room)
        self.per_s = per_s

    @property
    def forgets(self) -> bool:
        """Whether its first rows are no longer there."""
        return self.end > self._used

    def join(self, rows: Rows) -> None:
        """Add rows that begin, perhaps, in the last bin."""
        if not self.per_s:
            self.add(rows)
            return
        rows = thinned(rows, self.per_s)
        last = self.rows[-2:]
        if len(last) and len(rows):
            bins = np.floor(last["t_s"] * self.per_s) == math.floor(rows["t_s"][0] * self.per_s)
            again = int(np.count_nonzero(bins))
            self._used -= again
            self.end -= again
            rows = thinned(np.concatenate((last[bins], rows)), self.per_s)
        self.add(rows)


class Levels:
    """The rows of a measurement. One thread adds, any reads.

    Parameters
    ----------
    whole : bool
        For a recording: all rows stay as they are, up to `WHOLE`; with more, the finest level goes and the next is the
        finest. False: for a measurement of any length; rows in dense parts are thinned when they come.

    Attributes
    ----------
    recent : Newest
        For a page that follows the measurement; of a recording it has views alone.
    """

    def __init__(self, *, whole: bool = False) -> None:
        self.recent = Newest(KEPT)
        self._whole, self._lock = whole, Lock()
        self._levels = [_Level(0, 2 * WHOLE, WHOLE) if whole else _Level(0, FINEST)]  # memory is used as rows come
        self._newest, self._count = deque[Rows](), 0
        self._waiting, self._late = list[Rows](), 0  # not yet in the coarser levels
        self._span: tuple[float, float] | None = None

    def add(self, rows: Rows) -> None:
        """Add the next rows; their times do not go back."""
        if not len(rows):
            return
        kept = rows if self._whole else thinned(rows)
        with self._lock:
            first = self._span[0] if self._span else float(rows["t_s"][0])
            self._span = first, float(rows["t_s"][-1])
            self._keep(rows)
            if not self._whole:
                self.recent.add(kept)
            self._finest.join(kept)
            self._waiting.append(kept)
            self._late += len(kept)
            if self._late >= _AT_ONCE:
                self._pass_on()

    @property
    def span(self) -> tuple[float, float] | None:
        """Times of the first and the last row, s; None: there is no row."""
        return self._span

    @property
    def finest_s(self) -> float:
        """Width of the bins of the finest level, s; 0: it has all rows."""
        per_s = self._finest.per_s
        return 1 / per_s if per_s else 0.0

    def following(self, begin: int, most: int) -> tuple[int, Rows]:
        """Return the recent rows from a number on, at most so many, and how many are no longer there; a view."""
        with self._lock:
            missed = max(self.recent.begin - begin, 0)
            return missed, self.recent.part(begin + missed, most)

    def newest_rows(self) -> Rows:
        """Return the newest rows as they came."""
        with self._lock:
            newest = list(self._newest)
        return np.concatenate([np.empty(0, ROW), *newest])[-NEWEST:]

    def view(self, from_s: float, to_s: float, most: int) -> Rows:
        """Return the rows between two times, at most so many: as fine as possible, with the extremes of whole bins.

        The row or bin before, and the one after, are there, too, so that a line reaches both ends.

        Parameters
        ----------
        from_s, to_s : float
            s.
        most : int
            At least 16.

        Returns
        -------
        numpy.ndarray of `ROW`, shape (n,)
        """
        return self.finest(from_s, to_s, most)[1]

    def finest(self, from_s: float, to_s: float, most: int) -> tuple[float, Rows]:
        """Return what `view` returns, and before it how many bins a second it has; 0: it has all rows."""
        if self._span is None or from_s > to_s:
            return 0.0, np.empty(0, ROW)
        low, high = self._span
        from_s, to_s = min(max(from_s, low), high), max(min(to_s, high), low)
        per_s, part = self._around(from_s, to_s, most)
        shown = _between(part, per_s, from_s, to_s)
        while len(shown) > most:
            per_s = per_s / 2 if per_s else _per_s(part, 1)
            part = thinned(part, per_s)
            shown = _between(part, per_s, from_s, to_s)
        return per_s, shown

    @property
    def _finest(self) -> _Level:
        return self._levels[0]

    def _around(self, from_s: float, to_s: float, most: int) -> tuple[float, Rows]:
        """Return rows of the finest level that is coarse enough, with more on both sides than a bin can have in the end."""
        more_s = 8 * (to_s - from_s) / most
        with self._lock:
            for level in self._levels:
                part = _between(level.rows, level.per_s, from_s - more_s, to_s + more_s)
                remembers = not level.forgets or level.rows["t_s"][0] <= from_s - more_s
                if remembers and len(part) <= most * (_ENOUGH if level is self._finest else _WIDER):
                    break
            if level is self._finest:
                return level.per_s, part.copy() if level.per_s else part  # the last bin may still change
            late = [_between(rows, 0, from_s - more_s, to_s + more_s) for rows in self._waiting]
            return level.per_s, thinned(np.concatenate((part, *late)), level.per_s)

    def _keep(self, rows: Rows) -> None:
        """Keep the rows as they came, and forget those beyond `NEWEST`."""
        self._newest.append(rows)
        self._count += len(rows)
        while self._count - len(self._newest[0]) >= NEWEST:
            self._count -= len(self._newest.popleft())

    def _pass_on(self) -> None:
        """Give what waits to the coarser levels; begin a new one, or end the finest one, if it is time to."""
        rows, self._waiting, self._late = np.concatenate(self._waiting), [], 0
        for level in self._levels[1:]:
            rows = thinned(rows, level.per_s)
            level.join(rows)
        coarsest = self._levels[-1]
        if len(coarsest.rows) >= _SPLIT:
            per_s = coarsest.per_s / _WIDER if coarsest.per_s else _per_s(coarsest.rows, 2 * _WIDER)
            self._levels.append(_Level(per_s, 2 * WHOLE if self._whole else COARSER))
            self._levels[-1].join(coarsest.rows)
        if self._whole and len(self._finest.rows) > WHOLE:
            del self._levels[0]


def _per_s(rows: Rows, count: int) -> float:
    """Return bins a second with so many rows in each at least, as the median has it; they nest in those of any other."""
    step_s = float(np.median(np.diff(rows["t_s"][-4096:])))
    wider = math.ceil(math.log2(count * step_s * BINS_PER_S)) if step_s > 0 else 0
    return math.ldexp(BINS_PER_S, -wider)


def _between(rows: Rows, per_s: float, from_s: float, to_s: float) -> Rows:
    """Return the rows from one bin to another, with the bin before and the one after; per_s 0: of these times."""
    times = rows["t_s"]

    def bin_of(t_s: float) -> float:
        return math.floor(t_s * per_s) if per_s else t_s

    begin, end = bisect_left(times, bin_of(from_s), key=bin_of), bisect_right(times, bin_of(to_s), key=bin_of)
    if begin > 0:
        begin = bisect_left(times, bin_of(times[begin - 1]), hi=begin, key=bin_of)
    if end < len(times):
        end = bisect_right(times, bin_of(times[end]), lo=end, key=bin_of)
    return rows[begin:end]
