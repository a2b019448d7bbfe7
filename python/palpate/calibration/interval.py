"""The interval of a modulus: the curve of eq. (2) read backwards from a measured ratio.

The interval is the set of all E whose predicted ratio is within t standard deviations of the
measured ratio. The variance belongs to a new measurement at this E: the standard error of the
ratio, the scatter from touch to touch and from object to object, and the error of the fitted curve.
For every E the measured ratio is within t standard deviations of its prediction with the given
probability; so the set contains the true E with this probability, also near the rigid ratio, where
the interval is not symmetric or has no upper end. (The delta method, sigma dE/dr, fails there.)

t is the quantile of Student's distribution, with the degrees of freedom of Welch and Satterthwaite:
each variance has the degrees of freedom of its estimate; the standard error and the stated
uncertainty of the moduli are taken as exact. With few of them t falls so fast that adding a standard error to a hardly known scatter narrows the
interval.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from palpate.calibration.fit import Array, CurveFit, curve, gradient
from palpate.errors import need

_REACH = 40.0  # log(E / half_modulus): beyond it the curve is constant in double precision
_STEPS = 401


@dataclass(frozen=True)
class MeasuredRatio:
    """A measured ratio, the mean of `touches` touches, with its standard error and a level."""

    ratio: float
    standard_error: float = 0.0
    touches: float = 1
    level: float = 0.95


def check_level(level: float) -> None:
    """Refuse a probability that is not between 0 and 1."""
    if not 0 < level < 1:
        raise ValueError(f"level: got {level}, allowed: 0 < level < 1")


def bounds(fit: CurveFit, measured: MeasuredRatio) -> tuple[float, float]:
    """Return the lowest and highest log(E / MPa) that agree with a ratio; nan: none agrees."""
    # -inf: all softer objects agree; inf: all stiffer objects agree.
    points = fit.parameters[1] + np.linspace(-_REACH, _REACH, _STEPS)
    middle = _best(fit, measured.ratio)
    if np.isfinite(middle):
        points = np.append(points, middle)
    x = np.concatenate([[-np.inf], np.sort(points), [np.inf]])
    agrees = np.flatnonzero(np.abs(_distance(fit, measured, x)) <= 1)
    if not len(agrees):
        return np.nan, np.nan
    low = -np.inf
    high = np.inf
    first = agrees[0]
    last = agrees[-1]
    if first > 0:
        low = _crossing(
            fit,
            measured,
            inside=x[first],
            outside=x[first - 1],
        )
    if last < len(x) - 1:
        high = _crossing(
            fit,
            measured,
            inside=x[last],
            outside=x[last + 1],
        )
    return low, high


def _best(fit: CurveFit, ratio: float) -> float:
    """Return log E for a ratio; infinite beyond the ends of the curve."""
    rigid, log_half, soft = fit.parameters
    if ratio >= rigid:
        return np.inf
    if not soft < ratio:
        return -np.inf
    return float(log_half + np.log((ratio - soft) / (rigid - ratio)))


def _distance(fit: CurveFit, measured: MeasuredRatio, x: Array) -> Array:
    """Return ratio minus prediction at x, in units of `allowance`; it decreases with x."""
    difference = measured.ratio - curve(fit.parameters, x)
    return np.asarray(difference / allowance(fit, measured, x))


class Variances(NamedTuple):
    """The parts of the variance of a measured ratio, which add up."""

    noise: float  # square of the standard error: noise of the converter
    touch: Array  # scatter from touch to touch, of the mean of the touches: how the probe is held
    specimen: Array  # scatter of specimens around the curve
    curve: Array  # error of the fitted curve

    @property
    def total(self) -> Array:
        """The sum of the parts."""
        return np.asarray(self.noise + self.touch + self.specimen + self.curve)


def variances(fit: CurveFit, measured: MeasuredRatio, x: Array) -> Variances:
    """Return the parts of the variance of a measured ratio around the curve at x = log(E / MPa)."""
    level = curve(fit.parameters, x)
    slopes = gradient(fit.parameters, x)
    error = measured.standard_error
    return Variances(
        error * error,  # not **, which raises an error at overflow
        fit.touch_variance * level**2 / measured.touches,
        fit.specimen_variance * level**2,
        np.einsum("i...,ij,j...->...", slopes, fit.covariance, slopes),
    )


def allowance(fit: CurveFit, measured: MeasuredRatio, x: Array) -> Array:
    """Return t standard deviations of a measured ratio around the curve at x = log(E / MPa)."""
    parts = variances(fit, measured, x)
    t = need("scipy.special", "science").stdtrit(
        degrees_of_freedom(fit, parts), 0.5 + measured.level / 2
    )
    return np.asarray(t * np.sqrt(parts.total))


def degrees_of_freedom(fit: CurveFit, variances: Variances) -> Array:
    """Return the degrees of freedom of the sum of variances: Welch and Satterthwaite."""
    _, touch, specimen, fitted = variances
    # Terms of one estimate are fully correlated; the error of the curve is of both estimates. Its
    # part by the uncertainty of the moduli was not estimated.
    estimated = (1 - fit.modulus_share) * fitted
    if fit.touch_freedom:
        by_specimen = specimen + fit.specimen_share * fitted
    else:
        by_specimen = touch + estimated
    by_touch = touch + specimen + estimated - by_specimen
    parts = by_touch**2 / max(fit.touch_freedom, 1) + by_specimen**2 / fit.specimen_freedom
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return np.asarray(np.minimum(variances.total**2 / parts, 1e9))


def _crossing(
    fit: CurveFit,
    measured: MeasuredRatio,
    *,
    inside: float,
    outside: float,
) -> float:
    """Return x where the distance is 1 or -1, between a point inside and one outside."""
    if not np.isfinite(inside):
        return outside  # beyond _REACH
    if not np.isfinite(outside):
        return inside
    side = np.sign(_distance(fit, measured, np.array(outside)))

    def beyond(x: float) -> float:
        return float(_distance(fit, measured, np.array(x)) - side)

    brentq = need("scipy.optimize", "science").brentq
    return float(brentq(beyond, inside, outside, xtol=1e-12))
