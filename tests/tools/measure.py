"""The error measure, and bounds of rounding errors, for all tests and benches that compare with the reference.

Deviations are counted in eps of the type under test, relative to the exact value. Rules: two NaNs, or
two infinities of one sign, are equal; NaN or infinity in comparison with anything else has an infinite error; below the
smallest normal number the unit is eps times that number, so that zero and subnormals have a unit.
"""

import math
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

import numpy as np
from palpate import reference


@dataclass(frozen=True)
class Precision:
    """A type under test: its name, its eps (2 u), its smallest normal number."""

    name: str
    eps: float
    tiny: float


PRECISIONS = {
    kind: Precision(kind.__name__, float(np.finfo(kind).eps), float(np.finfo(kind).tiny))
    for kind in (np.float64, np.float32)
}


def bits(array: Any) -> bytes:
    """Return the bytes of the values of an array, field by field: numpy does not copy the padding between fields."""
    array = np.asarray(array)
    names = array.dtype.names
    return b"".join(array[name].tobytes() for name in names) if names else array.tobytes()


def deviation(actual: float, exact: Decimal | float, precision: Precision) -> float:
    """Return |actual - exact| in eps of `precision`, by the rules above."""
    if not (math.isfinite(actual) and math.isfinite(exact)):
        return 0.0 if actual == exact or (math.isnan(actual) and math.isnan(exact)) else math.inf
    unit = precision.eps * max(abs(float(exact)), precision.tiny)
    return abs(float(Decimal(actual) - Decimal(exact))) / unit


@dataclass(frozen=True)
class Bounds:
    """Bounds of the absolute rounding error of each value after each sample, each of shape (n,)."""

    ratio: np.ndarray[Any, np.dtype[np.float64]]
    covariance: np.ndarray[Any, np.dtype[np.float64]]
    innovation: np.ndarray[Any, np.dtype[np.float64]]
    statistic: np.ndarray[Any, np.dtype[np.float64]]


def rounding_bounds(
    exact: reference.Trace, regressor: list[float], *, drift: float, initial_ratio: float, precision: Precision
) -> Bounds:
    r"""Bound the rounding of the information form along an exact trace.

    To first order in u = eps / 2, each operation having a relative error of at most u, with x the
    regressor, R = 1/P, w = 1 - x^2 P(k) = lambda R(k-1) / R(k) the weight of the past, and in units of u:

    - information, relative: R' = lambda R + x^2 has a product (1) on each side and a sum (1), so
      D' = w (D + 1) + (1 - w) 1 + 1 = w D + 2; D(0) = 1, from 1 / initial_covariance. The bound on
      the covariance replaces lambda R by a constant that was rounded once: not more error than that.
    - covariance 1/R': D' + 1.
    - innovation e = y - x r, absolute: A = |x| E + |x r| + |e|, from the error E of r, the product, the sum.
    - ratio r' = r + K e, absolute. K = x / R' has the error D' + 1, the product 1, the sum |r'|; the
      error of r returns through 1 - K x = w:  E' = w E + |K| (|x r| + |e|) + |K e| (D' + 2) + |r'|.
    - statistic g' = max(0, g + (|e| - d)), absolute: G' = G + A + | |e| - d | + |g'|; max does not reduce it.

    The second order, and the arithmetic of the bounds themselves, are covered by a factor of 1.01.
    """
    size = len(exact.ratio)
    out = {name: np.zeros(size) for name in ("ratio", "covariance", "innovation", "statistic")}
    d_information, e_ratio, g_statistic = 1.0, 0.0, 0.0
    previous = Decimal(initial_ratio)
    for k in range(size):
        x, ratio, covariance = Decimal(regressor[k]), exact.ratio[k], exact.covariance[k]
        e, gain = exact.innovation[k], x * covariance
        past = float(1 - x * x * covariance)
        d_information = past * d_information + 2
        a_innovation = float(abs(x)) * e_ratio + float(abs(x * previous) + abs(e))
        e_ratio = (
            past * e_ratio
            + float(abs(gain) * (abs(x * previous) + abs(e)))
            + float(abs(gain * e)) * (d_information + 2)
            + float(abs(ratio))
        )
        g_statistic += a_innovation + abs(float(abs(e)) - drift) + float(exact.statistic[k])
        out["ratio"][k] = e_ratio
        out["covariance"][k] = (d_information + 1) * float(covariance)
        out["innovation"][k] = a_innovation
        out["statistic"][k] = g_statistic
        previous = ratio
    return Bounds(**{name: 1.01 * precision.eps / 2 * value + precision.tiny for name, value in out.items()})
