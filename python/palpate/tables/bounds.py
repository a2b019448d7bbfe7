"""What is surely true of a column of any length: of its readings, and of the steps of its times; in bounded memory."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from palpate.tables.doubts import APART, FEWEST, MOVED, PILE, SAME, TAIL

Array = NDArray[np.float64]
_WIDEST = 1 << 18  # bins
_NEAR = 5  # values beside an end, as in `clipped`
_SAFE = 1e-6  # of 1: more than the roundings of a factor


class Doubtful(Exception):
    """Something is not sure: the table is to be read as a whole."""


def require(holds: bool) -> None:
    """Raise Doubtful if a condition does not hold."""
    if not holds:
        raise Doubtful


class Bins:
    """Counts and sums of numbers above zero by their leading bits.

    Parameters
    ----------
    bits : int
        After the binary point: a bin is as wide as 2**-bits of its numbers.
    """

    def __init__(self, bits: int) -> None:
        self._shift = 52 - bits
        self._found: dict[int, tuple[int, float]] = {}

    def add(self, values: Array) -> None:
        """Add numbers; raises Doubtful if they are not above zero, or of very different sizes."""
        if not len(values):
            return
        least, most = float(values.min()), float(values.max())
        require(0 < least <= most < np.inf)
        keys = values.view(np.int64) >> self._shift
        first = int(keys.min())
        require(int(keys.max()) - first < _WIDEST)
        keys -= first
        counts, sums = np.bincount(keys), np.bincount(keys, values)
        for key in np.flatnonzero(counts).tolist():
            count, total = self._found.get(first + key, (0, 0.0))
            self._found[first + key] = count + int(counts[key]), total + float(sums[key])
        require(len(self._found) < _WIDEST)

    def table(self) -> tuple[Array, Array, NDArray[np.int64], Array]:
        """Return the lower and the upper edges of the bins, upwards, with their counts and sums."""
        keys = np.array(sorted(self._found), np.int64)
        edges = [(keys + more << self._shift).view(np.float64) for more in (0, 1)]
        counts, sums = zip(*(self._found[key] for key in keys.tolist()), strict=True)
        return edges[0], edges[1], np.array(counts, np.int64), np.array(sums)


def _bins_at(counts: NDArray[np.int64], part: float) -> tuple[int, int]:
    """Return the bins of the two numbers next to a quantile."""
    at = part * (int(counts.sum()) - 1)
    first, last = np.searchsorted(np.cumsum(counts), [np.floor(at), np.ceil(at)], side="right")
    return int(first), int(last)


class Steps:
    """Times that rise from row to row, with bounds of their steps.

    Parameters
    ----------
    window : int
        Rows in a window of `typical_step`.

    Attributes
    ----------
    first, last : float
    """

    def __init__(self, window: int) -> None:
        self._window = window
        self.first = self.last = np.nan
        self._tail = np.empty(0)
        self._single, self._windows = Bins(8), Bins(8)

    def add(self, times: Array) -> None:
        """Add the times of the next rows; raises Doubtful if they do not rise."""
        self.first = float(times[0]) if np.isnan(self.first) else self.first
        joined = np.concatenate([self._tail, times])
        self._single.add(np.diff(joined[-len(times) - 1 :]))
        self._windows.add(joined[self._window :] - joined[: -self._window])
        self._tail, self.last = joined[-self._window :], float(times[-1])

    @property
    def least(self) -> float:
        """A bound of the smallest step."""
        return float(self._single.table()[0][0])

    def typical(self) -> tuple[float, float]:
        """Return bounds of `typical_step`."""
        low, high = self._median(self._windows)
        return low / self._window, high / self._window

    def median(self) -> tuple[float, float]:
        """Return bounds of `median_step`."""
        return self._median(self._single)

    def usual(self) -> float:
        """Return the mean of the steps that are not above ten times the median, as in `rate_of`; raises Doubtful."""
        low, high, counts, sums = self._single.table()
        least, most = self.median()
        few = high < 10 * least * 0.99
        require(bool((few | (low > 10 * most * 1.01)).all()))
        return float(sums[few].sum() / counts[few].sum())

    @staticmethod
    def _median(bins: Bins) -> tuple[float, float]:
        low, high, counts, _ = bins.table()
        first, last = _bins_at(counts, 0.5)
        return float(low[first]), float(high[last])


@dataclass
class Readings:
    """Readings of a channel that are above zero.

    Attributes
    ----------
    low, high : dict
        The smallest and the largest values, those farthest out first, with their counts; `high` with the sign changed.
    moved : float
        The largest change of the other channel while this one had the same reading for long, as in `frozen`.
    """

    low: dict[float, int] = field(default_factory=dict)
    high: dict[float, int] = field(default_factory=dict)
    _bins: Bins = field(default_factory=lambda: Bins(12))
    moved: float = 0.0
    _run: tuple[float, int, float, float] = (np.nan, 0, np.inf, -np.inf)
    """The latest reading, in how many rows so far, and the smallest and largest of the other channel in them."""

    def add(self, values: Array) -> None:
        """Add the readings of the next rows; raises Doubtful if one is not above zero."""
        self._bins.add(values)
        self.low, self.high = _smallest(self.low, values), _smallest(self.high, -values)

    def add_runs(self, values: Array, other: Array) -> None:
        """Add finite readings of the next rows, of this channel and the other one, for `moved`."""
        begins = np.concatenate([[0], np.flatnonzero(values[1:] != values[:-1]) + 1])
        rows = np.diff(begins, append=len(values))
        least, most = np.minimum.reduceat(other, begins), np.maximum.reduceat(other, begins)
        latest, count, low, high = self._run
        if values[0] == latest:
            rows[0] += count
            least[0], most[0] = min(least[0], low), max(most[0], high)
        self.moved = float(np.max((most - least)[rows >= FEWEST], initial=self.moved))
        self._run = float(values[-1]), int(rows[-1]), float(least[-1]), float(most[-1])

    @property
    def span(self) -> Array:
        """The smallest reading and the largest one."""
        return np.array([next(iter(self.low)), -next(iter(self.high))])

    def require_plain(self, other: Array) -> None:
        """Raise Doubtful unless `absent`, `clipped` and `frozen` surely say nothing; `other`: span of the other channel."""
        require(self.moved <= MOVED * (other[1] - other[0]))
        for end in (self.low, self.high):
            (at, count), *others = end.items()
            require(len(others) == _NEAR)
            require(count < FEWEST or count <= PILE * max(near for _, near in others))
            gap = others[0][0] - at
            require(count < SAME or gap * (1 + _SAFE) < APART * self._spread(abs(at), count))

    def _spread(self, end: float, count: int) -> float:
        """Return less than the spread in `absent` of all readings but these, which are at an end.

        Each reading is known to a bin, the clipping limits to two: the standard deviation differs by less than that.
        """
        low, high, counts, _ = self._bins.table()
        counts[0 if end < high[0] and low[0] <= end else -1] -= count
        middle, width = (low + high) / 2, float((high - low).max())
        limits = [_bins_at(counts, part) for part in (TAIL, 1 - TAIL)]
        inside = np.clip(middle, middle[limits[0][0]], middle[limits[1][0]])
        mean = np.average(inside, weights=counts)
        spread = float(np.sqrt(np.average((inside - mean) ** 2, weights=counts)))
        return spread - width - max(float(middle[last] - middle[first]) for first, last in limits)


def _smallest(known: dict[float, int], values: Array) -> dict[float, int]:
    """Return the smallest values with their counts, of those known and of more."""
    if len(known) > _NEAR:
        values = values[values <= max(known)]
    found, counts = np.unique(values, return_counts=True)
    known = dict(known)
    for value, count in zip(found[: _NEAR + 1].tolist(), counts.tolist(), strict=False):
        known[value] = known.get(value, 0) + count
    return dict(sorted(known.items())[: _NEAR + 1])
