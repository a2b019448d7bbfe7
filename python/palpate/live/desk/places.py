"""Where in a touch its flags arise."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.samples import Block, refused, saturated
from palpate.stream.estimate import Batch

_FIRST: dict[str, Callable[[Block], NDArray[Any]]] = {"saturated": saturated, "refused": refused}
"""Flags that arise at their first sample; all others are known at the end of the touch."""
_MOST = 200  # the newest touches


class Places:
    """Follows the touches of a measurement.

    Examples
    --------
    >>> import palpate
    >>> places = Places()
    >>> with palpate.Stream("sim:stiff-steady?seed=1") as stream:
    ...     for batch in stream.batches():
    ...         places.follow(batch)
    >>> round(places.of(1, "short", 0.0))  # s, its end
    9
    """

    def __init__(self) -> None:
        self._ends: dict[int, float] = {}
        self._firsts: dict[tuple[int, str], float] = {}

    def follow(self, batch: Batch) -> None:
        """Look at the next samples."""
        numbers, t_s = batch.rows["touch"], batch.samples["t_hard_ns"] / 1e9
        for number in np.unique(numbers[numbers > 0]).tolist():
            own = numbers == number
            self._ends[number] = float(t_s[own][-1])
            for flag, arises in _FIRST.items():
                if len(found := t_s[own & arises(batch.samples)]):
                    self._firsts.setdefault((number, flag), float(found[0]))
            self._forget(number - _MOST)

    def of(self, number: int, flag: str, otherwise_s: float) -> float:
        """Return the time of a flag of a touch, s; another one if it is not known."""
        return self._firsts.get((number, flag), self._ends.get(number, otherwise_s))

    def _forget(self, number: int) -> None:
        self._ends.pop(number, None)
        for flag in _FIRST:
            self._firsts.pop((number, flag), None)
