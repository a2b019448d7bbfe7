"""Times that a host gave to the readings."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_REACH = 16  # rows on either side
_PAUSE = 8.0  # periods


def smooth(t: Array) -> Array:
    """Return times, shape (n,), n at least 2, each replaced by the mean of those of up to 16 rows before it and as many after it.

    For readings at an even rate that is the middle of a straight line through them. A pause is not smoothed.

    Examples
    --------
    >>> smooth(np.array([0.0, 1.1, 2.0, 3.0])).round(3).tolist()
    [0.0, 1.033, 2.033, 3.0]
    """
    out = np.empty_like(t)
    steps = np.abs(np.diff(t))
    pauses = np.flatnonzero(steps > _PAUSE * np.median(steps)) + 1
    for rows in np.split(np.arange(len(t)), pauses):
        part = t[rows] - t[rows[0]]
        sums, place = np.append(0, np.cumsum(part)), np.arange(len(rows))
        reach = np.minimum(_REACH, np.minimum(place, place[::-1]))
        out[rows] = t[rows[0]] + (sums[place + reach + 1] - sums[place - reach]) / (2 * reach + 1)
    return out
