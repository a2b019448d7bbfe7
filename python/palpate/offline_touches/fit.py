"""The ratio of a touch from its readings: matched windows, instrumental variables, without spikes and lag."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palpate.offline_touches.idle import IdleLevel, Readings

Array = NDArray[np.float64]
Levels = tuple[IdleLevel, IdleLevel]

HARD = 5
SOFT = 6
"""Readings of each channel in a window."""
BAND_Hz = (0.2, 13.0)
"""Sway and tremor of a hand."""
# as for the live filters: weight 1 from 3 Hz on, 0.3 below
_LINES_Hz = 3.0
_SLOW = 0.3
_NOISE = 1e-6  # weight of the power gain of white noise, against a mean square mismatch
_AT_ONCE = 4096  # windows solved together: some 10 MB


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
    at: NDArray[np.intp]
    weight: Array

    @property
    def value(self) -> Array:
        """The filtered value in each window."""
        return np.asarray((self.weight * self.readings.value[self.at]).sum(axis=1))

    def spread(self, values: Array) -> Array:
        """Return for each reading the sum of its weight times the value of its windows."""
        weighted = (self.weight * values[:, None]).ravel()
        return np.asarray(np.bincount(self.at.ravel(), weighted, len(self.readings.t)), np.float64)


def windows(all_hard: Readings, all_soft: Readings) -> tuple[Windows, Windows, Array]:
    """Return a window around each hard reading that has enough neighbours, and |A - B|, rms over the band, in each."""
    # With A = sum a_i exp(j w t_i) of the hard readings at t_i, and B of the soft ones likewise, the weights are the
    # minimum of the mean of |A - B|^2 over the band, plus 1e-6 (sum a_i^2 + sum b_i^2), with sum a_i = sum b_i = 1. The
    # mean of cos w (t_i - t_j) over the band has a closed form; so no even grid is needed.
    t_hard_s = all_hard.t
    t_soft_s = all_soft.t
    before = HARD // 2
    half = SOFT // 2
    centre = np.arange(before, len(t_hard_s) - before)
    after = np.searchsorted(t_soft_s, t_hard_s[centre])
    whole = (after >= half) & (after <= len(t_soft_s) - half)
    hard_at = centre[whole, None] + np.arange(-before, before + 1)
    soft_at = after[whole, None] + np.arange(-half, half)
    times = np.concatenate([t_hard_s[hard_at], t_soft_s[soft_at]], axis=1)
    parts = [_designed(times[i : i + _AT_ONCE]) for i in range(0, max(len(times), 1), _AT_ONCE)]
    weights, mismatch = (np.concatenate(part) for part in zip(*parts, strict=True))
    hard = Windows(all_hard, hard_at, weights[:, :HARD])
    soft = Windows(all_soft, soft_at, weights[:, HARD:])
    return hard, soft, mismatch


def _designed(times: Array) -> tuple[Array, Array]:
    """Return weights, shape (n, 11), and mismatch, shape (n,)."""
    number = len(times)
    size = HARD + SOFT
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

    slow = to(_LINES_Hz) - to(low)
    lines = to(high) - to(_LINES_Hz)
    return (_SLOW * slow + lines) / (_SLOW * (_LINES_Hz - low) + high - _LINES_Hz)


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
    """Changes of both channels from the baseline, pF, filtered in windows.

    Attributes
    ----------
    hard, soft : Windows
    row : numpy.ndarray of int, shape (n,)
        Row of the hard reading in the middle of each window.
    y, x : numpy.ndarray, shape (n,)
        Filtered hard and soft change, pF.
    z : numpy.ndarray, shape (n,)
        The instrumental variable: mean of the soft readings around each reading in x, without it.
    good : numpy.ndarray of bool, shape (n,)
        Windows without a gap.
    """

    hard: Windows
    soft: Windows
    row: NDArray[np.intp]
    y: Array
    x: Array
    z: Array
    good: NDArray[np.bool_]

    @property
    def high(self) -> NDArray[np.bool_]:
        """Which good windows are above half of the touch."""
        size = np.abs(self.x)
        height = size[self.good].max(initial=0)
        return np.asarray(self.good & (size > height / 2))

    def rest(self, ratio: float) -> Array:
        """Return y - ratio * x."""
        return self.y - ratio * self.x


def aligned(hard: Readings, soft: Readings) -> Aligned | None:
    """Return the windows of changes; None: there are too few."""
    in_hard, in_soft, mismatch = windows(hard, soft)
    if len(mismatch) < FEWEST:
        return None
    good = mismatch <= max(_MISMATCH, 3 * float(np.median(mismatch)))
    row = hard.row[in_hard.at[:, HARD // 2]]
    return Aligned(in_hard, in_soft, row, in_hard.value, in_soft.value, _instrument(in_soft), good)


def _instrument(soft: Windows) -> Array:
    sums = np.append(0, np.cumsum(soft.readings.value))
    first = soft.at[:, 0]
    end = soft.at[:, -1] + 1
    low = np.maximum(first - _REACH, 0)
    high = np.minimum(end + _REACH, len(sums) - 1)
    count = np.maximum(high - low - SOFT, 1)
    return np.asarray((sums[high] - sums[low] - (sums[end] - sums[first])) / count)


@dataclass(frozen=True)
class RatioFit:
    """The ratio of a touch; the fields are as in `OfflineTouch`."""

    ratio: float
    standard_error: float
    covariance: float
    samples: int
    left_out: int
    lag_s: float
    start_s: float
    stop_s: float


def fit_ratio(hard: Readings, soft: Readings, levels: Levels) -> RatioFit | None:
    """Return the ratio of the changes of both channels; None: there are too few pairs."""
    # r = sum z y / sum z x. In rounds: a lag of the soft channel, y = r (x + lag x'), is removed from its times where
    # it is significant; then of the windows that are 6 standard deviations off, in each run of them, the reading that
    # explains most is left out.
    lag = 0.0
    left_out = 0
    whole = None
    for number in range(_ROUNDS + 1):
        pairs = aligned(hard, soft)
        if pairs is None or not pairs.high.any():
            break
        ratio = float(np.median(pairs.y[pairs.high] / pairs.x[pairs.high]))
        more = _lag(pairs, ratio)
        bad = np.abs(pairs.rest(ratio)) > _OUTLIER * _scale(pairs, ratio, levels)
        if number == _ROUNDS or (more == 0 and not bad.any()):
            return _solved(pairs, pairs.good & ~bad, whole or pairs, levels, left_out, lag)
        if more:
            soft = replace(soft, t=soft.t - more)
            lag += more
            continue
        whole = whole or pairs
        keep_hard, keep_soft = _without_spikes(pairs, ratio, np.flatnonzero(bad))
        left_out += int(np.count_nonzero(~keep_hard) + np.count_nonzero(~keep_soft))
        hard = hard[keep_hard]
        soft = soft[keep_soft]
    return None


def _lag(pairs: Aligned, ratio: float) -> float:
    """Return how late the soft channel is, s; 0 if that is not significant."""
    rest = pairs.rest(ratio)
    spread = _MAD * float(np.median(np.abs(rest[pairs.good])))
    near = pairs.good & (np.abs(rest) <= _OUTLIER * spread)
    if np.count_nonzero(near) < FEWEST:
        return 0.0
    slope = np.gradient(pairs.x, pairs.hard.readings.t[pairs.hard.at[:, HARD // 2]])[near]
    squares = float(slope @ slope)
    if squares == 0 or ratio == 0:
        return 0.0
    late = float(slope @ rest[near]) / squares
    error = float(np.linalg.norm(slope * (rest[near] - late * slope))) / squares
    return late / ratio if abs(late) > _PROVEN * error else 0.0


def _scale(pairs: Aligned, ratio: float, levels: Levels) -> float:
    """Return the scatter of the windows, at least by the noise of their readings."""
    seen = _MAD * float(np.median(np.abs(pairs.rest(ratio)[pairs.good])))
    hard = (pairs.hard.weight**2).sum(axis=1)
    soft = (pairs.soft.weight**2).sum(axis=1)
    noise2 = np.median(levels[0].noise ** 2 * hard + (ratio * levels[1].noise) ** 2 * soft)
    return max(seen, math.sqrt(float(noise2)))


Mask = NDArray[np.bool_]


def _without_spikes(pairs: Aligned, ratio: float, bad: NDArray[np.intp]) -> tuple[Mask, Mask]:
    """Return masks of the readings to keep: without the one that explains most of each run of bad windows."""
    rest = pairs.rest(ratio)
    keep_hard = np.ones(len(pairs.hard.readings.t), bool)
    keep_soft = np.ones(len(pairs.soft.readings.t), bool)
    by_hard = _explained(pairs.hard, rest)
    by_soft = _explained(pairs.soft, rest)
    for run in np.split(bad, np.flatnonzero(np.diff(bad) > 1) + 1):
        hard_at = pairs.hard.at[run]
        soft_at = pairs.soft.at[run]
        if by_soft[soft_at].max() > by_hard[hard_at].max():
            _leave_out_largest(keep_soft, by_soft, soft_at)
        else:
            _leave_out_largest(keep_hard, by_hard, hard_at)
    return keep_hard, keep_soft


def _leave_out_largest(keep: Mask, explained: Array, at: NDArray[np.intp]) -> None:
    inside = np.unique(at)
    keep[inside[np.argmax(explained[inside])]] = False


def _explained(channel: Windows, rest: Array) -> Array:
    """Return the part of the sum of squares that an error of each reading explains."""
    squares = replace(channel, weight=channel.weight**2).spread(np.ones(len(rest)))
    return np.asarray(channel.spread(rest) ** 2 / np.where(squares > 0, squares, 1))


def _solved(
    pairs: Aligned,
    used: NDArray[np.bool_],
    whole: Aligned,
    levels: Levels,
    left_out: int,
    lag: float,
) -> RatioFit | None:
    """Return the result from some windows; `whole`: the pairs before readings were left out."""
    if np.count_nonzero(used) < FEWEST:
        return None
    z = np.where(used, pairs.z, 0)
    size = float(z @ pairs.x)
    ratio = float(z @ pairs.y) / size
    # ratio = truth + sum of each reading's error times its weight: exact, since the windows are linear.
    hard = pairs.hard.spread(z) / size
    soft = -pairs.soft.spread(z) * ratio / size
    of_hard = levels[0].noise ** 2 * float(hard @ hard)
    of_soft = levels[1].noise ** 2 * float(soft @ soft)
    of_readings = of_hard + of_soft
    scores = (z * pairs.rest(ratio))[used] / size
    number = max(min(_BATCHES, len(scores) // 4), 2)
    parts = np.array([part.sum() for part in np.array_split(scores, number)])
    seen = float(parts @ parts) * number / (number - 1)
    of_levels = _of_levels(
        _LevelError.of(hard, pairs.hard.readings.t, levels[0]),
        _LevelError.of(soft, pairs.soft.readings.t, levels[1]),
    )
    of_flanks = _flank_error(whole, ratio, levels)
    times = pairs.hard.readings.t[pairs.hard.at[used]]
    return RatioFit(
        ratio=ratio,
        standard_error=math.sqrt(max(of_readings, seen) + of_levels + of_flanks**2),
        covariance=1 / size,
        samples=len(scores),
        left_out=left_out,
        lag_s=lag,
        start_s=float(times.min()),
        stop_s=float(times.max()),
    )


def _flank_error(pairs: Aligned, ratio: float, levels: Levels) -> float:
    """Return twice the change of the ratio from the flanks of the touch to its height, if it is significant; else 0."""
    # An offset or a curve causes it. At half of the height, the change by an offset is the error of the result; a curve
    # has half of its change as error.
    height = np.abs(pairs.x) / float(np.median(np.abs(pairs.x[pairs.high])))
    flank = pairs.good & (height > 0.2) & (height < 0.8)
    if np.count_nonzero(flank) < _FLANK:
        return 0.0
    change = float(np.median(pairs.y[flank] / pairs.x[flank])) - ratio
    noise = 1.25 * _scale(pairs, ratio, levels) / float(np.median(np.abs(pairs.x[flank])))
    error = noise / math.sqrt(float(np.count_nonzero(flank)))
    is_significant = abs(change) > _PROVEN * error and abs(change) > _LEAST * abs(ratio)
    return 2 * change if is_significant else 0.0


@dataclass(frozen=True)
class _LevelError:
    """Effect of a channel's baseline on the ratio: variance, shift by its drift, and variance of that shift."""

    variance: float
    shift: float
    shift_variance: float

    @staticmethod
    def of(weight: Array, t: Array, level: IdleLevel) -> "_LevelError":
        """Return the effect of a baseline; `weight`: of each reading in the ratio, `t`: its time."""
        late = float(weight @ level.share(t))
        early = float(weight.sum()) - late
        return _LevelError(
            early**2 * level.variance[0] + late**2 * level.variance[-1],
            late * (level.value[-1] - level.value[0]),
            late**2 * (level.variance[0] + level.variance[-1]),
        )


