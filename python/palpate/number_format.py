"""Numbers as text: a value is rounded to two digits of its uncertainty.

The rule: the uncertainty has two significant digits, and the value as many decimals. Without an uncertainty (nan, inf
or 0) a value has `FEW` significant digits, and a power of ten below 1e-4. live/page/formatting.js has the same rule for
the page.
"""

from collections.abc import Mapping
from math import inf, isfinite, isnan, nan
from typing import Any

FEW = 3
"""Significant digits of a value of unknown uncertainty."""
_MOST_PLACES = (
    8  # decimals; more are written with a power of ten, and so is what is larger than the next two
)
_LARGEST, _LARGEST_ROUNDED = 1e9, 1e6  # a rounded one ends in zeros that mean nothing
_SMALLEST = 1e-4  # of unknown uncertainty; a smaller one is mostly zeros
_SYMMETRIC = 3  # the longer side of an interval over the shorter one
_DOUBLE = 15  # decimals of a mantissa: what a double has


def number(value: float, uncertainty: float = nan) -> str:
    """Return a value rounded to two digits of its uncertainty.

    Parameters
    ----------
    value : float
        nan: unknown, "-".
    uncertainty : float
        Standard error, or half an interval. Not known (nan, inf) or 0: the value has `FEW` significant digits.

    Returns
    -------
    str

    Examples
    --------
    >>> number(1.600483, 4.7e-5), number(4.149, 0.12), number(4.149)
    ('1.600483', '4.15', '4.15')
    >>> number(4.45e-5), number(4.45e-4)
    ('4.45e-5', '0.000445')
    >>> number(0.0996, 0.012), number(0.3, 120.0), number(2e-12, 3.1e-14)
    ('0.100', '0', '2.000e-12')
    """
    if not isfinite(value):
        return "-" if isnan(value) else "inf" if value > 0 else "-inf"
    if not known(uncertainty):
        last = _exponent(value, FEW - 1) - FEW + 1
        return _powered(value, last) if 0 < abs(value) < _SMALLEST else _written(value, last, value)
    return _written(value, _last(uncertainty), max(abs(value), uncertainty))


def error(uncertainty: float) -> str:
    """Return an uncertainty with two significant digits; "-" if it is not known.

    Examples
    --------
    >>> error(4.7e-5), error(0.0996), error(123.0), error(nan)
    ('0.000047', '0.10', '120', '-')
    """
    return number(uncertainty, uncertainty) if uncertainty == 0 or known(uncertainty) else "-"


def plus_minus(value: float, uncertainty: float) -> str:
    """Return a value with its uncertainty, both with the same decimals; the text names an unknown uncertainty.

    Examples
    --------
    >>> plus_minus(4.149, 0.1164), plus_minus(1.0954, 0.07), plus_minus(4.149, nan)
    ('4.15 ± 0.12', '1.095 ± 0.070', '4.15, uncertainty not known')
    """
    if not known(uncertainty) or not isfinite(value):
        return f"{number(value)}, uncertainty not known"
    last, top = _last(uncertainty), max(abs(value), uncertainty)
    return f"{_written(value, last, top)} ± {_written(uncertainty, last, top)}"


def between(value: float, low: float, high: float) -> tuple[str, str, str]:
    """Return a value and the ends of its interval as text.

    All are rounded to two digits of half the interval. In an interval that is not nearly symmetric each end is rounded to
    two digits of its distance from the value, and the value to those of the shorter one; an end above 0 stays above 0.

    Examples
    --------
    >>> between(1.0921, 0.9573, 1.2512), between(0.5, 0.00101, 20.4), between(1.0, 1.0, 1.0)
    (('1.09', '0.96', '1.25'), ('0.50', '0.0010', '20'), ('1.00', '1.00', '1.00'))
    """
    below, above = value - low, high - value
    if known(below) and known(above) and max(below, above) <= _SYMMETRIC * min(below, above):
        below = above = (below + above) / 2
    shorter = min((reach for reach in (below, above) if known(reach)), default=nan)
    return (
        number(value, shorter),
        number(low, min(below, abs(low) or inf)),
        number(high, min(above, abs(high) or inf)),
    )


def known(uncertainty: float) -> bool:
    """Return whether an uncertainty says how many digits a value has: finite and above 0."""
    return isfinite(uncertainty) and uncertainty > 0


def plain(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values for JSON, which has no nan and no infinity: None for them."""
    return {
        name: None if isinstance(value, float) and not isfinite(value) else value
        for name, value in values.items()
    }


def _exponent(value: float, decimals: int) -> int:
    """Return the power of ten of a value rounded to a mantissa with this many decimals; 0 for 0."""
    return int(f"{value:.{decimals}e}".split("e")[1])


def _last(uncertainty: float) -> int:
    """Return the power of ten of the second digit."""
    return _exponent(uncertainty, 1) - 1


def _written(value: float, last: int, top: float) -> str:
    """Return a value whose last digit has this power of ten; `top` is the largest number beside it."""
    if last >= -_MOST_PLACES and abs(top) < (_LARGEST if last <= 0 else _LARGEST_ROUNDED):
        text = f"{round(value, -last) if last > 0 else value:.{max(-last, 0)}f}"
        return text.removeprefix("-") if float(text) == 0 else text
    return _powered(value, last)


def _powered(value: float, last: int) -> str:
    """Return a value with a power of ten, whose last digit has this one."""
    digits = _exponent(value, _DOUBLE) - last
    if value == 0 or digits < 0:
        return "0"
    mantissa, exponent = f"{value:.{min(digits, _DOUBLE)}e}".split("e")
    return f"{mantissa}e{int(exponent)}"
