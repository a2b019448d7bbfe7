"""Several touches on one object: which ones count, whether they agree, their mean, and the most reliable one.

Two touches on the same object differ by more than their standard errors: each is held at its own angle (the paper, Sec.
IV and Fig. 10). This scatter is proportional to the ratio. A calibration knows it; without one, `TOUCH_SCATTER` holds.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from math import erfc, exp, inf, isfinite, lgamma, log, sqrt
from operator import mul
from typing import Any

from palpate import digits
from palpate._core import Touch
from palpate.errors import unlike
from palpate.extras import need

TOUCH_SCATTER = 0.03
"""Relative standard deviation of the ratio from touch to touch of a hand, if no calibration says it: of the
simulated hand (`palpate.simulation.hand.Hand.oblique`)."""
DOUBT = 0.01
"""Probability below which differences are not by chance."""
FEWEST = 16
"""Samples of a short touch: with fewer, nothing shows that both channels follow one ratio. A burst of noise has a few."""
USABLE_IF: Mapping[str, Callable[[Touch], bool]] = {
    "short": lambda touch: isfinite(touch.standard_error) and touch.samples >= FEWEST,
    "drift": lambda touch: isfinite(touch.standard_error) and bool(touch.revised),
}
"""Flags that do not exclude a touch under a condition: its standard error includes their effect. All other flags do."""


@dataclass(frozen=True)
class Agreement:
    """Whether several touches agree, and their mean; made by `agreement`.

    Attributes
    ----------
    touches : int
        Number of touches that count.
    ratio : float
        Their mean, weighted by standard error and scatter.
    own_error : float
        Standard error of the mean by the standard errors alone, without the scatter.
    effective : float
        Number of touches with equal weights that have as much scatter in their mean.
    spread : float
        Standard deviation of the ratios, divided by their mean; 0 for one touch.
    scatter : float
        Relative scatter from touch to touch that was taken as known.
    probability : float
        Probability of such differences, or larger ones, between touches on one object.

    Examples
    --------
    >>> Agreement(2, 4.0, 0.0, 2.0, 0.02, 0.03, 0.6).agree
    True
    """

    touches: int
    ratio: float
    own_error: float
    effective: float
    spread: float
    scatter: float
    probability: float

    @property
    def agree(self) -> bool:
        """Whether the touches agree within their standard errors and the scatter."""
        return self.probability >= DOUBT

    @property
    def standard_error(self) -> float:
        """Standard error of the mean, with the scatter from touch to touch."""
        return sqrt(self.own_error**2 + (self.scatter * self.ratio) ** 2 / self.effective)

    def as_dict(self) -> dict[str, Any]:
        """Return all values, as plain numbers and text; without a mean if the touches differ."""
        mean = {"ratio": self.ratio, "standard_error": self.standard_error} if self.agree else {}
        rest = {name: value for name, value in asdict(self).items() if name not in ("ratio", "own_error", "effective")}
        return {"agree": self.agree, "ratio": None, "standard_error": None, **mean, **rest, "text": str(self)}

    def __str__(self) -> str:
        """Return mean, or difference, as a sentence."""
        percent = digits.error(100 * self.scatter)
        if self.agree:
            mean = digits.plus_minus(self.ratio, self.standard_error)
            of = "1 touch" if self.touches == 1 else f"mean of {self.touches} touches"
            return f"{of}: {mean} (scatter from touch to touch {percent} %)"
        return (
            f"the {self.touches} touches differ: their ratios spread by {digits.error(100 * self.spread)} %, more than "
            f"standard errors and scatter from touch to touch ({percent} %) explain: several objects? No mean is given"
        )


def agreement(
    touches: Sequence[Touch],
    *,
    scatter: float = TOUCH_SCATTER,
    freedom: float = inf,
    accept: Collection[str] = (),
) -> Agreement:
    """Return whether touches agree, as those on one object do, and their mean.

    The weighted sum of squares around the mean, sum (r_i - m)^2 / (s_i^2 + (scatter m)^2), is chi-squared with n - 1
    degrees of freedom for touches on one object, or F if the scatter was itself estimated.

    Parameters
    ----------
    touches : sequence of Touch
        Those with a flag that excludes them do not count. An unknown standard error counts as 0.
    scatter : float
        Relative standard deviation of the ratio from touch to touch, 0 or more; `Calibration.touch_spread` if known.
    freedom : float
        Degrees of freedom with which the scatter was estimated, 1 or more; inf: it is known.
    accept : collection of str
        Flags that do not exclude a touch.

    Returns
    -------
    Agreement

    Raises
    ------
    ValueError
        No usable touch, or an argument out of its range.

    Examples
    --------
    >>> import palpate
    >>> from palpate.simulation import scenarios
    >>> four = palpate.touches(scenarios.run("four-specimens"))
    >>> agreement(four).agree, agreement(four[:1]).agree
    (False, True)
    """
    if not (isfinite(scatter) and scatter >= 0):
        raise ValueError(f"scatter: got {scatter}, allowed: 0 or more, relative to the ratio")
    if not freedom >= 1:
        raise ValueError(f"freedom: got {freedom}, allowed: 1 or more, or inf")
    kept = usable(touches, accept)
    ratios, errors = [touch.ratio for touch in kept], [_error(touch, 0.0) for touch in kept]
    between = (scatter * sorted(ratios)[len(ratios) // 2]) ** 2
    variances = [error**2 + between for error in errors]
    weights = [1 / variance for variance in variances] if all(variances) else [1.0] * len(kept)
    shares = [weight / sum(weights) for weight in weights]
    mean = sum(map(mul, shares, ratios))
    return Agreement(
        touches=len(kept),
        ratio=mean,
        own_error=sqrt(sum((share * error) ** 2 for share, error in zip(shares, errors, strict=True))),
        effective=1 / sum(share**2 for share in shares),
        spread=_deviation(ratios) / abs(mean) if len(kept) > 1 else 0.0,
        scatter=scatter,
        probability=_probability([ratio - mean for ratio in ratios], variances, between, freedom),
    )


def objections(touch: Touch, accept: Collection[str] = ()) -> tuple[str, ...]:
    """Return the flags for which a touch does not count; empty if it does. Those in `accept` do not exclude it."""
    known = {flag for flag, holds in USABLE_IF.items() if holds(touch)}
    return tuple(flag for flag in touch.flags if flag not in known and flag not in accept)


def usable(touches: Sequence[Touch], accept: Collection[str] = ()) -> list[Touch]:
    """Return the touches without a flag that excludes them."""
    kept = [touch for touch in touches if not objections(touch, accept)]
    if not kept:
        flags = "; ".join(" ".join(touch.flags) for touch in touches) or "no touches"
        raise ValueError(f"touches: got no usable touch ({flags}), allowed: at least one without a flag")
    return kept


def most_reliable(
    touches: Sequence[Touch],
    *,
    by: str = "agreement",
    scatter: float | None = TOUCH_SCATTER,
    accept: Collection[str] = (),
) -> Touch:
    """Return the most reliable one of several touches on the same object.

    Parameters
    ----------
    touches : sequence of Touch
    by : str
        "agreement": among the usable touches, the one whose ratio is nearest to their mean; of only two, the one with
        the smaller standard error. "standard_error": the smallest one among the usable touches. "covariance": the
        smallest one among all touches, the choice of the paper (Sec. IV).
        bench/accuracy/reliability.py compares them.
    scatter : float or None
        As in `agreement`: touches that differ by more are not on one object. None: they are known to be, not tested.
    accept : collection of str
        Flags that do not exclude a touch.

    Returns
    -------
    Touch

    Raises
    ------
    ValueError
        No usable touch; touches that differ by more than standard errors and scatter; or an unknown `by`.

    Examples
    --------
    >>> import palpate
    >>> from palpate.simulation.hand import session
    >>> four = palpate.touches(session(0, moduli={"gel": 1.1})["gel"])
    >>> palpate.most_reliable(four) in four
    True
    """
    if by not in _CHOICES:
        raise ValueError(f"by: {unlike(by, _CHOICES)}")
    chosen_from = list(touches) if by == "covariance" and touches else usable(touches, accept)
    if scatter is not None:
        found = agreement(chosen_from, scatter=scatter, accept={flag for touch in chosen_from for flag in touch.flags})
        if not found.agree:
            raise ValueError(
                f"touches: {found}, allowed: touches on one object, or scatter=None if they are known to be"
            )
    return _CHOICES[by](chosen_from)


def _nearest(kept: list[Touch]) -> Touch:
    mean = sum(touch.ratio for touch in kept) / len(kept)
    return min(
        kept, key=lambda touch: (len(kept) > 2 and abs(touch.ratio - mean), _error(touch, inf), touch.covariance)
    )


def _surest(kept: list[Touch]) -> Touch:
    surest = min(kept, key=lambda touch: _error(touch, inf))
    if not isfinite(surest.standard_error):
        raise ValueError("touches: got no touch with a standard error, allowed: at least one, or another `by`")
    return surest


_CHOICES: Mapping[str, Callable[[list[Touch]], Touch]] = {
    "agreement": _nearest,
    "standard_error": _surest,
    "covariance": lambda touches: min(touches, key=lambda touch: touch.covariance),
}


def _error(touch: Touch, unknown: float) -> float:
    return touch.standard_error if isfinite(touch.standard_error) else unknown


def _deviation(values: list[float]) -> float:
    mean = sum(values) / len(values)
    return sqrt(sum((value - mean) ** 2 for value in values) / (len(values) - 1))


def _probability(distances: list[float], variances: list[float], between: float, freedom: float) -> float:
    """Return the probability of weighted squared distances from a mean that are as large or larger."""
    degrees = len(distances) - 1
    if not any(distances) or not degrees:
        return 1.0
    if not all(variances):
        return 0.0
    squares = sum(distance**2 / variance for distance, variance in zip(distances, variances, strict=True))
    share = between / len(variances) * sum(1 / variance for variance in variances)  # of the scatter
    if isfinite(freedom) and share:  # Welch and Satterthwaite: the standard errors are taken as exact
        return float(need("scipy.special", "science").fdtrc(degrees, freedom / share**2, squares / degrees))
    return _chi_squared_above(squares, degrees)


def _chi_squared_above(squares: float, degrees: int) -> float:
    """Return the probability that chi-squared is above a value; Abramowitz and Stegun 26.4.4 and 26.4.5."""
    # With h = squares / 2: a sum of exp(-h) h^j / gamma(j + 1), over j = 0, 1, ... for even degrees, and 1/2, 3/2, ...
    # for odd ones, which begin with erfc(sqrt(h)).
    half, odd = squares / 2, degrees % 2
    if half == 0:
        return 1.0
    powers = (j + odd / 2 for j in range((degrees - odd) // 2))
    terms = sum(exp(j * log(half) - half - lgamma(j + 1)) for j in powers)
    return min(terms + (erfc(sqrt(half)) if odd else 0.0), 1.0)
