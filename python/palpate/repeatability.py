"""Several touches on one object: which ones count, whether they agree, their mean, and the most reliable one.

Two touches on the same object differ by more than their standard errors: each is held at its own angle (the paper, Sec.
IV and Fig. 10). This scatter is proportional to the ratio. A calibration knows it; without one, `TOUCH_SCATTER` holds.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from math import erfc, exp, inf, isfinite, lgamma, log, sqrt
from operator import mul
from typing import Any

from palpate import number_format
from palpate._core import Touch
from palpate.errors import need, unlike

TOUCH_SCATTER = 0.03
"""Relative standard deviation of the ratio from touch to touch of a hand, if no calibration says it: of the
simulated hand (`palpate.simulation.hand.Hand.oblique`)."""
DOUBT = 0.01
"""Probability below which differences are not by chance."""
FEWEST = 16
"""Samples of a short touch: with fewer, nothing shows that both channels follow one ratio. A burst of noise has a few."""
USABLE_IF: Mapping[str, Callable[[Touch], bool]] = {
    "short": lambda touch: (
        isfinite(touch.standard_error) and touch.samples >= FEWEST and not touch.age_s
    ),
    "drift": lambda touch: (
        touch.age_s > 0 or (isfinite(touch.standard_error) and bool(touch.revised))
    ),
    "creep": lambda touch: touch.age_s > 0,
    "late": lambda touch: isfinite(touch.standard_error) and touch.samples >= FEWEST,
    "tilt": lambda _: True,
    "changed": lambda _: True,
}
"""Flags that do not exclude a touch under a condition: its standard error includes their effect, or it ends at an age,
before most of it. All other flags do."""
RatioOf = Callable[[Touch], tuple[float, float]]
"""Which ratio of a touch counts, with its standard error (nan: not known): `hold`, `level`, or `Calibration.ratio_of`."""


def hold(touch: Touch) -> tuple[float, float]:
    """Return the ratio of a touch, and its standard error."""
    return touch.ratio, touch.standard_error


def level(touch: Touch) -> tuple[float, float]:
    """Return the ratio of a touch over the swept depth, and its standard error; nan: it has none."""
    return touch.level_ratio, touch.level_standard_error


KINDS: Mapping[str, RatioOf] = {"hold": hold, "level": level}


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
        rest = {
            name: value
            for name, value in asdict(self).items()
            if name not in ("ratio", "own_error", "effective")
        }
        return {
            "agree": self.agree,
            "ratio": None,
            "standard_error": None,
            **mean,
            **rest,
            "text": str(self),
        }

    def __str__(self) -> str:
        """Return mean, or difference, as a sentence."""
        percent = number_format.error(100 * self.scatter)
        if self.agree:
            mean = number_format.plus_minus(self.ratio, self.standard_error)
            of = "1 touch" if self.touches == 1 else f"mean of {self.touches} touches"
            return f"{of}: {mean} (scatter from touch to touch {percent} %)"
        return (
            f"the {self.touches} touches differ: their ratios spread by {number_format.error(100 * self.spread)} %, more than "
            f"standard errors and scatter from touch to touch ({percent} %) explain: several objects? No mean is given"
        )


def agreement(
    touches: Sequence[Touch],
    *,
    scatter: float = TOUCH_SCATTER,
    freedom: float = inf,
    accept: Collection[str] = (),
    ratio_of: RatioOf = hold,
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
    ratio_of : callable
        Which ratio counts: `hold` or `level` of this module, or `Calibration.ratio_of`.

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
    kept = usable(touches, accept, ratio_of)
    ratios, errors = (
        [ratio_of(touch)[0] for touch in kept],
        [_error(ratio_of(touch), 0.0) for touch in kept],
    )
    between = (scatter * sorted(ratios)[len(ratios) // 2]) ** 2
    variances = [error**2 + between for error in errors]
    weights = [1 / variance for variance in variances] if all(variances) else [1.0] * len(kept)
    shares = [weight / sum(weights) for weight in weights]
    mean = sum(map(mul, shares, ratios))
    return Agreement(
        touches=len(kept),
        ratio=mean,
        own_error=sqrt(
            sum((share * error) ** 2 for share, error in zip(shares, errors, strict=True))
        ),
        effective=1 / sum(share**2 for share in shares),
        spread=_deviation(ratios) / abs(mean) if len(kept) > 1 else 0.0,
        scatter=scatter,
        probability=_probability([ratio - mean for ratio in ratios], variances, between, freedom),
    )


def objections(
    touch: Touch, accept: Collection[str] = (), ratio_of: RatioOf = hold
) -> tuple[str, ...]:
    """Return the flags for which a touch does not count; empty if it does. Those in `accept` do not exclude it.

    With `level` a touch counts with the flag "offset", and without a level ratio "no level ratio" is in the result.
    """
    known = {flag for flag, holds in USABLE_IF.items() if holds(touch)} | {
        *accept,
        *["offset"] * (ratio_of is level),
    }
    missing = ratio_of is level and not isfinite(touch.level_ratio)
    return (*(flag for flag in touch.flags if flag not in known), *["no level ratio"] * missing)


def usable(
    touches: Sequence[Touch], accept: Collection[str] = (), ratio_of: RatioOf = hold
) -> list[Touch]:
    """Return the touches with a ratio that counts, and without a flag that excludes them."""
    kept = [
        touch
        for touch in touches
        if isfinite(ratio_of(touch)[0]) and not objections(touch, accept, ratio_of)
    ]
    if not kept:
        flags = "; ".join(" ".join(touch.flags) for touch in touches) or "no touches"
        raise ValueError(
            f"touches: got no usable touch ({flags}), allowed: at least one without a flag"
        )
    return kept


def most_reliable(
    touches: Sequence[Touch],
    *,
    by: str = "agreement",
    scatter: float | None = TOUCH_SCATTER,
    accept: Collection[str] = (),
    ratio_of: RatioOf = hold,
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
    ratio_of : callable
        As in `agreement`.

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
    chosen_from = (
        list(touches) if by == "covariance" and touches else usable(touches, accept, ratio_of)
    )
    if scatter is not None:
        accepted = {flag for touch in chosen_from for flag in touch.flags}
        found = agreement(chosen_from, scatter=scatter, accept=accepted, ratio_of=ratio_of)
        if not found.agree:
            raise ValueError(
                f"touches: {found}, allowed: touches on one object, or scatter=None if they are known to be"
            )
    return _CHOICES[by](chosen_from, ratio_of)


def _nearest(kept: list[Touch], ratio_of: RatioOf) -> Touch:
    mean = sum(ratio_of(touch)[0] for touch in kept) / len(kept)

    apart = {id(touch): len(kept) > 2 and abs(ratio_of(touch)[0] - mean) for touch in kept}
    return min(
        kept, key=lambda touch: (apart[id(touch)], _error(ratio_of(touch), inf), touch.covariance)
    )


def _surest(kept: list[Touch], ratio_of: RatioOf) -> Touch:
    surest = min(kept, key=lambda touch: _error(ratio_of(touch), inf))
    if not isfinite(ratio_of(surest)[1]):
        raise ValueError(
            "touches: got no touch with a standard error, allowed: at least one, or another `by`"
        )
    return surest


_CHOICES: Mapping[str, Callable[[list[Touch], RatioOf], Touch]] = {
    "agreement": _nearest,
    "standard_error": _surest,
    "covariance": lambda touches, _: min(touches, key=lambda touch: touch.covariance),
}


def _error(known: tuple[float, float], unknown: float) -> float:
    return known[1] if isfinite(known[1]) else unknown


def _deviation(values: list[float]) -> float:
    mean = sum(values) / len(values)
    return sqrt(sum((value - mean) ** 2 for value in values) / (len(values) - 1))


def _probability(
    distances: list[float], variances: list[float], between: float, freedom: float
) -> float:
    """Return the probability of weighted squared distances from a mean that are as large or larger."""
    degrees = len(distances) - 1
    if not any(distances) or not degrees:
        return 1.0
    if not all(variances):
        return 0.0
    squares = sum(
        distance**2 / variance for distance, variance in zip(distances, variances, strict=True)
    )
    share = between / len(variances) * sum(1 / variance for variance in variances)  # of the scatter
    if (
        isfinite(freedom) and share
    ):  # Welch and Satterthwaite: the standard errors are taken as exact
        return float(
            need("scipy.special", "science").fdtrc(degrees, freedom / share**2, squares / degrees)
        )
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
