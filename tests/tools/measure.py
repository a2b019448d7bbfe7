"""The error measure, and bounds of rounding errors, for all tests and benches that compare with the reference.

Deviations are counted in eps of the type under test, relative to the exact value. Rules: two NaNs, or
two infinities of one sign, are equal; NaN or infinity in comparison with anything else has an infinite error; below the
smallest normal number the unit is eps times that number, so that zero and subnormals have a unit.
"""

import math
from decimal import Decimal
from typing import Any

import numpy as np
from palpate import reference


def bits(array: Any) -> bytes:
    """Return the bytes of the values of an array, field by field: numpy does not copy the padding between fields."""
    array = np.asarray(array)
    names = array.dtype.names
    return b"".join(array[name].tobytes() for name in names) if names else array.tobytes()


def deviation(actual: float, exact: Decimal | float, kind: Any) -> float:
    """Return |actual - exact| in eps of a type, np.float64 or np.float32, by the rules above."""
    if not (math.isfinite(actual) and math.isfinite(exact)):
        return 0.0 if actual == exact or (math.isnan(actual) and math.isnan(exact)) else math.inf
    unit = float(np.finfo(kind).eps) * max(abs(float(exact)), float(np.finfo(kind).tiny))
    return abs(float(Decimal(actual) - Decimal(exact))) / unit


def rounding_bounds(
    exact: reference.Trace, regressor: list[float], *, drift: float, initial_ratio: float, kind: Any
) -> dict[str, list[float]]:
    r"""Bound the absolute rounding error of ratio, covariance, innovation and statistic in a type, along an exact trace.

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
    bounds: dict[str, list[float]] = {
        name: [] for name in ("ratio", "covariance", "innovation", "statistic")
    }
    d_information = 1.0
    e_ratio = 0.0
    g_statistic = 0.0
    previous = Decimal(initial_ratio)
    for k, (ratio, covariance, e) in enumerate(
        zip(exact.ratio, exact.covariance, exact.innovation, strict=True)
    ):
        x = Decimal(regressor[k])
        past = float(1 - x * x * covariance)
        gain = x * covariance
        parts = abs(x * previous) + abs(e)
        d_information = past * d_information + 2
        a_innovation = float(abs(x)) * e_ratio + float(parts)
        e_ratio = (
            past * e_ratio
            + float(abs(gain) * parts + abs(ratio))
            + float(abs(gain * e)) * (d_information + 2)
        )
        g_statistic += a_innovation + abs(float(abs(e)) - drift) + float(exact.statistic[k])
        found = e_ratio, (d_information + 1) * float(covariance), a_innovation, g_statistic
        for values, value in zip(bounds.values(), found, strict=True):
            values.append(1.01 * float(np.finfo(kind).eps) / 2 * value + float(np.finfo(kind).tiny))
        previous = ratio
    return bounds
