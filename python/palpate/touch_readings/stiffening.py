"""Whether an object stiffens with depth: the ratio of a touch against its depth."""

import math
from dataclasses import dataclass

import numpy as np

from palpate.touch_readings.channel_readings import Array, Mask, median_size
from palpate.touch_readings.sweep import Sweep

# On a thick object the ratio is the same at every depth. An object that stiffens carries more of
# the force at great depth, as a rigid support below shows there: springs in series, and a ratio
# that grows. A tilt, in contrast, changes the ratio at small depth. So the logarithm of the ratio
# of each pair, at the depth u (1 at the full depth of the hold) is
#
#     log r + s u^2 - g m(t) + l (1/u - 1) + p log(1 + c/u)
#
# s: the change by stiffening up to full depth; u^2: a law between d^1 and d^3, none of which is
# known to hold. c: a tilt, in full depths, as for the level ratio. g: creep of the soft bump,
# whose change m remembers the force. l: a tilt that grows during the fall; 0 in rise and hold.

# p of force ~ depth^p: between flat bumps (1) and domes (1.5). Another one has the error _OF_TILT.
_EXPONENT = 1.25
# Least share of the height of a pair, in both channels: below, an error of a baseline counts.
_EDGE = 1 / 8
_FEWEST_HELD = 6
_FEWEST_RISING = 3
_FEWEST_SWEPT = 5  # in rise and fall
# The time constant of creep: soft bumps creep within 2 s, and within 20 s. A hold lasts for less
# than 10 s, in which one term of 3 s follows both.
_CREEP_S = 3.0
# Standard deviations before the fit. Creep: of soft bumps, as `palpate.simulation` has it. The
# tilt in the fall: half a degree over 3 mm, at a depth of 1 mm. The others are left free.
_CREEP = 0.03
_FALL = 0.03
_FREE = 1.0
# Scatter of log r at full depth by a trembling angle (0.1 degrees over 3 mm, filtered); it
# increases as 1/u. The scatter of the pairs themselves replaces it in the standard error.
_TREMBLE = 3e-3
# Median absolute residuals of a pair that is left out, as in `sweep`, and rounds of this. A pair
# within its standard deviation stays, as nearly exact pairs have residuals of rounding only.
_SPIKE = 8 * 1.4826
_LEAST_SPIKE = 1.0
_ROUNDS = 5
_STEPS = 20  # of Gauss-Newton; 5 are usual
_LONGEST_STEP = 0.5
_CONVERGED = 1e-9
_CORRELATED = 0.05  # least correlation of residuals that counts
_LEAST_SCALE = 0.05  # of the variance of the pairs
# What the model leaves open, as a standard deviation of s: gauges that bend by 0.5 %/pF, creep
# with other time constants.
_MODEL = 0.009
# The same as a share of the tilt at full depth: the exponent, which is not known.
_OF_TILT = 0.1
_SURE = 3.0  # standard errors


@dataclass(frozen=True)
class Stiffening:
    """Change of the ratio of a touch with depth.

    Attributes
    ----------
    change : float
        Logarithm of the ratio at full depth, less that at zero depth; without tilt and creep.
    standard_error : float
        Its standard deviation.

    Examples
    --------
    >>> Stiffening(0.09, 0.01).is_significant, round(Stiffening(0.09, 0.01).share, 3)
    (True, 0.094)
    """

    change: float
    standard_error: float

    @property
    def is_significant(self) -> bool:
        """Whether the ratio grows with depth by more than 3 standard errors."""
        return self.change > _SURE * self.standard_error

    @property
    def share(self) -> float:
        """Growth of the ratio from zero to full depth, share of that at zero depth."""
        return math.expm1(self.change)


@dataclass(frozen=True)
class _DepthPairs:
    """Pairs of a sweep as the fit takes them.

    Attributes
    ----------
    log_ratio : numpy.ndarray, shape (n,)
    depth : numpy.ndarray, shape (n,)
        Depth of the soft bump, relative to the hold.
    linear : numpy.ndarray, shape (n, 4)
        The derivatives by log r, s, g and l, which do not depend on these parameters.
    """

    log_ratio: Array
    depth: Array
    linear: Array

    @property
    def weight(self) -> Array:
        """1 / standard deviation of `log_ratio`."""
        return self.depth / _TREMBLE


# 1 / standard deviation before the fit, of log r, s, g, l and c
_PRIOR = np.array([0.0, 1 / _FREE, 1 / _CREEP, 1 / _FALL, 1 / _FREE])
_CHANGE = 1  # place of s
_TILT = 4  # place of c


