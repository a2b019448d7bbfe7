"""Readings of one channel, and the arrays of this room."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Rows = NDArray[np.intp]
_REACH = 16  # rows on either side
_PAUSE = 8.0  # periods


def median_size(values: Array) -> float:
    """Return the median of the absolute values."""
    return float(np.median(np.abs(values)))


@dataclass(frozen=True)
class Readings:
    """Readings of one channel that have a value: times, s, values, pF, and rows, shape (n,)."""

    t: Array
    value: Array
    row: Rows

    @property
    def first_s(self) -> float:
        """Time of the first reading, s; inf: there is none."""
        return float(self.t[0]) if len(self.t) else math.inf

    def rows(self, first: int, end: int) -> "Readings":
        """Return the readings of rows first to end - 1."""
        return self[slice(*np.searchsorted(self.row, [first, end]))]

    def __getitem__(self, which: Any) -> "Readings":
        """Return some of the readings, by a mask or a slice."""
        return Readings(self.t[which], self.value[which], self.row[which])


def readings_of(t: Array, value: Array, full_scale: float) -> Readings:
    """Return the readings within the range whose times are later than all times before."""
    row = np.flatnonzero(np.abs(value) < full_scale)  # nan is not
    times = t[row]
    latest = np.maximum.accumulate(np.append(-math.inf, times))
    row = row[times > latest[:-1]]
    return Readings(t[row], value[row], row)


def smooth(t: Array) -> Array:
    """Return times, shape (n,), n at least 2, each replaced by a mean.

    The mean is over up to 16 rows on either side.
    """
    # For readings at an even rate that is the middle of a straight line through them. A pause is
    # not smoothed.
    out = np.empty_like(t)
    steps = np.abs(np.diff(t))
    pauses = np.flatnonzero(steps > _PAUSE * np.median(steps)) + 1
    for rows in np.split(np.arange(len(t)), pauses):
        first = t[rows[0]]
        sums = np.append(0, np.cumsum(t[rows] - first))
        place = np.arange(len(rows))
        to_edge = np.minimum(place, place[::-1])
        reach = np.minimum(_REACH, to_edge)
        around = sums[place + reach + 1] - sums[place - reach]
        out[rows] = first + around / (2 * reach + 1)
    return out
