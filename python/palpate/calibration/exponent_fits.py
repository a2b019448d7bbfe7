"""One curve for each exponent that the contact may have, and what repeated touches show of it.

Touches that were all level cannot show the exponent: each of `EXPONENTS` stays possible, and an
interval is the union of those of the possible exponents. (A mixture would fail at the ends of the
range.) Repeated touches on one object, held at different angles, scatter least at the right one.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palpate.calibration.evidence import TouchEvidence, table_of
from palpate.calibration.fit import SMALLEST_VARIANCE, Array, CurveFit
from palpate.calibration.ranges import BEND
from palpate.errors import need
from palpate.uncertainty import LEVEL_SCATTER

FEWEST = 3  # degrees of freedom
_FAR = 0.99  # quantile of F: less difference between the scatters is no evidence
_MAD = 1.4826  # standard deviation / median of the absolute values
# Least log-likelihood of a possible exponent, relative to the likeliest: half of the 95 % quantile
# of chi-squared with one degree of freedom (S. S. Wilks, Annals of Mathematical Statistics 9, 1938).
POSSIBLE = -1.92


@dataclass(frozen=True)
class ExponentFit:
    """The calibration curve for one exponent of the contact.

    Attributes
    ----------
    contact_exponent : float
    fitted : palpate.calibration.fit.CurveFit
        Of the ratios at the median depth.
    depth_slope, depth_slope_error : float, 1/pF
        Slope of log(ratio) against the depth within the specimens, and its standard deviation.
    log_weight : float
        Logarithm of the likelihood of this exponent by the scatter of repeated touches; the largest
        of all fits is 0.
    """

    contact_exponent: float
    fitted: CurveFit
    depth_slope: float = 0.0
    depth_slope_error: float = BEND
    log_weight: float = 0.0

    @property
    def is_possible(self) -> bool:
        """Whether the repeated touches leave this exponent open."""
        return self.log_weight >= POSSIBLE


def weighted(fits: Sequence[ExponentFit], evidence: Array) -> tuple[ExponentFit, ...]:
    """Return the fits with further evidence, the logarithm of a likelihood for each."""
    weights = np.array([fit.log_weight for fit in fits]) + evidence
    weights -= weights.max()
    return tuple(
        replace(fit, log_weight=float(weight)) for fit, weight in zip(fits, weights, strict=True)
    )


def scatter_evidence(groups: Sequence[Sequence[TouchEvidence]], error_share: float) -> Array:
    """Return the logarithm of the likelihood of each exponent, at most 0, by the scatter.

    Parameters
    ----------
    groups : sequence of sequence of TouchEvidence
        Touches on one object each, of any modulus.
    error_share : float
        Share of the standard errors that shows in the scatter.

    Returns
    -------
    numpy.ndarray
        Zeros: the touches are too few, or too level, to show it.
    """
    squares: Array = np.zeros(len(groups[0][0].log_ratio)) if groups else np.zeros(1)
    freedom = 0
    errors = []
    for group in groups:
        table = table_of(group)
        away = table.log_ratio - table.log_ratio.mean(axis=0)
        squares = squares + (away**2).sum(axis=0)
        freedom += len(group) - 1
        errors += (error_share * table.standard_error).tolist()
    if freedom < FEWEST:
        return np.zeros_like(squares)
    variance = squares / freedom + float(np.median(errors)) ** 2 + LEVEL_SCATTER**2
    proportion = variance / variance.min()
    quantile = need("scipy.special", "science").fdtri(freedom, freedom, _FAR)
    if proportion.max() < quantile:
        return np.zeros_like(squares)
    return np.asarray(-freedom / 2 * np.log(proportion))


def depth_slope(
    log_ratios: Array,
    variances: Array,
    depths_pF: Array,
    specimen: NDArray[np.intp],
) -> tuple[float, float]:
    """Return the slope of log(ratio) against the depth within the specimens, and its error, 1/pF.

    Before the touches it is 0 within `BEND`. Without depths it stays so.
    """
    if not np.isfinite(depths_pF).all():
        return 0.0, BEND
    count = np.bincount(specimen)
    away = depths_pF - (np.bincount(specimen, depths_pF) / count)[specimen]
    rest = log_ratios - (np.bincount(specimen, log_ratios) / count)[specimen]
    lost = len(rest) / max(len(rest) - len(count), 1)
    scatter = _MAD * float(np.median(abs(rest)))
    total = variances + lost * scatter**2 + SMALLEST_VARIANCE
    information = float((away**2 / total).sum()) + 1 / BEND**2
    return float((away * rest / total).sum()) / information, information**-0.5
