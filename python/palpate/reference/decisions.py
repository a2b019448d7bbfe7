"""Comparisons of a reference, and how near the closest one was to its limit."""

import math
from typing import Any


class Decisions:
    """The comparisons of one sample.

    A calculation that rounds may decide the other way where the margin is about as small as its rounding errors.
    """

    def __init__(self) -> None:
        self.margin = math.inf

    def above(self, value: Any, limit: Any, scale: Any = None) -> bool:
        """Return whether a value is above a limit, and note their distance in units of the scale.

        Parameters
        ----------
        value, limit : number
        scale : number, optional
            By default the sum of both magnitudes.

        Returns
        -------
        bool
        """
        if math.isinf(limit):
            return bool(value > limit)
        size = abs(value) + abs(limit) if scale is None else scale
        # Two numbers that are exactly 0 are 0 in every arithmetic.
        if size > 0:
            self.margin = min(self.margin, float(abs(value - limit) / size))
        return bool(value > limit)
