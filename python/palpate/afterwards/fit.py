"""The ratio of a touch from its readings: instrumental variables, spikes left out, a lag of a channel removed."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.afterwards.levels import Level, Readings
from palpate.afterwards.windows import HARD, SOFT, Windows, windows

Array = NDArray[np.float64]
FEWEST = 8
"""Pairs for a result."""
_ROUNDS = 11  # of leaving out readings, and of removing a lag
_OUTLIER = 6.0
_MAD = 1.4826  # standard deviation / median of the absolute values
_REACH = 8  # soft readings of the instrument on either side
_MISMATCH = 3e-3  # of a window that is kept, if most are better
_PROVEN = 8.0  # standard errors of a lag that is removed
_BATCHES = 16
_FLANK = 3  # windows
_LEAST = 0.001  # change from the flanks to the height, share


@dataclass(frozen=True)
class Aligned:
    """Changes of both channels, pF, and what the windows make of them.

    Attributes
    ----------
    hard, soft : Readings
    windows : Windows
    row : numpy.ndarray of int, shape (n,)
        Row of the hard reading in the middle.
    y, x, z : numpy.ndarray, shape (n,)
        Hard, soft, and the instrument: the mean of the soft readings around those of x, without them.
    good : numpy.ndarray of bool, shape (n,)
        Windows without a gap.
    """

    hard: Readings
    soft: Readings
    windows: Windows
    row: NDArray[np.intp]
    y: Array
    x: Array
    z: Array
    good: NDArray[np.bool_]

    @property
    def high(self) -> NDArray[np.bool_]:
        """Which good windows are above half of the touch."""
        return np.asarray(self.good & (np.abs(self.x) > np.abs(self.x[self.good]).max(initial=0) / 2))

    def rest(self, ratio: float) -> Array:
        """Return y - ratio * x."""
        return self.y - ratio * self.x


@dataclass(frozen=True)
class Found:
    """The result: ratio, its standard error, unscaled covariance, number of windows, readings left out, lag removed."""

    ratio: float
    standard_error: float
    covariance: float
    samples: int
    left_out: int
    lag_s: float
    first_s: float
    last_s: float


def aligned(hard: Readings, soft: Readings) -> Aligned | None:
    """Return the windows of changes; None: there are too few."""
    made = windows(hard.t, soft.t)
    if len(made.mismatch) < FEWEST:
        return None
    y = (made.hard_weight * hard.value[made.hard_at]).sum(axis=1)
    x = (made.soft_weight * soft.value[made.soft_at]).sum(axis=1)
    good = made.mismatch <= max(_MISMATCH, 3 * float(np.median(made.mismatch)))
    row = hard.row[made.hard_at[:, HARD // 2]]
    return Aligned(hard, soft, made, row, y, x, _instrument(soft.value, made), good)


def _instrument(soft: Array, made: Windows) -> Array:
    sums = np.append(0, np.cumsum(soft))
    first, end = made.soft_at[:, 0], made.soft_at[:, -1] + 1
    low, high = np.maximum(first - _REACH, 0), np.minimum(end + _REACH, len(soft))
    count = np.maximum(high - low - SOFT, 1)
    return np.asarray((sums[high] - sums[low] - (sums[end] - sums[first])) / count)


def fitted(hard: Readings, soft: Readings, levels: tuple[Level, Level]) -> Found | None:
    """Return the ratio of changes of both channels; None: there are too few.

    r = sum z y / sum z x. In rounds: a lag of the soft channel, y = r (x + lag x'), is removed from its times where it
    is significant; then of the windows that are 6 standard deviations off, in each run of them, the reading that
    explains most is left out.
    """
    lag, left_out, whole = 0.0, 0, None
    for last in [False] * _ROUNDS + [True]:
        pairs = aligned(hard, soft)
        if pairs is None or not pairs.high.any():
            break
        ratio = float(np.median(pairs.y[pairs.high] / pairs.x[pairs.high]))
        more = _lag(pairs, ratio)
        bad = np.abs(pairs.rest(ratio)) > _OUTLIER * _scale(pairs, ratio, levels)
        if last or (more == 0 and not bad.any()):
            return _solved(pairs, pairs.good & ~bad, whole or pairs, levels, left_out, lag)
        if more:
            soft, lag = replace(soft, t=soft.t - more), lag + more
            continue
        whole = whole or pairs
        keep_hard, keep_soft = _without_spikes(pairs, ratio, np.flatnonzero(bad))
        left_out += int(np.count_nonzero(~keep_hard) + np.count_nonzero(~keep_soft))
        hard, soft = hard[keep_hard], soft[keep_soft]
    return None


def _lag(pairs: Aligned, ratio: float) -> float:
    """Return how late the soft channel is, s; 0 if that is not significant."""
    rest = pairs.rest(ratio)
    near = pairs.good & (np.abs(rest) <= _OUTLIER * _MAD * float(np.median(np.abs(rest[pairs.good]))))
    if np.count_nonzero(near) < FEWEST:
        return 0.0
    slope = np.gradient(pairs.x, pairs.hard.t[pairs.windows.hard_at[:, HARD // 2]])[near]
    squares = float(slope @ slope)
    if squares == 0 or ratio == 0:
        return 0.0
    late = float(slope @ rest[near]) / squares
    error = float(np.linalg.norm(slope * (rest[near] - late * slope))) / squares
    return late / ratio if abs(late) > _PROVEN * error else 0.0


def _noise2(pairs: Aligned, ratio: float, levels: tuple[Level, Level]) -> Array:
    """Return the variance of the windows by the noise of the readings."""
    hard, soft = ((weight**2).sum(axis=1) for weight in (pairs.windows.hard_weight, pairs.windows.soft_weight))
    return np.asarray(levels[0].noise ** 2 * hard + (ratio * levels[1].noise) ** 2 * soft)


def _scale(pairs: Aligned, ratio: float, levels: tuple[Level, Level]) -> float:
    seen = _MAD * float(np.median(np.abs(pairs.rest(ratio)[pairs.good])))
    return max(seen, math.sqrt(float(np.median(_noise2(pairs, ratio, levels)))))


def _without_spikes(pairs: Aligned, ratio: float, bad: NDArray[np.intp]) -> tuple[Any, Any]:
    """Return masks of the readings to keep: without the one that explains most of each run of bad windows."""
    rest, made = pairs.rest(ratio), pairs.windows
    keep = [np.ones(len(channel.t), bool) for channel in (pairs.hard, pairs.soft)]
    places = (made.hard_at, made.soft_at)
    explained = [
        _explained(at, weight, rest, len(kept))
        for at, weight, kept in zip(places, (made.hard_weight, made.soft_weight), keep, strict=True)
    ]
    for run in np.split(bad, np.flatnonzero(np.diff(bad) > 1) + 1):
        best = [of[at[run]].max() for of, at in zip(explained, places, strict=True)]
        worst = int(best[1] > best[0])
        inside = np.unique(places[worst][run])
        keep[worst][inside[np.argmax(explained[worst][inside])]] = False
    return keep[0], keep[1]


def _explained(at: NDArray[np.intp], weight: Array, rest: Array, size: int) -> Array:
    """Return the part of the sum of squares that an error of each reading explains."""
    top = np.bincount(at.ravel(), (weight * rest[:, None]).ravel(), size)
    squares = np.bincount(at.ravel(), (weight**2).ravel(), size)
    return np.asarray(top**2 / np.where(squares > 0, squares, 1))


def _solved(
    pairs: Aligned,
    used: NDArray[np.bool_],
    whole: Aligned,
    levels: tuple[Level, Level],
    left_out: int,
    lag: float,
) -> Found | None:
    """Return the result from some windows; `whole`: the pairs before readings were left out."""
    if np.count_nonzero(used) < FEWEST:
        return None
    z = np.where(used, pairs.z, 0)
    size = float(z @ pairs.x)
    ratio = float(z @ pairs.y) / size
    # ratio = truth + sum of each reading's error times its weight: exact, since the windows are linear.
    made = pairs.windows
    hard = np.bincount(made.hard_at.ravel(), (z[:, None] * made.hard_weight).ravel(), len(pairs.hard.t)) / size
    soft = -np.bincount(made.soft_at.ravel(), (z[:, None] * made.soft_weight).ravel(), len(pairs.soft.t)) * ratio / size
    of_readings = levels[0].noise ** 2 * float(hard @ hard) + levels[1].noise ** 2 * float(soft @ soft)
    scores = (z * pairs.rest(ratio))[used] / size
    number = max(min(_BATCHES, len(scores) // 4), 2)
    parts = np.array([part.sum() for part in np.array_split(scores, number)])
    seen = float(parts @ parts) * number / (number - 1)
    of_levels = _of_levels(((hard, pairs.hard.t, levels[0]), (soft, pairs.soft.t, levels[1])))
    times = pairs.hard.t[made.hard_at[used]]
    return Found(
        ratio=ratio,
        standard_error=math.sqrt(max(of_readings, seen) + of_levels + _open(whole, ratio, levels) ** 2),
        covariance=1 / size,
        samples=len(scores),
        left_out=left_out,
        lag_s=lag,
        first_s=float(times.min()),
        last_s=float(times.max()),
    )


def _open(pairs: Aligned, ratio: float, levels: tuple[Level, Level]) -> float:
    """Return twice the change of the ratio from the flanks of the touch to its height, if it is significant; else 0.

    An offset or a curve makes one. At half of the height, that of an offset is the error of the result; that of a
    curve half of it.
    """
    height = np.abs(pairs.x) / float(np.median(np.abs(pairs.x[pairs.high])))
    flank = pairs.good & (height > 0.2) & (height < 0.8)
    if np.count_nonzero(flank) < _FLANK:
        return 0.0
    change = float(np.median(pairs.y[flank] / pairs.x[flank])) - ratio
    noise = 1.25 * _scale(pairs, ratio, levels) / float(np.median(np.abs(pairs.x[flank])))
    error = noise / math.sqrt(float(np.count_nonzero(flank)))
    return 2 * change if abs(change) > _PROVEN * error and abs(change) > _LEAST * abs(ratio) else 0.0


def _of_levels(channels: Any) -> float:
    """Return the variance of the ratio by the baselines, and what a drift that was not even leaves open: 1 / 16.

    As in the live result, for a drift of more than 3 standard errors: half of the correction is open for a jump, a
    quarter for an exponential.
    """
    variance, shift, noise2 = 0.0, 0.0, 0.0
    for weight, t, level in channels:
        late = float(weight @ level.share(t))
        early = float(weight.sum()) - late
        variance += early**2 * level.variance[0] + late**2 * level.variance[-1]
        shift += late * (level.value[-1] - level.value[0])
        noise2 += late**2 * (level.variance[0] + level.variance[-1])
    return float(variance + (shift**2 / 16 if shift**2 > 9 * noise2 else 0.0))
