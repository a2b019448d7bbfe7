"""The modulus of touches by a calibration: the union of the intervals of all possible exponents.

For each exponent that the calibration leaves open, the touches give a ratio at the median depth of
the calibration, with its errors: those of the readings, and those by what differs from the touches
that calibrated. In the mean of several touches the former add up as the root of their squares, and
the latter with their signs; but half of each of them stays, as an effect may be even in the angle.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, inf, isnan, log, nan, sqrt

import numpy as np

from palpate.calibration.evidence import TouchEvidence
from palpate.calibration.exponent_fits import ExponentFit
from palpate.calibration.fit import Array, CurveFit
from palpate.calibration.interval import MeasuredRatio, bounds
from palpate.calibration.ranges import DifferenceErrors, Ranges, differences_of

_LARGEST = 690.0  # exp of it is still finite


@dataclass(frozen=True)
class RatioAtExponent:
    """The mean ratio of touches for one exponent of the contact.

    Attributes
    ----------
    fit : ExponentFit
    ratio : float
        At the median depth of the calibration.
    touches : float
        Effective number of touches.
    noise : float
        Relative standard error by the readings.
    differences : DifferenceErrors
        Further errors of log(ratio).
    """

    fit: ExponentFit
    ratio: float
    touches: float
    noise: float
    differences: DifferenceErrors

    def measured(self, level: float) -> MeasuredRatio:
        """Return the ratio with its whole standard error, for an interval of this level."""
        square = self.noise**2 + sum(error**2 for error in self.differences)
        return MeasuredRatio(self.ratio, self.ratio * sqrt(square), self.touches, level)

    @property
    def log_modulus(self) -> float:
        """Logarithm of the modulus by eq. (2); infinite beyond the ends of the curve."""
        return log_modulus(self.fit.fitted, self.ratio)


def log_modulus(fit: CurveFit, ratio: float) -> float:
    """Return log E for a ratio; infinite beyond the ends of the curve."""
    rigid, log_half, soft = fit.parameters
    if ratio >= rigid:
        return inf
    if ratio <= soft:
        return -inf
    return float(log_half + log((ratio - soft) / (rigid - ratio)))


def ratio_at(
    touches: Sequence[TouchEvidence],
    fit: ExponentFit,
    number: int,
    ranges: Ranges,
    *,
    kind: str,
    error_share: float,
) -> RatioAtExponent:
    """Return the mean ratio of touches at the exponent of a fit, which has this number in them."""
    log_ratios = []
    errors = []
    rows = []
    for touch in touches:
        differences = differences_of(
            touch,
            number,
            fit.contact_exponent,
            ranges,
            kind=kind,
            depth_slope_error=fit.depth_slope_error,
        )
        away = touch.depth_pF - ranges.middle_pF
        shift = 0.0 if isnan(away) else fit.depth_slope * away
        log_ratios.append(float(touch.log_ratio[number]) - shift)
        errors.append(error_share * touch.standard_error)
        rows.append(differences)
    noise = np.array(errors)
    table = np.array(rows)
    squares = noise**2 + (table**2).sum(axis=1) + fit.fitted.touch_variance
    weights = 1 / np.maximum(squares, 1e-18)
    shares = weights / weights.sum()
    return RatioAtExponent(
        fit,
        ratio=exp(float(shares @ log_ratios)),
        touches=float(1 / (shares @ shares)),
        noise=float(np.sqrt(shares**2 @ noise**2)),
        differences=DifferenceErrors(
            *np.maximum(abs(shares @ table), shares @ abs(table) / 2).tolist()
        ),
    )


def union(ratios: Sequence[RatioAtExponent], level: float) -> tuple[float, float, float]:
    """Return log E, and the ends of the union of its intervals.

    The value is the mean over the exponents, weighted by their likelihood; nan: one of them has no
    value. Both ends are nan if no modulus agrees.
    """
    ends = np.array([bounds(one.fit.fitted, one.measured(level)) for one in ratios])
    values = np.array([one.log_modulus for one in ratios])
    weights = np.exp([one.fit.log_weight for one in ratios])
    value = nan
    if np.isfinite(values).all():
        value = float(np.average(values, weights=weights))
    known = ~np.isnan(ends[:, 0])
    if not known.any():
        return value, nan, nan
    return value, float(ends[known, 0].min()), float(ends[known, 1].max())


def modulus_at(x: float) -> float:
    """Return the modulus at x = log(E / MPa); inf if a float cannot hold it."""
    return inf if x >= _LARGEST else exp(x)


def spread_of(ratios: Sequence[RatioAtExponent]) -> float:
    """Return the standard deviation of log(ratio) by the exponent: evenly spread over its range."""
    logs: Array = np.log([one.ratio for one in ratios])
    return float(np.ptp(logs)) / sqrt(12)
