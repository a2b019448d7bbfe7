"""Pairs of filtered readings: matched windows around each hard reading, for their real times."""

from dataclasses import dataclass

import numpy as np

from palpate.touch_readings.channel_readings import Array, Mask, Readings, Rows

HARD = 5
SOFT = 6
"""Readings of each channel in a window."""
FEWEST = 8
"""Pairs for a result."""
_SIZE = HARD + SOFT
_SIGN = np.where(np.arange(_SIZE) < HARD, 1.0, -1.0)
# The band of the sway and tremor of a hand. As for the live filters: weight 1 from 3 Hz on, 0.3
# below.
_LOWEST_HZ = 0.2
_LINES_HZ = 3.0
_HIGHEST_HZ = 13.0
_SLOW = 0.3
_NOISE = 1e-6  # weight of the power gain of white noise, against a mean square mismatch
_AT_ONCE = 4096  # windows solved together: some 10 MB
_REACH = 8  # soft readings of the instrument on either side
_MISMATCH = 3e-3  # of a window that is kept, if most are better


@dataclass(frozen=True)
class Windows:
    """Windows of the readings of one channel, with their filters.

    Attributes
    ----------
    readings : Readings
    at : numpy.ndarray of int, shape (n, size)
        Positions of the readings in each window.
    weight : numpy.ndarray, shape (n, size)
        Their weights; each row has the sum 1.
    """

    readings: Readings
    at: Rows
    weight: Array

    @property
    def value(self) -> Array:
        """The filtered value in each window."""
        return np.asarray((self.weight * self.readings.value[self.at]).sum(axis=1))

    def spread(self, values: Array) -> Array:
        """Return for each reading the sum of its weight times the value of its windows."""
        weighted = self.weight * values[:, None]
        count = len(self.readings.t)
        return np.asarray(np.bincount(self.at.ravel(), weighted.ravel(), count), float)


def windows(
    all_hard: Readings, all_soft: Readings, chosen: Mask | None = None
) -> tuple[Windows, Windows, Array]:
    """Return a window around each hard reading that has enough neighbours, and its mismatch.

    The mismatch is |A - B|, rms over the band. `chosen`: which hard readings get a window.
    """
    # With A = sum a_i exp(j w t_i) of the hard readings at t_i, and B of the soft ones likewise,
    # the weights are the minimum of the mean of |A - B|^2 over the band, plus
    # 1e-6 (sum a_i^2 + sum b_i^2), with sum a_i = sum b_i = 1. The mean of cos w (t_i - t_j) over
    # the band has a closed form; so no even grid is needed.
    t_hard_s = all_hard.t
    t_soft_s = all_soft.t
    before = HARD // 2
    half = SOFT // 2
    centre = np.arange(before, len(t_hard_s) - before)
    if chosen is not None:
        centre = centre[chosen[centre]]
    after = np.searchsorted(t_soft_s, t_hard_s[centre])
    whole = (after >= half) & (after <= len(t_soft_s) - half)
    hard_at = centre[whole, None] + np.arange(-before, before + 1)
    soft_at = after[whole, None] + np.arange(-half, half)
    times = np.concatenate([t_hard_s[hard_at], t_soft_s[soft_at]], axis=1)
    weights = np.empty(times.shape)
    mismatch = np.empty(len(times))
    for first in range(0, len(times), _AT_ONCE):
        part = slice(first, first + _AT_ONCE)
        weights[part], mismatch[part] = _designed(times[part])
    hard = Windows(all_hard, hard_at, weights[:, :HARD])
    soft = Windows(all_soft, soft_at, weights[:, HARD:])
    return hard, soft, mismatch


