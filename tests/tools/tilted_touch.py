"""A touch of a tilted probe by the equations of calibration/evidence.py, without a simulator."""

from math import exp

from example_touch import example_touch
from palpate.touch import Touch

GROWTH = 1.7


def growth(exponent: float) -> float:
    """Return the tilt at an exponent, in units of the tilt at exponent 1."""
    return 1 + GROWTH * (exponent - 1)


def tilted_touch(
    ratio: float,
    tilt: float = 0.0,
    *flags: str,
    exponent: float = 1.5,
    measured: float = 1.5,
    error: float = 1e-3,
    depth_pF: float = 1.0,
    rise_s: float = 0.3,
) -> Touch:
    """Return a touch on an object.

    Parameters
    ----------
    ratio : float
        Of a level probe.
    tilt : float
        log(hold / level ratio) at exponent 1.
    *flags : str
    exponent, measured : float
        The true exponent of the contact, and the one of the level ratio.
    error : float
        Relative standard error of both ratios.
    depth_pF : float
        Of both channels together.
    rise_s : float
    """
    hold = ratio * exp(tilt * growth(exponent))
    level = hold * exp(-tilt * growth(measured))
    return example_touch(
        *flags,
        ratio=hold,
        standard_error=error * hold,
        level_ratio=level,
        level_standard_error=error * level,
        contact_exponent=measured,
        depth_pF=depth_pF / (1 + hold),
        rise_s=rise_s,
    )
