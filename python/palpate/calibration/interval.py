"""Interval of the modulus for a measured ratio: the inverse of the calibration curve, with all uncertainties.

The interval is the set of all E whose predicted ratio is within t standard deviations of the measured ratio. The
variance belongs to a new measurement at this E: the standard error of the ratio, the scatter from touch to touch and
from object to object, and the error of the fitted curve. For every E the measured ratio is within t standard deviations
of its prediction with the given probability; so the set contains the true E with this probability, also near the rigid
ratio, where the interval is not symmetric or has no upper end. (The delta method, sigma dE/dr, fails there.)

t is the quantile of Student's distribution, with the degrees of freedom of Welch and Satterthwaite: each variance has
the degrees of freedom of its estimate; the standard error is taken as exact. With few of them t falls so fast that a standard
error beside a scatter that is hardly known gives a narrower interval than the scatter alone.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate.calibration.curve_fit import Fit, curve, gradient
from palpate.extras import need

Array = NDArray[np.float64]
_REACH = 40.0  # log(E / half_modulus): beyond it the curve is constant in double precision
_STEPS = 401


@dataclass(frozen=True)
class Measured:
    """A measured ratio: the mean of `touches` touches, its standard error, and the confidence level."""

    ratio: float
    standard_error: float = 0.0
    touches: float = 1
    level: float = 0.95


def bounds(fit: Fit, measured: Measured) -> tuple[float, float]:
    """Return the lowest and highest log(E / MPa) that agree with a ratio; nan, nan if none agrees."""
    # -inf: all softer objects agree; inf: all stiffer objects agree.
    log_half = fit.parameters[1]
    inner = log_half + np.linspace(-_REACH, _REACH, _STEPS)
    middle = _best(fit, measured.ratio)
    x = np.sort(np.concatenate([[-np.inf], inner, [np.inf], [middle] if np.isfinite(middle) else []]))
    agrees = np.flatnonzero(np.abs(_distance(fit, measured, x)) <= 1)
    if not len(agrees):
        return np.nan, np.nan
    first, last = agrees[0], agrees[-1]
    low = -np.inf if first == 0 else _crossing(fit, measured, inside=x[first], outside=x[first - 1])
    high = np.inf if last == len(x) - 1 else _crossing(fit, measured, inside=x[last], outside=x[last + 1])
    return low, high


def _best(fit: Fit, ratio: float) -> float:
    """Return log E for a ratio; infinite beyond the ends of the curve."""
    rigid, log_half, soft = fit.parameters
    if not soft < ratio < rigid:
        return np.inf if ratio >= rigid else -np.inf
    return float(log_half + np.log((ratio - soft) / (rigid - ratio)))


def _distance(fit: Fit, measured: Measured, x: Array) -> Array:
    """Return ratio minus prediction at x, in units of `allowance`; it decreases with x."""
    return np.asarray((measured.ratio - curve(fit.parameters, x)) / allowance(fit, measured, x))


class Variances(NamedTuple):
    """The parts of the variance of a measured ratio, which add up."""

    # noise: The square of the standard error: noise of the converter.
    # touch: Scatter from touch to touch: how the probe is held; of the mean of the touches.
    # specimen: Scatter of specimens around the curve.
    # curve: Error of the fitted curve.

    noise: float
    touch: Array
    specimen: Array
    curve: Array


def variances(fit: Fit, measured: Measured, x: Array) -> Variances:
    """Return the parts of the variance of a measured ratio around the curve at x = log(E / MPa)."""
    level = curve(fit.parameters, x)
    slopes = gradient(fit.parameters, x)
    return Variances(
        measured.standard_error * measured.standard_error,  # not **, which raises an error at overflow
        fit.touch_variance * level**2 / measured.touches,
        fit.specimen_variance * level**2,
        np.einsum("i...,ij,j...->...", slopes, fit.covariance, slopes),
    )


def allowance(fit: Fit, measured: Measured, x: Array) -> Array:
    """Return t standard deviations of a measured ratio around the curve at x = log(E / MPa)."""
    noise, touch, specimen, fitted = variances(fit, measured, x)
    total = noise + touch + specimen + fitted
    # Terms from the same estimate are fully correlated; the error of the curve comes from both estimates.
    by_specimen = specimen + fit.specimen_share * fitted if fit.touch_freedom else touch + fitted
    by_touch = touch + specimen + fitted - by_specimen
    parts = by_touch**2 / max(fit.touch_freedom, 1) + by_specimen**2 / fit.specimen_freedom
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        freedom = np.minimum(total**2 / parts, 1e9)
    t = need("scipy.special", "science").stdtrit(freedom, 0.5 + measured.level / 2)
    return np.asarray(t * np.sqrt(total))


def _crossing(fit: Fit, measured: Measured, *, inside: float, outside: float) -> float:
    """Return x at which the distance is 1 or -1, between a point inside the interval and one outside."""
    if not (np.isfinite(inside) and np.isfinite(outside)):
        return inside if np.isfinite(inside) else outside  # beyond _REACH
    side = np.sign(_distance(fit, measured, np.array(outside)))
    brentq = need("scipy.optimize", "science").brentq
    return float(brentq(lambda x: float(_distance(fit, measured, np.array(x)) - side), inside, outside, xtol=1e-12))
