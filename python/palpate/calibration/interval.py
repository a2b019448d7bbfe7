"""From a ratio to the moduli that agree with it: the calibration curve read backwards, with everything that is uncertain.

The set of all E whose predicted ratio is within t standard deviations of the measured one. Its variance is
that of a new measurement, at the E in question: the ratio's own standard error, the scatter from touch to
touch and from object to object, and the error of the fitted curve. Whatever E is, the measured ratio is within t
standard deviations of its prediction with the probability asked for, so the set holds the true E as often, near
the rigid end too, where it is not symmetric, or has no upper end. (The delta method, sigma dE/dr, fails there.)

t is Student's, with Welch and Satterthwaite's degrees of freedom: each variance counts with those it was
estimated from, the standard error as known.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.calibration.curve_fit import Fit, curve, gradient
from palpate.extras import need

Array = NDArray[np.float64]
_REACH = 40.0  # log(E / half_modulus): beyond it the curve is at its end, to the last digit
_STEPS = 401


@dataclass(frozen=True)
class Measured:
    """A ratio to be read backwards: the mean of `touches` touches, its standard error, and the level of confidence."""

    ratio: float
    standard_error: float = 0.0
    touches: float = 1
    level: float = 0.95


def bounds(fit: Fit, measured: Measured) -> tuple[float, float]:
    """Return the ends of the set of log(E / MPa) that agree with a ratio; nan, nan where none does.

    -inf and inf where softer and stiffer objects agree without end.
    """
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
    """Return log E of the ratio; infinite beyond the ends of the curve."""
    rigid, log_half, soft = fit.parameters
    if not soft < ratio < rigid:
        return np.inf if ratio >= rigid else -np.inf
    return float(log_half + np.log((ratio - soft) / (rigid - ratio)))


def _distance(fit: Fit, measured: Measured, x: Array) -> Array:
    """Ratio less its prediction at x, in units of what the level allows: falls with x."""
    return np.asarray((measured.ratio - curve(fit.parameters, x)) / allowance(fit, measured, x))


def allowance(fit: Fit, measured: Measured, x: Array) -> Array:
    """Return how far from the curve at x = log(E / MPa) a measured ratio may be: t times its standard deviation."""
    level = curve(fit.parameters, x)
    slopes = gradient(fit.parameters, x)
    touch = fit.touch_variance * level**2 / measured.touches
    specimen = fit.specimen_variance * level**2
    fitted = np.einsum("i...,ij,j...->...", slopes, fit.covariance, slopes)
    total = measured.standard_error * measured.standard_error + touch + specimen + fitted  # ** refuses to overflow
    # What rests on one estimate goes up and down together; the curve's error rests on both.
    by_specimen = specimen + fit.specimen_share * fitted if fit.touch_freedom else touch + fitted
    by_touch = touch + specimen + fitted - by_specimen
    parts = by_touch**2 / max(fit.touch_freedom, 1) + by_specimen**2 / fit.specimen_freedom
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        freedom = np.minimum(total**2 / parts, 1e9)
    t = need("scipy.special", "science").stdtrit(freedom, 0.5 + measured.level / 2)
    return np.asarray(t * np.sqrt(total))


def _crossing(fit: Fit, measured: Measured, *, inside: float, outside: float) -> float:
    """Where the distance passes 1, or -1, between a point that agrees and one that does not."""
    if not (np.isfinite(inside) and np.isfinite(outside)):
        return inside if np.isfinite(inside) else outside  # beyond _REACH
    side = np.sign(_distance(fit, measured, np.array(outside)))
    brentq = need("scipy.optimize", "science").brentq
    return float(brentq(lambda x: float(_distance(fit, measured, np.array(x)) - side), inside, outside, xtol=1e-12))
