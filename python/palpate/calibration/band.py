"""The fitted curve and the band for a single touch around it, as they are drawn."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate.calibration.calibration import Calibration
from palpate.calibration.curve_fit import curve
from palpate.calibration.interval import Measured, allowance

Array = NDArray[np.float64]
_BELOW, _ABOVE = 2.0, 4.0  # what is drawn reaches so many times beyond the calibrated moduli


class Band(NamedTuple):
    """Points of the curve.

    Attributes
    ----------
    log_modulus : numpy.ndarray, shape (n,)
        log(E / MPa), evenly spaced.
    ratio : numpy.ndarray, shape (n,)
    reach : numpy.ndarray, shape (n,)
        95 % of single touches lie within so much of the ratio.
    """

    log_modulus: Array
    ratio: Array
    reach: Array


def band(calibration: Calibration, points: int) -> Band:
    """Return the curve at so many moduli, from half the smallest calibrated one to four times the largest.

    Examples
    --------
    >>> found = band(Calibration.fit([2.0, 3.0, 4.0, 5.0], [0.18, 0.46, 1.0, 2.5]), 3)
    >>> np.exp(found.log_modulus).round(2).tolist()
    [0.09, 0.95, 10.0]
    """
    low, high = calibration.range
    log_modulus = np.linspace(np.log(low / _BELOW), np.log(high * _ABOVE), points)
    ratio = curve(calibration.fitted.parameters, log_modulus)
    return Band(log_modulus, ratio, allowance(calibration.fitted, Measured(1.0), log_modulus))
