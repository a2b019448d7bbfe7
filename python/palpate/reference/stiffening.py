"""Reference of the test for an object that stiffens with depth: a fit of the ratio against depth."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

EXPONENT = 1.25  # of force against depth
EDGE = 1 / 8  # least height of a pair, as a share of the hold's
FEWEST_HELD = 6
FEWEST_RISING = 3
FEWEST_SWEPT = 5
CREEP_S = 3.0
TREMBLE = 3e-3  # scatter of log r at full depth
# Standard deviations before the fit, of log r (none), stiffening, creep, tilt in the fall, tilt.
BEFORE = [np.inf, 1.0, 0.03, 0.03, 1.0]
SPIKE = 8 * 1.4826  # median absolute residuals
LEAST_SPIKE = 1.0
ROUNDS = 5
CORRELATED = 0.05
LEAST_SCALE = 0.05
MODEL = 0.009
OF_TILT = 0.1
TINY = 1e-6  # step of a numerical derivative


class Pair(NamedTuple):
    """A pair of the sweep: log of its ratio, depth, creep, and whether it belongs to the fall."""

    log_ratio: float
    depth: float
    creep: float
    falls: bool


def modelled(pair: Pair, parameters: Array) -> float:
    """Return log r of a pair by the model.

    log r + s u^2 - g m + l (1/u - 1) + p log(1 + c/u), with l in the fall only.
    """
    log_ratio, stiffening, creep, roll, tilt = parameters
    u = pair.depth
    result = log_ratio + stiffening * u**2 - creep * pair.creep
    if pair.falls:
        result += roll * (1 / u - 1)
    return float(result + EXPONENT * np.log(1 + tilt / u))


def pairs_of(
    t: Array, hard: Array, soft: Array, rise: Mask, hold: Mask, fall: Mask
) -> list[Pair] | None:
    """Return the pairs to fit; None: too few."""
    if hold.sum() < FEWEST_HELD:
        return None
    hard_height = np.median(hard[hold])
    soft_height = np.median(soft[hold])
    high = (hard > EDGE * hard_height) & (soft > EDGE * soft_height)
    rows = np.flatnonzero((rise | hold | fall) & high)
    rising = rise[rows].sum()
    if rising < FEWEST_RISING or rising + fall[rows].sum() < FEWEST_SWEPT:
        return None
    pairs = []
    remembered = 0.0
    before = rows[0]
    for row in rows:
        # The creep follows the force: dm/dt = (force - m) / 3 s.
        kept = np.exp(-(t[row] - t[before]) / CREEP_S)
        remembered = kept * remembered + (1 - kept) * (soft[row] + soft[before]) / 2
        before = row
        depth = (soft[row] / soft_height) ** (1 / EXPONENT)
        log_ratio = np.log(hard[row] / soft[row])
        pairs.append(Pair(log_ratio, depth, remembered / soft[row], bool(fall[row])))
    return pairs


def residuals(pairs: list[Pair], parameters: Array) -> Array:
    """Return what the model leaves of each pair, in its standard deviations TREMBLE / u."""
    return np.array(
        [(pair.log_ratio - modelled(pair, parameters)) * pair.depth / TREMBLE for pair in pairs]
    )


def derivatives(pairs: list[Pair], parameters: Array) -> Array:
    """Return the derivatives of the model over the standard deviations, by central differences."""
    columns = []
    for place in range(len(parameters)):
        step = np.zeros(len(parameters))
        step[place] = TINY
        lower = residuals(pairs, parameters - step)
        higher = residuals(pairs, parameters + step)
        columns.append((lower - higher) / (2 * TINY))
    return np.array(columns).T


def least_squares(pairs: list[Pair]) -> Array | None:
    """Return the parameters of the least sum of squares, with those of the prior.

    None: it is not found.
    """
    prior = 1 / np.array(BEFORE) ** 2
    parameters: Array = np.zeros(len(BEFORE))
    parameters[0] = np.median([pair.log_ratio for pair in pairs])
    least_tilt = -0.8 * min(pair.depth for pair in pairs)
    for _ in range(100):
        slopes = derivatives(pairs, parameters)
        downhill = slopes.T @ residuals(pairs, parameters) - prior * parameters
        step = np.linalg.solve(slopes.T @ slopes + np.diag(prior), downhill)
        parameters = parameters + np.clip(step, -0.5, 0.5)
        parameters[4] = max(parameters[4], least_tilt)
        if np.abs(step).max() < 1e-8:
            return parameters
    return None


def stiffening(
    t: Array, hard: Array, soft: Array, rise: Mask, hold: Mask, fall: Mask
) -> tuple[float, float] | None:
    """Return the change of log r to full depth by stiffening, and its standard error.

    Parameters
    ----------
    t, hard, soft : numpy.ndarray, shape (n,)
        Time, s; changes of both channels from the baseline, pF.
    rise, hold, fall : numpy.ndarray of bool, shape (n,)
        Pairs of each part of the touch.

    Returns
    -------
    tuple of (float, float), or None
        None: the pairs do not show it.

    Examples
    --------
    >>> depth = np.concatenate([np.linspace(0.2, 1, 12), np.ones(20), np.linspace(1, 0.2, 12)])
    >>> row = np.arange(44)
    >>> parts = row < 12, (row >= 12) & (row < 32), row >= 32
    >>> hard = 3 * depth * np.exp(0.1 * depth**1.6)
    >>> change, error = stiffening(0.026 * row, hard, depth, *parts)
    >>> abs(change - 0.1) < 3e-4, change > 3 * error
    (True, True)
    """
    pairs = pairs_of(t, hard, soft, rise, hold, fall)
    if pairs is None:
        return None
    used = list(pairs)
    parameters = least_squares(used)
    for _ in range(ROUNDS):
        if parameters is None:
            return None
        sizes = np.abs(residuals(used, parameters))
        near = sizes <= max(SPIKE * np.median(sizes), LEAST_SPIKE)
        if near.all():
            break
        used = [pair for pair, is_near in zip(used, near, strict=True) if is_near]
        parameters = least_squares(used)
    if parameters is None:
        return None
    rest = residuals(used, parameters)
    slopes = derivatives(used, parameters)
    scatter = float(rest @ rest) / max(len(rest) - 5, 1)
    variance = max(scatter * correlation_time(rest), LEAST_SCALE)
    information = slopes.T @ slopes / variance + np.diag(1 / np.array(BEFORE) ** 2)
    of_fit = np.linalg.inv(information)[1, 1]
    of_tilt = OF_TILT * EXPONENT * np.log(1 + parameters[4])
    return float(parameters[1]), float(np.sqrt(of_fit + MODEL**2 + of_tilt**2))


def correlation_time(rest: Array) -> float:
    """Return the sum of the autocorrelations of residuals, on both sides, up to the first small one."""
    off = rest - rest.mean()
    square = (off @ off) or 1.0
    total = 1.0
    for lag in range(1, len(off) // 4):
        product = sum(off[i] * off[i + lag] for i in range(len(off) - lag))
        correlation = product / square
        if correlation < CORRELATED:
            break
        total += 2 * correlation
    return float(total)
