"""Tails of two distributions for whole degrees of freedom, without scipy."""

from math import atan, cos, erfc, exp, lgamma, log, pi, sin, sqrt


def chi_squared_above(squares: float, degrees: int) -> float:
    """Return the probability that chi-squared is above a value.

    Abramowitz and Stegun 26.4.4 and 26.4.5: with h = squares / 2, a sum of
    exp(-h) h^j / gamma(j + 1), over j = 0, 1, ... for even degrees, and 1/2, 3/2, ... for odd ones,
    which begin with erfc(sqrt(h)).

    Examples
    --------
    >>> round(chi_squared_above(3.841, 1), 3), round(chi_squared_above(7.815, 3), 3)
    (0.05, 0.05)
    """
    half = squares / 2
    odd = degrees % 2
    if half == 0:
        return 1.0
    powers = (j + odd / 2 for j in range((degrees - odd) // 2))
    terms = sum(exp(j * log(half) - half - lgamma(j + 1)) for j in powers)
    first = erfc(sqrt(half)) if odd else 0.0
    return min(terms + first, 1.0)


def student_outside(t: float, degrees: int) -> float:
    """Return the probability that Student's t is outside of -t to t, for t of 0 or more.

    Abramowitz and Stegun 26.7.3 and 26.7.4: with tan(a) = t / sqrt(degrees), the probability of the
    inside is sin(a) (1 + 1/2 cos^2 a + 1/2 3/4 cos^4 a + ...) for even degrees, and
    2/pi (a + sin(a) (cos a + 2/3 cos^3 a + ...)) for odd ones, up to cos^(degrees - 2).

    Examples
    --------
    >>> round(student_outside(4.303, 2), 3), round(student_outside(3.182, 3), 3)
    (0.05, 0.05)
    """
    angle = atan(t / sqrt(degrees))
    odd = degrees % 2
    term = cos(angle) if odd else 1.0
    series = 0.0
    for numerator in range(1 + odd, degrees, 2):
        series += term
        term *= cos(angle) ** 2 * numerator / (numerator + 1)
    inside = sin(angle) * series
    if odd:
        inside = 2 / pi * (angle + inside)
    return max(1 - inside, 0.0)
