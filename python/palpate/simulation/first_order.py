"""First-order recursions over whole arrays."""

import math

import numpy as np
from numpy.typing import NDArray

_NEGLIGIBLE = 1e-18


def recursion(start: NDArray[np.float64], pole: float) -> NDArray[np.float64]:
    """Return y with y(n) = pole y(n - 1) + start(n), y(0) = start(0).

    The recursion is 1 / (1 - a L) with the lag operator L, and
    1 / (1 - a L) = (1 + a L) (1 + a^2 L^2) (1 + a^4 L^4) ...: log2(n) passes over the array.

    Parameters
    ----------
    start : numpy.ndarray, shape (n,)
    pole : float, in [0, 1]

    Returns
    -------
    numpy.ndarray, shape (n,)

    Examples
    --------
    >>> recursion(np.array([1.0, 0.0, 0.0, 2.0]), 0.5)
    array([1.   , 0.5  , 0.25 , 2.125])
    """
    y, shift = start.copy(), 1
    while shift < len(y) and pole > _NEGLIGIBLE:
        y[shift:] += pole * y[:-shift]
        pole, shift = pole * pole, 2 * shift
    return y


def follow(x: NDArray[np.float64], step_s: float, constant_s: float) -> NDArray[np.float64]:
    """Return y with constant_s y' = x - y, y(0) = x(0), for an x that is linear between its points.

    Over a step h, with a = exp(-h / tau) and g = (1 - a) tau / h:
    y(n) = a y(n - 1) + (1 - g) x(n) + (g - a) x(n - 1), which is exact.

    Parameters
    ----------
    x : numpy.ndarray, shape (n,)
        Values on an even grid.
    step_s : float
        Step of the grid, s.
    constant_s : float, above 0
        Time constant, s.

    Returns
    -------
    numpy.ndarray, shape (n,)
    """
    pole = math.exp(-step_s / constant_s)
    mean = -math.expm1(-step_s / constant_s) * constant_s / step_s
    start = (1 - mean) * x
    start[1:] += (mean - pole) * x[:-1]
    start[:1] = x[:1]
    return recursion(start, pole)
