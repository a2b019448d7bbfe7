"""What in the values of a channel looks wrong."""

import numpy as np
from numpy.typing import NDArray

_FEWEST = 20  # readings at the end of a range that are no chance
_PILE = 5  # times as many as have the next values


def clipped(name: str, values: NDArray[np.float64]) -> list[str]:
    """Return a note if many readings have exactly the largest, or the smallest, value.

    Examples
    --------
    >>> clipped("hard", np.r_[np.linspace(0, 8, 400), np.full(30, 8.192)])
    ['hard: 30 readings have exactly the largest value, 8.192: is the channel clipped there?']
    >>> clipped("hard", np.linspace(0, 8, 400))
    []
    """
    found, counts = np.unique(values[np.isfinite(values)], return_counts=True)
    if len(found) < _FEWEST:
        return []
    notes = []
    for side, at, near in (("largest", -1, slice(-6, -1)), ("smallest", 0, slice(1, 6))):
        if counts[at] >= _FEWEST and counts[at] > _PILE * counts[near].max():
            notes.append(
                f"{name}: {counts[at]} readings have exactly the {side} value, {found[at]:.6g}: is the channel clipped there?"
            )
    return notes