def _designed(times: Array) -> tuple[Array, Array]:
    """Return weights, shape (n, 11), and mismatch, shape (n,)."""
    number = len(times)
    row, column = np.triu_indices(_SIZE)  # the mean cosine is symmetric
    means = _mean_cosine(times[:, row] - times[:, column])
    cosines = np.empty((number, _SIZE, _SIZE))
    cosines[:, row, column] = means
    cosines[:, column, row] = means
    square = _SIGN[:, None] * _SIGN * cosines
    # Lagrange multipliers: the hard weights sum to 1, and so do the soft ones.
    size = _SIZE + 2
    system = np.zeros((number, size, size))
    system[:, :_SIZE, :_SIZE] = square + _NOISE * np.eye(_SIZE)
    system[:, :HARD, _SIZE] = 1
    system[:, _SIZE, :HARD] = 1
    system[:, HARD:_SIZE, _SIZE + 1] = 1
    system[:, _SIZE + 1, HARD:_SIZE] = 1
    wanted = np.zeros((number, size, 1))
    wanted[:, _SIZE:] = 1
    solution = np.linalg.solve(system, wanted)
    weights = np.asarray(solution[:, :_SIZE, 0], float)
    left: Array = np.einsum("ni,nij,nj->n", weights, square, weights)
    mismatch: Array = np.sqrt(np.maximum(left, 0))
    return weights, mismatch


def _mean_cosine(lag_s: Array) -> Array:
    """Return the weighted mean of cos(2 pi f lag) over the band."""

    def integral(f: float) -> Array:
        """Return the integral of the cosine from 0 to f."""
        return f * np.sinc(2 * f * lag_s)

    to_lines = integral(_LINES_HZ)
    slow = to_lines - integral(_LOWEST_HZ)
    lines = integral(_HIGHEST_HZ) - to_lines
    weight = _SLOW * (_LINES_HZ - _LOWEST_HZ) + _HIGHEST_HZ - _LINES_HZ
    return (_SLOW * slow + lines) / weight


@dataclass(frozen=True)
class Aligned:
    """Changes of both channels from the baseline, pF, filtered in windows.

    Attributes
    ----------
    hard, soft : Windows
    row : numpy.ndarray of int, shape (n,)
        Row of the hard reading in the middle of each window.
    t : numpy.ndarray, shape (n,)
        Its time, s.
    y, x : numpy.ndarray, shape (n,)
        Filtered hard and soft change, pF.
    z : numpy.ndarray, shape (n,)
        The instrumental variable: mean of the soft readings around each reading in x, without it.
    good : numpy.ndarray of bool, shape (n,)
        Windows without a gap.
    """

    hard: Windows
    soft: Windows
    row: Rows
    t: Array
    y: Array
    x: Array
    z: Array
    good: Mask

    @property
    def high(self) -> Mask:
        """Which good windows are above half of the touch."""
        size = np.abs(self.x)
        height: float = size[self.good].max(initial=0)
        return self.good & (size > height / 2)

    def rest(self, ratio: float) -> Array:
        """Return y - ratio * x."""
        return self.y - ratio * self.x


def aligned(hard: Readings, soft: Readings, chosen: Mask | None = None) -> Aligned | None:
    """Return the windows of changes, as `windows`; None: there are too few."""
    in_hard, in_soft, mismatch = windows(hard, soft, chosen)
    if len(mismatch) < FEWEST:
        return None
    limit = max(_MISMATCH, 3 * float(np.median(mismatch)))
    middle = in_hard.at[:, HARD // 2]
    return Aligned(
        in_hard,
        in_soft,
        row=hard.row[middle],
        t=hard.t[middle],
        y=in_hard.value,
        x=in_soft.value,
        z=_instrument(in_soft),
        good=mismatch <= limit,
    )


def _instrument(soft: Windows) -> Array:
    sums: Array = np.append(0, np.cumsum(soft.readings.value))
    first = soft.at[:, 0]
    end = soft.at[:, -1] + 1
    low = np.maximum(first - _REACH, 0)
    high = np.minimum(end + _REACH, len(sums) - 1)
    count = np.maximum(high - low - SOFT, 1)
    around = sums[high] - sums[low]
    own = sums[end] - sums[first]
    mean: Array = (around - own) / count
    return mean
