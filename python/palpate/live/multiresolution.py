"""The rows of a measurement: the newest ones as they came, of those before the lowest and highest values in each part of time.

So memory is bounded, and a page gets any part of a measurement of any length at once.
"""

from bisect import bisect_left, bisect_right
from threading import Lock

import numpy as np

from palpate.live.page_frames import BINS_PER_S, ROW, Rows, extremes, thinned

KEPT = 16384  # rows for a page that is opened later: 160 s at 100 pairs per second, 16 s at 1,000 and more
NEWEST = 8192  # rows, as they came, that are kept for the noise
FINEST = 1 << 17  # newest rows of a measurement, 57 min at 38 pairs a second
WHOLE = 1 << 21  # rows of a recording: 15 h at 38 pairs a second, 100 MB
EARLIER = 1 << 17  # rows that stand for all those before
ROWS = 8192  # rows of a view, at most


class RingBuffer:
    """The newest rows in the order in which they came: `most` at least, a quarter more at most; `end` were ever added."""

    def __init__(self, most: int) -> None:
        self.end: int = 0
        self._most = most
        self._used = 0
        self._rows: Rows = np.empty(most * 5 // 4, ROW)  # memory is used as rows come

    def add(self, rows: Rows) -> Rows:
        """Add rows; return those that are forgotten for them. Rows that were returned before do not change."""
        self.end += len(rows)
        forgotten = rows[:0]
        if self._used + len(rows) > len(self._rows):
            every = np.concatenate((self.rows, rows))
            forgotten = every[: -self._most]
            rows = every[-self._most :]
            self._rows = np.empty_like(self._rows)
            self._used = 0
        self._rows[self._used : self._used + len(rows)] = rows
        self._used += len(rows)
        return forgotten

    @property
    def rows(self) -> Rows:
        """All rows in memory; a view."""
        return self._rows[: self._used]


class MultiresolutionRows:
    """The rows of a measurement. One thread adds, any reads.

    A measurement of any length thins rows in dense parts when they come. Of a recording (`whole`) a page has views alone.
    """

    def __init__(self, *, whole: bool = False) -> None:
        self._whole = whole
        self._lock = Lock()
        self._finest = RingBuffer(WHOLE if whole else FINEST)
        self._newest = RingBuffer(NEWEST)
        self._earlier: Rows = np.empty(0, ROW)
        self._per_s = BINS_PER_S
        self.span: tuple[float, float] | None = None  # times of the first and the last row, s

    @property
    def first_s(self) -> float | None:
        """Time of the first row, s; None: there is none."""
        return self.span[0] if self.span else None

    @property
    def last_s(self) -> float | None:
        """Time of the last row, s; None: there is none."""
        return self.span[1] if self.span else None

    def add(self, rows: Rows) -> None:
        """Add the next rows; their times do not go back."""
        if not len(rows):
            return
        with self._lock:
            begin_s = float(rows["t_s"][0])
            if self.span:
                begin_s = self.span[0]
            self.span = (begin_s, float(rows["t_s"][-1]))
            self._newest.add(rows)
            if not self._whole:
                rows = thinned(rows)
            forgotten = self._finest.add(rows)
            if len(forgotten):
                self._earlier = self._thinner(np.concatenate((self._earlier, forgotten)))

    def _thinner(self, rows: Rows) -> Rows:
        """Return the extremes of rows in parts of time, each of which is twice as long until there are few enough."""
        rows = thinned(rows, self._per_s)
        while len(rows) > EARLIER:
            self._per_s /= 2
            rows = thinned(rows, self._per_s)
        return rows

    @property
    def has_all(self) -> bool:
        """Whether every row is still there."""
        return not len(self._earlier)

    @property
    def end(self) -> int:
        """Number of rows so far that a page gets in frames; of a recording none."""
        return 0 if self._whole else self._finest.end

    @property
    def begin(self) -> int:
        """Number of the oldest row that a page still gets in frames."""
        return max(self.end - KEPT, 0)

    def following(self, begin: int, most: int) -> tuple[int, Rows]:
        """Return the rows for a page from a number on, at most so many, and how many are no longer there; a view."""
        with self._lock:
            missed = max(self.begin - begin, 0)
            rows = self._finest.rows
            left = max(self.end - begin - missed, 0)
            return missed, rows[len(rows) - left :][:most]

    def newest_rows(self) -> Rows:
        """Return the newest rows as they came."""
        with self._lock:
            return self._newest.rows[-NEWEST:].copy()

    def view(self, from_s: float, to_s: float, most: int) -> Rows:
        """Return at most `most` rows between two times, as fine as possible, with the extremes of all rows.

        The row before, and the one after, are there, too, so that a line reaches both ends. `most`: 16 or more.
        """
        if self.span is None or from_s > to_s:
            return np.empty(0, ROW)
        first_s, last_s = self.span
        from_s = min(max(from_s, first_s), last_s)
        to_s = max(min(to_s, last_s), first_s)
        with self._lock:
            earlier = self._earlier
            finest = self._finest.rows
        # a copy of all would take longer
        few = [_thinned_to(4 * most, _cut(part, from_s, to_s)) for part in (earlier, finest)]
        return _thinned_to(most, _cut(np.concatenate(few), from_s, to_s))


def _thinned_to(most: int, rows: Rows) -> Rows:
    if len(rows) <= most:
        return rows
    return extremes(rows, np.arange(most // 2) * len(rows) // (most // 2))


def _cut(rows: Rows, from_s: float, to_s: float) -> Rows:
    """Return the rows between two times, with the one before and the one after; a view."""
    begin = bisect_left(rows["t_s"], from_s)
    end = bisect_right(rows["t_s"], to_s)
    return rows[max(begin - 1, 0) : end + 1]
