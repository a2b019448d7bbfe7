"""The change of a channel since its begin: what an estimate depends on, and what a drawing shows."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate import digits

_FIRST = 20
"""Readings at the begin, whose median is the level there."""


class Change(NamedTuple):
    """A channel without its level at the begin.

    Attributes
    ----------
    values : numpy.ndarray, shape (n,)
        Changes, pF; nan for a missing reading.
    level : str
        Level at the begin, as text.
    told : str
        The same, with the largest changes.
    """

    values: NDArray[np.float64]
    level: str
    told: str


def changes(readings: NDArray[np.float64]) -> Change:
    """Return the change of a channel since the median of its first readings.

    Examples
    --------
    >>> changes(np.array([0.62, 0.62, 0.62, 0.75])).told
    '0.620 pF at the begin, change 0 to 0.13 pF'
    """
    known = readings[np.isfinite(readings)]
    if not len(known):
        return Change(readings, "no readings", "no readings")
    begin = float(np.median(known[:_FIRST]))
    low, high = float(known.min()) - begin, float(known.max()) - begin
    digit = (high - low) / 10
    level = f"{digits.number(begin)} pF"
    told = f"{level} at the begin, change {digits.number(low, digit)} to {digits.number(high, digit)} pF"
    return Change(readings - begin, level, told)
