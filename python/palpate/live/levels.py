"""The rows of a measurement at several levels of detail, so that a page gets any part of it at any width at once.

The finest level has the rows as they came. Of each eight rows of a level the next one has two: lowest and highest values.
Each level keeps its newest rows: the finest one forgets first, the coarsest one never, since a coarser one begins before.
"""

from bisect import bisect_left, bisect_right
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from palpate.live.feed import ROW, Flag, Rows, extremes, thinned

KEPT = 16384  # rows for a page that is opened later: 160 s at 100 pairs per second, 16 s at 1,000 and more
NEWEST = 8192  # rows, as they came, that are kept for the noise
FINEST, COARSER = 1 << 17, 1 << 16  # rows of the finest level, 57 min at 38 pairs a second; of each coarser one
WHOLE = 1 << 21  # rows of the finest level of a recording: 15 h at 38 pairs a second, 100 MB
ROWS = 4096  # rows of a view, at most
_BLOCK = 8  # rows of a level that become two of the next one
_AT_ONCE = 512  # rows that go to the next level together
_SPLIT = 16384  # rows of the coarsest level, with which a coarser one begins
_ENOUGH = 8  # times the rows asked for: a level with more is finer than a view needs
_POINTS = 160  # of the course of a touch
_SLACK_S = 1e-6  # the times of rows and of touches are rounded


class Newest:
    """The newest rows in the order in which they came: `most` at least, a quarter more at most; `end` were ever added."""

    def __init__(self, most: int) -> None:
        self.end: int = 0
        self.passed: int = 0  # rows that the next level has, too
        self._most, self._used = most, 0
        self._rows: Rows = np.empty(most * 5 // 4, ROW)  # memory is used as rows come

    def add(self, rows: Rows) -> None:
        """Add rows. Rows that were returned before do not change."""
        self.end += len(rows)
        rows = rows[-self._most :]
        if self._used + len(rows) > len(self._rows):
            kept = self._rows[max(self._used + len(rows) - self._most, 0) : self._used]
            self._rows, self._used = np.empty_like(self._rows), len(kept)
            self._rows[: len(kept)] = kept
        self._rows[self._used : self._used + len(rows)] = rows
        self._used += len(rows)

    @property
    def begin(self) -> int:
        """Number of the oldest row in memory."""
        return self.end - self._used

    @property
    def rows(self) -> Rows:
        """All rows in memory; a view."""
        return self._rows[: self._used]

    def part(self, begin: int, most: int) -> Rows:
        """Return at most `most` rows from number `begin` on; a view."""
        first = begin - self.begin
        return self.rows[first : first + most]


class Levels:
    """The rows of a measurement. One thread adds, any reads.

    A measurement of any length thins rows in dense parts when they come. Of a recording (`whole`) a page has views alone.
    """

    def __init__(self, *, whole: bool = False) -> None:
        self._whole, self._lock = whole, Lock()
        self._levels = [Newest(WHOLE if whole else FINEST)]
        self._newest = Newest(NEWEST)
        self._span: tuple[float, float] | None = None

    def add(self, rows: Rows) -> None:
        """Add the next rows; their times do not go back."""
        if not len(rows):
            return
        with self._lock:
            first = self._span[0] if self._span else float(rows["t_s"][0])
            self._span = first, float(rows["t_s"][-1])
            self._newest.add(rows)
            self._pass_on(0, rows if self._whole else thinned(rows))

    def _pass_on(self, number: int, rows: Rows) -> None:
        """Add rows to a level, and extremes of its rows to the next one; begin a coarser one if it is time to."""
        if number == len(self._levels):
            self._levels.append(Newest(COARSER))
        level = self._levels[number]
        for begin in range(0, len(rows), _AT_ONCE):
            level.add(rows[begin : begin + _AT_ONCE])
            late = (level.end - level.passed) // _BLOCK * _BLOCK
            if late >= _AT_ONCE and (level.passed or level.end >= _SPLIT):
                blocks = level.part(level.passed, late)
                level.passed += late
                self._pass_on(number + 1, extremes(blocks, np.arange(0, late, _BLOCK)))

    @property
    def span(self) -> tuple[float, float] | None:
        """Times of the first and the last row, s; None: there is no row."""
        return self._span

    @property
    def has_all(self) -> bool:
        """Whether every row is still there."""
        return self._levels[0].begin == 0

    @property
    def end(self) -> int:
        """Number of rows so far that a page gets in frames; of a recording none."""
        return 0 if self._whole else self._levels[0].end

    @property
    def begin(self) -> int:
        """Number of the oldest row that a page still gets in frames."""
        return max(self.end - KEPT, 0)

    def following(self, begin: int, most: int) -> tuple[int, Rows]:
        """Return the rows for a page from a number on, at most so many, and how many are no longer there; a view."""
        with self._lock:
            missed = max(self.begin - begin, 0)
            return missed, self._levels[0].part(begin + missed, min(most, self.end - begin - missed))

    def newest_rows(self) -> Rows:
        """Return the newest rows as they came."""
        with self._lock:
            return self._newest.rows[-NEWEST:].copy()

    def view(self, from_s: float, to_s: float, most: int) -> Rows:
        """Return at most `most` rows between two times, as fine as possible, with the extremes of all rows.

        The row before, and the one after, are there, too, so that a line reaches both ends. `most`: 16 or more.
        """
        if self._span is None or from_s > to_s:
            return np.empty(0, ROW)
        low, high = self._span
        rows = self._between(min(max(from_s, low), high), max(min(to_s, high), low), most)
        if len(rows) <= most:
            return rows
        return extremes(rows, np.arange(most // 2) * len(rows) // (most // 2))

    def trace(self, number: int, start_s: float, end_s: float) -> dict[str, object]:
        """Return the course of a touch: at each time the ratio, its standard error and the statistic, in few points."""
        rows = self.view(start_s, end_s, ROWS)
        inside = (rows["t_s"] >= start_s - _SLACK_S) & (rows["t_s"] <= end_s + _SLACK_S)
        rows = rows[inside & (rows["flags"] & int(Flag.MEASURED) != 0)]
        if len(rows) > _POINTS:
            rows = extremes(rows, np.arange(_POINTS // 2) * len(rows) // (_POINTS // 2))
        values = {"ratio": rows["ratio"], "error": rows["standard_error"], "statistic": rows["statistic"]}
        columns = {"t": rows["t_s"] - start_s} | values
        return {"touch": number} | {name: _rounded(column) for name, column in columns.items()}

    def _between(self, from_s: float, to_s: float, most: int) -> Rows:
        """Return rows of the finest level that remembers them and is coarse enough; the newest are of finer levels."""
        late: list[Rows] = []
        with self._lock:
            for level in self._levels:
                part = _cut(level.rows, from_s, to_s)
                remembers = level.begin == 0 or level.rows["t_s"][0] <= from_s
                if (remembers and len(part) <= _ENOUGH * most) or level is self._levels[-1]:
                    break
                late.insert(0, level.part(level.passed, level.end))
        return _cut(np.concatenate((part, *late)), from_s, to_s) if late else part


def _cut(rows: Rows, from_s: float, to_s: float) -> Rows:
    """Return the rows between two times, with the one before and the one after; a view."""
    begin, end = bisect_left(rows["t_s"], from_s), bisect_right(rows["t_s"], to_s)
    return rows[max(begin - 1, 0) : end + 1]


def _rounded(values: NDArray[np.float64]) -> list[float]:
    return [float(f"{value:.7g}") for value in values.tolist()]
