"""Pairs of readings of two channels that have their own times."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Pairs(NamedTuple):
    """Pairs: times of both, s, both values, shape (n,); and how many readings have no partner."""

    t_hard: Array
    t_soft: Array
    hard: Array
    soft: Array
    left_out: int


def joined(t_hard: Array, hard: Array, t_soft: Array, soft: Array) -> Pairs:
    """Return pairs of readings that are near each other in time."""
    raise NotImplementedError
