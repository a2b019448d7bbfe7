"""Checks of settings, and the random numbers of one effect."""

import math

import numpy as np


def within(settings: object, low: float, high: float, *names: str) -> None:
    """Check that attributes are in a closed range.

    Parameters
    ----------
    settings : object
    low, high : float
        Limits; high may be inf, which allows inf, too.
    *names : str
        Names of attributes: each a number, or a tuple of numbers.

    Raises
    ------
    ValueError
        A value is outside the range, or not a number.
    """
    allowed = f"{low:g} or more" if math.isinf(high) else f"{low:g} to {high:g}"
    for name in names:
        value = getattr(settings, name)
        if not all(low <= part <= high for part in (value if isinstance(value, tuple) else (value,))):
            raise ValueError(f"{name}: got {value}, allowed: {allowed}")


def positive(settings: object, *names: str) -> None:
    """Check that attributes are finite and above 0.

    Raises
    ------
    ValueError
        A value is not finite, or not above 0.
    """
    for name in names:
        value = getattr(settings, name)
        if not 0 < value < math.inf:
            raise ValueError(f"{name}: got {value}, allowed: a finite number above 0")


def stream(seed: int, effect: str) -> np.random.Generator:
    """Return the random numbers of one effect: an effect that is switched on leaves those of all others as they were.

    Parameters
    ----------
    seed : int, 0 or more
        Of the simulation.
    effect : str
        Any name; another name gives other numbers.

    Returns
    -------
    numpy.random.Generator
    """
    return np.random.default_rng([seed, *effect.encode()])
