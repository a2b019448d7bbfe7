"""Checks of settings, random numbers of one effect, and filters of first order: what the parts of a simulation share."""

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def within(settings: object, low: float, high: float, *names: str) -> None:
    """Check that attributes are in a closed range."""
    allowed = f"{low:g} or more" if math.isinf(high) else f"{low:g} to {high:g}"
    for name in names:
        value = getattr(settings, name)
        if not all(low <= part <= high for part in (value if isinstance(value, tuple) else (value,))):
            raise ValueError(f"{name}: got {value}, allowed: {allowed}")


def positive(settings: object, *names: str) -> None:
    """Check that attributes are finite and above 0."""
    for name in names:
        value = getattr(settings, name)
        if not 0 < value < math.inf:
            raise ValueError(f"{name}: got {value}, allowed: a finite number above 0")


def stream(seed: int, effect: str) -> np.random.Generator:
    """Return the random numbers of one effect: switching an effect on changes no random number of another effect."""
    return np.random.default_rng([seed, *effect.encode()])


_NEGLIGIBLE = 1e-18


def recursion(start: Array, pole: float) -> Array:
    """Return y with y(n) = pole y(n - 1) + start(n), y(0) = start(0)."""
    # The recursion is 1 / (1 - a L) with the lag operator L, and 1 / (1 - a L) = (1 + a L) (1 + a^2 L^2) (1 + a^4 L^4)
    # ...: log2(n) passes over the array.
    y, shift = start.copy(), 1
    while shift < len(y) and pole > _NEGLIGIBLE:
        y[shift:] += pole * y[:-shift]
        pole, shift = pole * pole, 2 * shift
    return y


def follow(x: Array, step_s: float, constant_s: float) -> Array:
    """Return y with constant_s y' = x - y, y(0) = x(0), for an x that is linear between its points."""
    # Over a step h, with a = exp(-h / tau) and g = (1 - a) tau / h: y(n) = a y(n - 1) + (1 - g) x(n) + (g - a) x(n -
    # 1), which is exact.
    pole = math.exp(-step_s / constant_s)
    mean = -math.expm1(-step_s / constant_s) * constant_s / step_s
    start = (1 - mean) * x
    start[1:] += (mean - pole) * x[:-1]
    start[:1] = x[:1]
    return recursion(start, pole)