def stiffening(sweep: Sweep) -> Stiffening | None:
    """Return the change of the ratio with depth; None: the pairs do not show it."""
    pairs = _pairs(sweep)
    if pairs is None:
        return None
    used = np.ones(len(pairs.depth), bool)
    fitted = _fitted(pairs, used)
    for _ in range(_ROUNDS):
        if fitted is None:
            return None
        rest = np.abs(_rest(pairs, fitted))
        near = rest <= max(_SPIKE * median_size(rest[used]), _LEAST_SPIKE)
        if near[used].all():
            break
        used &= near
        fitted = _fitted(pairs, used)
    if fitted is None:
        return None
    variance = _variance(pairs, used, fitted)
    of_tilt = _OF_TILT * _EXPONENT * math.log1p(fitted[_TILT])
    error = math.sqrt(variance + _MODEL**2 + of_tilt**2)
    return Stiffening(float(fitted[_CHANGE]), error)


def _pairs(sweep: Sweep) -> _DepthPairs | None:
    """Return the pairs to use; None: they are too few."""
    if np.count_nonzero(sweep.hold) < _FEWEST_HELD:
        return None
    soft_height = float(np.median(sweep.soft[sweep.hold]))
    hard_height = float(np.median(sweep.hard[sweep.hold]))
    used = sweep.rise | sweep.hold | sweep.fall
    used &= (sweep.soft > _EDGE * soft_height) & (sweep.hard > _EDGE * hard_height)
    rising = np.count_nonzero(used & sweep.rise)
    falling = np.count_nonzero(used & sweep.fall)
    if rising < _FEWEST_RISING or rising + falling < _FEWEST_SWEPT:
        return None
    soft = sweep.soft[used]
    depth = (soft / soft_height) ** (1 / _EXPONENT)
    creep = _remembered(soft, sweep.t[used]) / soft
    in_fall = np.where(sweep.fall[used], 1 / depth - 1, 0.0)
    linear = np.stack([np.ones_like(depth), depth**2, -creep, in_fall], axis=1)
    return _DepthPairs(np.log(sweep.hard[used] / soft), depth, linear)


def _remembered(force: Array, t: Array) -> Array:
    """Return a force as creep follows it, with its time constant: at first 0."""
    kept = np.exp(-np.diff(t) / _CREEP_S)
    means = (force[1:] + force[:-1]) / 2
    level = 0.0
    levels = [level]
    for share, mean in zip(kept.tolist(), means.tolist(), strict=True):
        level = share * level + (1 - share) * mean
        levels.append(level)
    return np.array(levels)


def _rest(pairs: _DepthPairs, parameters: Array) -> Array:
    """Return what the fit leaves of each pair, in its standard deviations."""
    tilted = np.log1p(parameters[_TILT] / pairs.depth)
    model = pairs.linear @ parameters[:_TILT] + _EXPONENT * tilted
    return np.asarray((pairs.log_ratio - model) * pairs.weight)


def _slopes(pairs: _DepthPairs, parameters: Array) -> Array:
    """Return the derivatives of the model by the parameters, over the standard deviations."""
    by_tilt = _EXPONENT / (pairs.depth + parameters[_TILT])
    slopes = np.concatenate([pairs.linear, by_tilt[:, None]], axis=1)
    return np.asarray(slopes * pairs.weight[:, None])


def _fitted(pairs: _DepthPairs, used: Mask) -> Array | None:
    """Return the parameters by Gauss-Newton, with their prior; None: it does not converge."""
    least_tilt = -0.8 * float(pairs.depth.min())  # the hard bump is in contact
    parameters = np.zeros(len(_PRIOR))
    parameters[0] = np.median(pairs.log_ratio[used])
    for _ in range(_STEPS):
        rows = np.concatenate([_slopes(pairs, parameters)[used], np.diag(_PRIOR)])
        rest = np.concatenate([_rest(pairs, parameters)[used], -_PRIOR * parameters])
        step = np.linalg.lstsq(rows, rest, rcond=None)[0]
        parameters = parameters + np.clip(step, -_LONGEST_STEP, _LONGEST_STEP)
        parameters[_TILT] = max(parameters[_TILT], least_tilt)
        if np.abs(step).max() < _CONVERGED:
            return np.asarray(parameters)
    return None


def _variance(pairs: _DepthPairs, used: Mask, fitted: Array) -> float:
    """Return the variance of s, by the scatter of the pairs and its correlation."""
    rest = _rest(pairs, fitted)[used]
    slopes = _slopes(pairs, fitted)[used]
    freedom = max(len(rest) - len(_PRIOR), 1)
    scatter = float(rest @ rest) / freedom
    scale = max(scatter * _alike(rest), _LEAST_SCALE)
    information = slopes.T @ slopes / scale + np.diag(_PRIOR**2)
    return float(np.linalg.inv(information)[_CHANGE, _CHANGE])


def _alike(rest: Array) -> float:
    """Return the number of pairs that count as one: the sum of correlations up to the first 0."""
    off = rest - rest.mean()
    square = float(off @ off) or 1.0
    number = 1.0
    for lag in range(1, len(off) // 4):
        correlation = float(off[lag:] @ off[:-lag]) / square
        if correlation < _CORRELATED:
            break
        number += 2 * correlation
    return number