def _of_levels(hard: _LevelError, soft: _LevelError) -> float:
    """Return the variance of the ratio by the baselines, with 1/16 of the squared shift by a significant drift."""
    # As in the live result, for a drift of more than 3 standard errors: half of the correction is open for a jump, a
    # quarter for an exponential.
    variance = hard.variance + soft.variance
    shift = hard.shift + soft.shift
    if shift**2 > 9 * (hard.shift_variance + soft.shift_variance):
        variance += shift**2 / 16
    return float(variance)


_KNOWN = 4  # pairs of a part whose ratio can be compared
_AGREE = 5.0  # standard errors between two parts


def since_change(pairs: Aligned, alarms: NDArray[np.intp]) -> int | None:
    """Return the row with which the part since the last change begins; None: that part is too short to be known."""
    # An alarm is a change only if the ratios on both sides of it differ: noise of a burst alarms, too. From the last
    # part back, parts are joined as long as they agree; one that is too short to be compared joins with the one before
    # it.
    high = pairs.high
    ratios = pairs.y[high] / pairs.x[high]
    rows = pairs.row[high]
    parts = np.split(ratios, np.searchsorted(rows, alarms + 1))
    starts = [int(pairs.hard.readings.row[0])]
    for alarm in alarms:
        starts.append(int(alarm) + 1)
    known = [i for i, part in enumerate(parts) if len(part) >= _KNOWN]
    if not known:
        return None
    last = known.pop()
    joined = parts[last]
    tail = np.concatenate(parts[last + 1 :]) if last + 1 < len(parts) else joined[:0]
    if len(tail) and abs(np.median(tail) - np.median(joined)) > _OUTLIER * _spread(joined):
        return None
    begin = last
    while known and _agree(parts[known[-1]], joined):
        begin = known.pop()
        joined = np.concatenate([parts[begin], joined])
    return starts[begin]


def _spread(ratios: Array) -> float:
    return _MAD * float(np.median(np.abs(ratios - np.median(ratios))))


def _agree(one: Array, other: Array) -> bool:
    """Return whether two medians agree; their errors are 1.25 spread / sqrt(n), and 1.5 times for neighbours alike."""
    errors = [1.9 * _spread(ratios) / np.sqrt(len(ratios)) for ratios in (one, other)]
    return bool(abs(np.median(one) - np.median(other)) <= _AGREE * np.hypot(*errors))
