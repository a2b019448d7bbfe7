"""Steps from row to row of times: their typical size, coarse stamps, counters that begin again, times that go back."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_WINDOW = 256  # rows; longer than the bursts of a USB or serial port, shorter than a file
_FEWEST = 8  # rows of which anything can be said
_LEAST = 1e-30  # of any unit; smaller steps are none
_NEAR = 1e-3  # of a coarse unit, by rounding
_PAUSE_ROWS = 100  # where a counter begins again, no more rows than these are lost


def typical_step(times: Floats) -> float:
    """Return the distance of the rows, robust to bursts, gaps and equal stamps; 0 if no time is later than another.

    It is the median over windows of rows, not over rows: where ten rows come at once, most steps are about 0.

    Examples
    --------
    >>> typical_step(np.array([0, 1, 10, 11, 20, 21, 30, 31, 40, 41.0]))
    5.0
    """
    window = window_of(len(times))
    return _median_above(times[window:] - times[:-window]) / window


def window_of(rows: int) -> int:
    """Return the rows in a window of `typical_step`."""
    return max(2, min(_WINDOW, (rows - 1) // 4)) if rows > 2 else 1


def median_step(times: Floats) -> float:
    """Return the median of the steps above 0; 0 if there is none."""
    return _median_above(np.diff(times))


def _median_above(steps: Floats) -> float:
    later = steps > _LEAST
    above = steps if later.all() else steps[later]
    return float(np.median(above, overwrite_input=True)) if len(above) else 0.0


@dataclass(frozen=True)
class Coarse:
    """Stamps that many rows share.

    Attributes
    ----------
    unit : float
        All steps are multiples of it.
    rows : float or None
        Rows in a unit, counted; None: too few stamps.
    """

    unit: float
    rows: float | None


def coarse(times: Floats) -> Coarse | None:
    """Return the unit of stamps that are so coarse that many rows share one; None if they are not.

    Examples
    --------
    >>> coarse(np.arange(100) // 10 * 1.0)
    Coarse(unit=1.0, rows=10.0)
    """
    steps = np.diff(times)
    is_later = steps > _LEAST
    if len(times) < _FEWEST or 2 * np.count_nonzero(is_later) >= len(steps):
        return None
    later = steps[is_later]
    if not len(later):
        return Coarse(0.0, None)
    unit = float(later.min())
    multiples = later / unit
    if (np.abs(multiples - np.rint(multiples)) > _NEAR * multiples).any() or unit < 2 * typical_step(times):
        return None
    runs = np.diff(np.flatnonzero(steps > _LEAST))  # rows of a stamp, without the first and the last one
    return Coarse(unit, float(runs.mean()) if len(runs) else None)


def counted(times: Floats) -> float | None:
    """Return the rows in a unit of time, robust to bursts, gaps and coarse stamps; None: there are too few stamps.

    Examples
    --------
    >>> counted(np.arange(100) // 10 * 1.0), counted(np.arange(100) * 0.02)
    (10.0, 50.0)
    """
    shared = coarse(times)
    if shared:
        return shared.rows / shared.unit if shared.rows else None
    step = typical_step(times) if len(times) >= _FEWEST else 0.0
    return 1 / step if step else None


def continued(times: Floats, turns: Mapping[float, float]) -> tuple[Floats, float, list[int]]:
    """Return the times of a counter that begins again after a turn as if it did not.

    Parameters
    ----------
    times : numpy.ndarray, shape (n,)
    turns : mapping
        Where such a counter may begin again (2**32 of micros(), 86400 s of a time of day), and how long a pause may be
        that contains it; at least a hundred rows.

    Returns
    -------
    times, turn, rows
        The turn that explains all large steps back, with the rows after them; 0 and no rows if none does.

    Examples
    --------
    >>> times, turn, rows = continued(np.array([86398.0, 86399, 0, 1]), {86400: 0})
    >>> times.tolist(), turn, rows
    ([86398.0, 86399.0, 86400.0, 86401.0], 86400, [2])
    """
    steps = np.diff(times)
    large = [turn for turn in turns if len(steps) and steps.min() < -turn / 2]
    pause = max(typical_step(times), median_step(times)) * _PAUSE_ROWS if large else 0.0
    for turn in large:
        back, longest = np.flatnonzero(steps < -turn / 2), turns[turn]
        over = steps[back] + turn
        if np.ptp(times) < turn and (over <= max(pause, longest)).all():
            begun = np.zeros(len(times))
            begun[back + 1] = turn
            return times + np.cumsum(begun), turn, (back + 1).tolist()
    return times, 0.0, []
