"""Filters that align the channels afterwards: one matched pair for each window of readings, at their real times."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.pair_filter import BAND_Hz

Array = NDArray[np.float64]
HARD, SOFT = 5, 6
"""Readings of each channel in a window."""
_LINES_Hz, _SLOW = 3.0, 0.3  # as for the live filters: weight 1 from 3 Hz on, 0.3 below
_NOISE = 1e-6  # weight of the power gain of white noise, against a mean square mismatch
_AT_ONCE = 4096  # windows solved together: some 10 MB


@dataclass(frozen=True)
class Windows:
    """Windows of readings and their filters: y = sum of hard_weight * hard[hard_at], x likewise.

    Attributes
    ----------
    hard_at, soft_at : numpy.ndarray of int, shape (n, 5) and (n, 6)
        Which readings.
    hard_weight, soft_weight : numpy.ndarray, the same shapes
        The sum of each row is 1.
    mismatch : numpy.ndarray, shape (n,)
        |A - B| of the responses, rms over the band: the part of a tremor that is left.
    """

    hard_at: NDArray[np.intp]
    soft_at: NDArray[np.intp]
    hard_weight: Array
    soft_weight: Array
    mismatch: Array


def windows(t_hard_s: Array, t_soft_s: Array) -> Windows:
    """Return a window around each hard reading that has enough neighbours.

    With A = sum a_i exp(j w t_i) of the hard readings at t_i, and B of the soft ones likewise, the weights are the
    minimum of the mean of |A - B|^2 over the band, plus 1e-6 (sum a_i^2 + sum b_i^2), with sum a_i = sum b_i = 1. The
    mean of cos w (t_i - t_j) over the band has a closed form; so no even grid is needed.

    Parameters
    ----------
    t_hard_s, t_soft_s : numpy.ndarray, shape (n,) and (m,)
        Increasing times of the readings, s.

    Returns
    -------
    Windows

    Examples
    --------
    >>> t = 0.026 * np.arange(8)
    >>> found = windows(t, t + 0.013)
    >>> found.hard_at.tolist(), bool((found.mismatch < 1e-3).all())
    ([[1, 2, 3, 4, 5], [2, 3, 4, 5, 6], [3, 4, 5, 6, 7]], True)
    """
    before, half = HARD // 2, SOFT // 2
    centre = np.arange(before, len(t_hard_s) - before)
    after = np.searchsorted(t_soft_s, t_hard_s[centre])
    whole = (after >= half) & (after <= len(t_soft_s) - half)
    hard_at = centre[whole, None] + np.arange(-before, before + 1)
    soft_at = after[whole, None] + np.arange(-half, half)
    times = np.concatenate([t_hard_s[hard_at], t_soft_s[soft_at]], axis=1)
    parts = [_designed(times[i : i + _AT_ONCE]) for i in range(0, len(times), _AT_ONCE)] or [_designed(times)]
    weights, mismatch = (np.concatenate(part) for part in zip(*parts, strict=True))
    return Windows(hard_at, soft_at, weights[:, :HARD], weights[:, HARD:], mismatch)


def _designed(times: Array) -> tuple[Array, Array]:
    """Return weights, shape (n, 11), and mismatch, shape (n,)."""
    number, size = len(times), HARD + SOFT
    sign = np.where(np.arange(size) < HARD, 1.0, -1.0)
    square = sign[:, None] * sign * _mean_cosine(times[:, :, None] - times[:, None, :])
    system = np.zeros((number, size + 2, size + 2))
    system[:, :size, :size] = square + _NOISE * np.eye(size)
    system[:, :HARD, size] = system[:, size, :HARD] = 1
    system[:, HARD:size, size + 1] = system[:, size + 1, HARD:size] = 1
    wanted = np.zeros((number, size + 2, 1))
    wanted[:, size:] = 1
    weights: Array = np.asarray(np.linalg.solve(system, wanted)[:, :size, 0], np.float64)
    left = np.einsum("ni,nij,nj->n", weights, square, weights)
    return weights, np.asarray(np.sqrt(np.maximum(left, 0)))


def _mean_cosine(lag_s: Array) -> Array:
    """Return the weighted mean of cos(2 pi f lag) over the band: the integral of cos is f sinc(2 f lag)."""
    low, high = BAND_Hz

    def to(f: float) -> Array:
        return np.asarray(f * np.sinc(2 * f * lag_s))

    slow, lines = to(_LINES_Hz) - to(low), to(high) - to(_LINES_Hz)
    return (_SLOW * slow + lines) / (_SLOW * (_LINES_Hz - low) + high - _LINES_Hz)
