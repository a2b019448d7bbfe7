"""Numbers as text: a value is rounded to two digits of its uncertainty.

The rule: the uncertainty has two significant digits, and the value as many decimals. Without an
uncertainty (nan, inf or 0) a value has `FEW` significant digits, and a power of ten below 1e-4.
live/page/formatting.js has the same rule for the page.
"""

from collections.abc import Mapping
from math import inf, isfinite, isnan, nan
from typing import Any

FEW = 3
"""Significant digits of a value of unknown uncertainty."""
_MOST_PLACES = 8  # decimals; a number with more has a power of ten
_LARGEST = 1e9  # a larger number has a power of ten
_LARGEST_ROUNDED = 1e6  # the same for a rounded number, whose last zeros mean nothing
_SMALLEST = 1e-4  # the same for a smaller one of unknown uncertainty: it is mostly zeros
_SYMMETRIC = 3  # largest quotient of both sides of a nearly symmetric interval
_DOUBLE = 15  # decimals of the mantissa of a double


def number(value: float, uncertainty: float = nan) -> str:
    """Return a value rounded to two digits of its uncertainty.

    Parameters
    ----------
    value : float
        nan: unknown, "-".
    uncertainty : float
        Standard error, or half an interval. Not known (nan, inf) or 0: the value has `FEW`
        significant digits.

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
    if isnan(value):
        return "-"
    if not isfinite(value):
        return "inf" if value > 0 else "-inf"
    if is_known(uncertainty):
        largest = max(abs(value), uncertainty)
        return _rounded(value, _last_digit(uncertainty), largest)
    last = _exponent(value, FEW - 1) - FEW + 1
    if 0 < abs(value) < _SMALLEST:
        return _with_power(value, last)
    return _rounded(value, last, value)


def error(uncertainty: float) -> str:
    """Return an uncertainty with two significant digits; "-" if it is not known.

    Examples
    --------
    >>> error(4.7e-5), error(0.0996), error(123.0), error(nan)
    ('0.000047', '0.10', '120', '-')
    """
    if uncertainty == 0 or is_known(uncertainty):
        return number(uncertainty, uncertainty)
    return "-"


def plus_minus(value: float, uncertainty: float) -> str:
    """Return a value with its uncertainty, both with the same decimals.

    If the uncertainty is not known, the text says so.

    Examples
    --------
    >>> plus_minus(4.149, 0.1164), plus_minus(1.0954, 0.07), plus_minus(4.149, nan)
    ('4.15 ± 0.12', '1.095 ± 0.070', '4.15, uncertainty not known')
    """
    if not is_known(uncertainty) or not isfinite(value):
        return f"{number(value)}, uncertainty not known"
    last = _last_digit(uncertainty)
    largest = max(abs(value), uncertainty)
    return f"{_rounded(value, last, largest)} ± {_rounded(uncertainty, last, largest)}"


def between(value: float, low: float, high: float) -> tuple[str, str, str]:
    """Return a value and the ends of its interval as text.

    All three are rounded to two digits of half the interval. If the interval is not nearly
    symmetric, each end is rounded to two digits of its distance from the value, and the value to
    two digits of the shorter distance; an end above 0 stays above 0.

    Examples
    --------
    >>> between(1.0921, 0.9573, 1.2512), between(0.5, 0.00101, 20.4), between(1.0, 1.0, 1.0)
    (('1.09', '0.96', '1.25'), ('0.50', '0.0010', '20'), ('1.00', '1.00', '1.00'))
    """
    below = value - low
    above = high - value
    has_both = is_known(below) and is_known(above)
    if has_both and max(below, above) <= _SYMMETRIC * min(below, above):
        below = above = (below + above) / 2
    shorter = min(filter(is_known, (below, above)), default=nan)
    return (
        number(value, shorter),
        number(low, min(below, abs(low) or inf)),
        number(high, min(above, abs(high) or inf)),
    )


def is_known(uncertainty: float) -> bool:
    """Return whether an uncertainty is known: finite and above 0."""
    return isfinite(uncertainty) and uncertainty > 0


def plain(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values for JSON: None in place of nan and infinity, which JSON does not have."""
    result = dict(values)
    for name, value in values.items():
        if isinstance(value, float) and not isfinite(value):
            result[name] = None
    return result


def _exponent(value: float, decimals: int) -> int:
    """Return the power of ten of a value rounded to a mantissa with this many decimals; 0 for 0."""
    return int(f"{value:.{decimals}e}".split("e")[1])


def _last_digit(uncertainty: float) -> int:
    """Return the power of ten of the second digit."""
    return _exponent(uncertainty, 1) - 1


def _rounded(value: float, last: int, largest: float) -> str:
    """Return a value whose last digit has this power of ten.

    `largest` is the largest number in the same text: all of them have a power of ten, or none.
    """
    limit = _LARGEST_ROUNDED if last > 0 else _LARGEST
    if last < -_MOST_PLACES or not abs(largest) < limit:
        return _with_power(value, last)
    if last > 0:
        value = round(value, -last)
    text = f"{value:.{max(-last, 0)}f}"
    return text.removeprefix("-") if float(text) == 0 else text


def _with_power(value: float, last: int) -> str:
    """Return a value with a power of ten; its last digit has the power `last`."""
    digits = _exponent(value, _DOUBLE) - last
    if value == 0 or digits < 0:
        return "0"
    mantissa, exponent = f"{value:.{min(digits, _DOUBLE)}e}".split("e")
    return f"{mantissa}e{int(exponent)}"
