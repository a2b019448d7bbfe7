"""What the differences between touches on one object show: the tilt of each touch, or a trend.

Two touches on one object differ because the probe is held at another angle in each (the paper,
Sec. IV), because the object or the probe changes from touch to touch, or because they are not on
one object. The touches themselves show which: a tilt moves the ratio of the hold away from the
level ratio of the same touch, and a change is a trend in the order of the touches.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from math import expm1, inf, isfinite, log, nan, sqrt
from operator import mul
from statistics import fmean, stdev

from palpate import number_format
from palpate.distributions import chi_squared_above, student_outside
from palpate.errors import need
from palpate.touch import Touch
from palpate.uncertainty import RatioOf

DOUBT = 0.01
"""Probability below which differences, or a trend, are not by chance."""
FEWEST_OF_TREND = 4
"""Touches that can show a trend."""
LARGEST_TREND = 0.2
"""Relative change of one object; beyond it several objects are likelier."""
_SHAPES = 2  # of a trend: a straight line, and one that is steep at first
_CHANGE = 2.0  # standard deviations of the ratios; a straight line over 4 touches has 2.3
_EXPLAINED = 0.5  # share of the spread that may be left without the tilt
_LEAST_TILT = 0.5  # shift of the ratio by the tilt, in differences between hold and level ratio
_MOST_TILT = 2.0


class Cause(StrEnum):
    """Likely cause of differences between touches on one object."""

    TILT = "tilt"
    TREND = "trend"


@dataclass(frozen=True)
class Trend:
    """A steady rise or fall of the ratio from touch to touch.

    Attributes
    ----------
    change : float
        From the first touch to the last one by the fitted line, relative to the first.
    probability : float
        Probability of such a trend, or a stronger one, by chance.
    """

    change: float
    probability: float

    def __str__(self) -> str:
        """Return the trend, and its likely causes, as a part of a sentence."""
        verb = "rises"
        cause = "the object stiffens, or the probe drifts"
        if self.change < 0:
            verb = "falls"
            cause = "the object softens, or the probe drifts"
        if abs(self.change) > LARGEST_TREND:
            cause = "several objects?"
        percent = number_format.error(100 * abs(self.change))
        chance = f"p = {self.probability:.1g}"
        if self.probability < 0.001:
            chance = "p < 0.001"
        return (
            f"the ratio {verb} by {percent} % from the first touch to the last "
            f"(trend, {chance}): {cause}"
        )


def trend_of(ratios: Sequence[float]) -> Trend | None:
    """Return the trend of ratios in the order of their touches; None: they show none.

    Tested is the slope of a straight line through the logarithms of the ratios, against the number
    of the touch, and against its logarithm, as the first touches often change most. The variance
    around the line is their own, so Student's t has two degrees of freedom less than touches.
    Chance finds a trend in at most `DOUBT` of the sessions (Bonferroni). With four touches this
    leaves only strong trends: the line must leave less than 1 % of their variance, with six less
    than 12 %, with ten less than 36 %.

    Parameters
    ----------
    ratios : sequence of float
        Above 0. Fewer than `FEWEST_OF_TREND` show no trend.

    Returns
    -------
    Trend or None

    Examples
    --------
    >>> print(trend_of([4.0, 3.84, 3.76, 3.72]))
    the ratio falls by 7.1 % from the first touch to the last (trend, p = 0.006): the object softens, or the probe drifts
    >>> trend_of([4.0, 3.72, 3.76, 3.84]) is None
    True
    """
    if len(ratios) < FEWEST_OF_TREND:
        return None
    logarithms = list(map(log, ratios))
    numbers = [float(number) for number in range(1, len(ratios) + 1)]
    straight = _line(numbers, logarithms)
    steep_at_first = _line(list(map(log, numbers)), logarithms)
    found = straight
    if steep_at_first.probability < straight.probability:
        found = steep_at_first
    if found.probability >= DOUBT:
        return None
    return found


def _line(across: Sequence[float], logarithms: Sequence[float]) -> Trend:
    """Return the trend by the line through these points."""
    slope, quotient = _regression(across, logarithms)
    change = expm1(slope * (across[-1] - across[0]))
    single = student_outside(quotient, len(across) - 2)
    return Trend(change, min(_SHAPES * single, 1.0))


def _regression(across: Sequence[float], values: Sequence[float]) -> tuple[float, float]:
    """Return the slope of the line through points, and its size in standard errors."""
    x = _from_mean(across)
    y = _from_mean(values)
    squares = sum(map(mul, x, x))
    slope = sum(map(mul, x, y)) / squares
    rest = [value - slope * place for value, place in zip(y, x, strict=True)]
    variance = sum(map(mul, rest, rest)) / (len(x) - 2)
    if slope == 0:
        return slope, 0.0
    if variance == 0:
        return slope, inf
    return slope, abs(slope) * sqrt(squares / variance)


def _from_mean(values: Sequence[float]) -> list[float]:
    mean = fmean(values)
    return [value - mean for value in values]


@dataclass(frozen=True)
class Differences:
    """What the differences between touches on one object show.

    Attributes
    ----------
    cause : Cause or None
        Their likely cause; None: nothing in the touches explains them.
    trend : Trend or None
        A steady rise or fall over the touches.
    without_tilt : float
        Standard deviation of the ratios without the tilt that each touch shows, relative; nan: a
        touch has no level ratio, or there are fewer than two.
    """

    cause: Cause | None = None
    trend: Trend | None = None
    without_tilt: float = nan


@dataclass(frozen=True)
class KnownScatter:
    """The relative scatter from touch to touch, and the degrees of freedom of its estimate."""

    share: float
    freedom: float = inf


def differences(touches: Sequence[Touch], ratio_of: RatioOf, scatter: KnownScatter) -> Differences:
    """Return what the differences between touches show.

    The **tilt** is the cause if the ratios without it agree, and have at most half of the spread.
    It shifts the logarithm of the ratio by k log(hold / level), the same k for all touches: k is 1
    if the contact exponent of the level ratios is the one of the bumps, and about 2 for domes
    measured with the exponent 1. The k from 0.5 to 2 with the least spread is taken.

    A **trend** is the cause if its change is twice the spread or more, and 20 % or less: more is
    another object sooner than one that softens. It is a trend of the level ratios if all touches
    have one, as a tilt does not change them.

    Parameters
    ----------
    touches : sequence of Touch
        Touches that count, in the order of their times; else they show no trend.
    ratio_of : callable
        Which ratio counts.
    scatter : KnownScatter
        Known scatter from touch to touch, with which ratios without tilt are compared.

    Returns
    -------
    Differences
    """
    ratios = [ratio_of(touch)[0] for touch in touches]
    holds = [touch.ratio for touch in touches]
    if len(ratios) < 2 or not _are_positive(ratios):
        return Differences()
    spread = stdev(map(log, ratios))
    levels = [touch.level_ratio for touch in touches]
    has_levels = _are_positive(levels) and _are_positive(holds)
    trend = None
    if _in_order(touches):
        followed = ratios
        if has_levels:
            followed = levels
        trend = trend_of(followed)
    cause = None
    if trend and _CHANGE * spread <= abs(trend.change) <= LARGEST_TREND:
        cause = Cause.TREND
    without_tilt = nan
    if has_levels:
        corrected = _without_tilt(holds, levels)
        without_tilt = stdev(corrected)
        if without_tilt <= _EXPLAINED * spread and _agree(corrected, touches, scatter):
            cause = Cause.TILT
    return Differences(cause, trend, without_tilt)


def _are_positive(ratios: Sequence[float]) -> bool:
    return all(0 < ratio < inf for ratio in ratios)


def _without_tilt(holds: Sequence[float], levels: Sequence[float]) -> list[float]:
    """Return the logarithms of the ratios without the shift by the tilt of each touch."""
    of_hold = list(map(log, holds))
    tilts = [hold - log(level) for hold, level in zip(of_hold, levels, strict=True)]
    tilt_from_mean = _from_mean(tilts)
    squares = sum(map(mul, tilt_from_mean, tilt_from_mean))
    factor = 1.0
    if squares:
        common = sum(map(mul, tilt_from_mean, of_hold))
        factor = min(max(common / squares, _LEAST_TILT), _MOST_TILT)
    return [hold - factor * tilt for hold, tilt in zip(of_hold, tilts, strict=True)]


def _agree(logarithms: Sequence[float], touches: Sequence[Touch], scatter: KnownScatter) -> bool:
    """Return whether ratios agree within the errors of the level ratios and the scatter."""
    between = scatter.share**2
    variances = []
    for touch in touches:
        variance = between
        if isfinite(touch.level_standard_error):
            variance += (touch.level_standard_error / touch.level_ratio) ** 2
        variances.append(variance)
    distances = _from_mean(logarithms)
    return probability_of(distances, variances, between, scatter.freedom) >= DOUBT


def _in_order(touches: Sequence[Touch]) -> bool:
    """Return whether no touch begins before the one before it; touches without times are."""
    return not any(later.start_s < earlier.start_s for earlier, later in pairwise(touches))


def probability_of(
    distances: Sequence[float], variances: Sequence[float], between: float, freedom: float
) -> float:
    """Return the probability of weighted squared distances that are as large or larger.

    Parameters
    ----------
    distances : sequence of float
        Distances of values from their mean.
    variances : sequence of float
        Variance of each value, with the scatter.
    between : float
        Variance of the scatter alone.
    freedom : float
        Degrees of freedom with which the scatter was estimated; inf: it is known.

    Returns
    -------
    float

    Examples
    --------
    >>> round(probability_of([-0.03, 0.03], [0.03**2, 0.03**2], 0.03**2, inf), 3)
    0.157
    """
    degrees = len(distances) - 1
    if not any(distances) or not degrees:
        return 1.0
    if not all(variances):
        return 0.0
    squares = sum(
        distance**2 / variance for distance, variance in zip(distances, variances, strict=True)
    )
    scatter_share = between / len(variances) * sum(1 / variance for variance in variances)
    if isfinite(freedom) and scatter_share:
        # Welch and Satterthwaite: the standard errors are taken as exact.
        special = need("scipy.special", "science")
        return float(special.fdtrc(degrees, freedom / scatter_share**2, squares / degrees))
    return chi_squared_above(squares, degrees)
