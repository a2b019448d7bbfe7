"""The part of a touch since the last change of its ratio."""

import numpy as np
from numpy.typing import NDArray

from palpate.afterwards.fit import Aligned

Array = NDArray[np.float64]
_KNOWN = 4  # pairs of a part whose ratio can be compared
_AGREE = 5.0  # standard errors between two parts
_OUTLIER = 6.0
_MAD = 1.4826


def since_change(pairs: Aligned, alarms: NDArray[np.intp]) -> int | None:
    """Return the row with which the part since the last change begins; None: that part is too short to be known.

    An alarm is a change only if the ratios on both sides of it differ: noise of a burst alarms, too. From the last part
    back, parts are joined as long as they agree; one that is too short to be compared joins with the one before it.

    Parameters
    ----------
    pairs : Aligned
    alarms : numpy.ndarray of int, shape (n,)
        Rows with an alarm, at least one; a part begins after each.
    """
    high = pairs.high
    ratios, rows = pairs.y[high] / pairs.x[high], pairs.row[high]
    parts = np.split(ratios, np.searchsorted(rows, alarms + 1))
    starts = [int(pairs.hard.row[0]), *(int(alarm) + 1 for alarm in alarms)]
    known = [i for i, part in enumerate(parts) if len(part) >= _KNOWN]
    if not known:
        return None
    last = known.pop()
    joined = parts[last]
    tail = np.concatenate(parts[last + 1 :]) if last + 1 < len(parts) else joined[:0]
    if len(tail) and abs(np.median(tail) - np.median(joined)) > _OUTLIER * _spread(joined):
        return None
    begin = last
    while known and _agree(parts[known[-1]], joined):
        begin = known.pop()
        joined = np.concatenate([parts[begin], joined])
    return starts[begin]


def _spread(ratios: Array) -> float:
    return _MAD * float(np.median(np.abs(ratios - np.median(ratios))))


def _agree(one: Array, other: Array) -> bool:
    """Return whether two medians agree; their errors are 1.25 spread / sqrt(n), and 1.5 times for neighbours alike."""
    errors = [1.9 * _spread(ratios) / np.sqrt(len(ratios)) for ratios in (one, other)]
    return bool(abs(np.median(one) - np.median(other)) <= _AGREE * np.hypot(*errors))
