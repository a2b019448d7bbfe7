"""Several touches on one object: the ones that count, their agreement, mean, and the best one.

Two touches on the same object differ by more than their standard errors: each is held at its own
angle (the paper, Sec. IV and Fig. 10). This scatter is proportional to the ratio. Use the scatter
that a calibration or the session has measured, else `palpate.uncertainty.TOUCH_SCATTER`.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from math import inf, isfinite, log, nan, sqrt
from operator import mul
from statistics import pvariance
from typing import Any

from palpate import number_format
from palpate.differences import DOUBT, Cause, KnownScatter, Trend, differences, probability_of
from palpate.flags import Flag
from palpate.messages import unlike
from palpate.touch import Touch
from palpate.uncertainty import (
    LEVEL_SCATTER,
    TOUCH_SCATTER,
    RatioOf,
    Scatter,
    hold_ratio,
    level_ratio,
)

_REMARK = 1 / 3  # of the uncertainty of the mean; a smaller trend is not worth a sentence
MOST_TILTED = 0.4
"""Largest |log(hold / level ratio)| of a touch with a level ratio that counts."""
Known = tuple[float, float]
"""A ratio and its standard error."""


class Missing(StrEnum):
    """A reason without a flag why a touch does not count."""

    LEVEL_RATIO = "no level ratio"
    TOO_OBLIQUE = "held too obliquely, one bump has hardly any contact"


Objection = Flag | Missing
"""A reason why a touch does not count."""


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
    cause : Cause or None
        Likely cause of the differences, as the touches show it: the tilt of the probe, or a trend.
    trend : Trend or None
        A steady rise or fall of the ratio over the touches, in the order of their times.
    without_tilt : float
        The spread without the tilt that each touch shows; nan: a touch has no level ratio.

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
    cause: Cause | None = None
    trend: Trend | None = None
    without_tilt: float = nan

    @property
    def agree(self) -> bool:
        """Whether the touches agree within their standard errors and the scatter."""
        return self.probability >= DOUBT

    @property
    def standard_error(self) -> float:
        """Standard error of the mean, with the scatter from touch to touch."""
        return sqrt(self.own_error**2 + (self.scatter * self.ratio) ** 2 / self.effective)

    @property
    def trend_text(self) -> str:
        """The trend as a part of a sentence; "": none, or within a third of the uncertainty."""
        if self.trend is None:
            return ""
        uncertainty = self.standard_error / abs(self.ratio)
        if abs(self.trend.change) <= _REMARK * uncertainty:
            return ""
        return str(self.trend)

    def as_dict(self) -> dict[str, Any]:
        """Return all values, as plain numbers and text; without a mean if the touches differ."""
        return {
            "agree": self.agree,
            "ratio": self.ratio if self.agree else None,
            "standard_error": self.standard_error if self.agree else None,
            "touches": self.touches,
            "spread": self.spread,
            "scatter": self.scatter,
            "probability": self.probability,
            "cause": self.cause,
            "trend": self.trend and asdict(self.trend),
            **number_format.plain({"without_tilt": self.without_tilt}),
            "text": str(self),
        }

    def __str__(self) -> str:
        """Return the mean and its trend, or the difference and its likely cause, as a sentence."""
        if not self.agree:
            return f"the {self.touches} touches differ: {self._difference} No mean is given"
        return "; ".join(filter(None, [self.mean_text, self.trend_text]))

    @property
    def mean_text(self) -> str:
        """The mean with its uncertainty, as a part of a sentence."""
        scatter = number_format.error(100 * self.scatter)
        mean = number_format.plus_minus(self.ratio, self.standard_error)
        of = "1 touch" if self.touches == 1 else f"mean of {self.touches} touches"
        return f"{of}: {mean} (scatter from touch to touch {scatter} %)"

    @property
    def _difference(self) -> str:
        """The difference with its likely cause; a question where the touches show none."""
        spread = number_format.error(100 * self.spread)
        if self.cause == Cause.TILT:
            rest = number_format.error(100 * self.without_tilt)
            tilt = (
                f"their ratios spread by {spread} %, as with a probe that is held at different "
                f"angles (without the tilt that each touch shows, by {rest} %): hold it upright"
            )
            return "; ".join(filter(None, [tilt, self.trend_text])) + "."
        if self.cause == Cause.TREND:
            return f"{self.trend}."
        scatter = number_format.error(100 * self.scatter)
        return (
            f"their ratios spread by {spread} %, more than standard errors and scatter from touch "
            f"to touch ({scatter} %) explain: several objects?"
        )


def agreement(
    touches: Sequence[Touch],
    *,
    scatter: float = TOUCH_SCATTER,
    freedom: float = inf,
    accept: Collection[str] = (),
    ratio_of: RatioOf = hold_ratio,
) -> Agreement:
    """Return whether touches agree, as those on one object do, and their mean.

    The weighted sum of squares around the mean, sum (r_i - m)^2 / (s_i^2 + (scatter m)^2), is
    chi-squared with n - 1 degrees of freedom for touches on one object, or F if the scatter was
    itself estimated.

    Parameters
    ----------
    touches : sequence of Touch
        Touches with a flag that excludes them do not count. An unknown standard error counts as 0.
    scatter : float
        Relative standard deviation of the ratio from touch to touch, 0 or more;
        `Calibration.touch_spread` if known.
    freedom : float
        Degrees of freedom with which the scatter was estimated, 1 or more; inf: it is known.
    accept : collection of str
        Flags that do not exclude a touch.
    ratio_of : callable
        Which ratio counts: `hold_ratio` or `level_ratio` of `palpate.uncertainty`, or
        `Calibration.ratio_of`.

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
    counted = usable(touches, accept, ratio_of)
    known = [ratio_of(touch) for touch in counted]
    ratios: list[float] = []
    errors: list[float] = []
    for ratio, error in known:
        ratios.append(ratio)
        errors.append(_known_error(error, 0.0))
    median = sorted(ratios)[len(ratios) // 2]
    between = (scatter * median) ** 2
    variances = [error**2 + between for error in errors]
    if all(variances):
        weights = [1 / variance for variance in variances]
    else:
        weights = [1.0] * len(known)
    shares = [weight / sum(weights) for weight in weights]
    mean = sum(map(mul, shares, ratios))
    own_variance = sum((share * error) ** 2 for share, error in zip(shares, errors, strict=True))
    distances = [ratio - mean for ratio in ratios]
    show = differences(counted, ratio_of, KnownScatter(scatter, freedom))
    return Agreement(
        touches=len(known),
        ratio=mean,
        own_error=sqrt(own_variance),
        effective=1 / sum(share**2 for share in shares),
        spread=_deviation(ratios) / abs(mean) if len(known) > 1 else 0.0,
        scatter=scatter,
        probability=probability_of(distances, variances, between, freedom),
        cause=show.cause,
        trend=show.trend,
        without_tilt=show.without_tilt,
    )


def is_too_oblique(touch: Touch) -> bool:
    """Return whether a touch is tilted so far that one bump has hardly any contact."""
    if not (touch.ratio > 0 and touch.level_ratio > 0):
        return False
    return abs(log(touch.ratio / touch.level_ratio)) > MOST_TILTED


def objections(
    touch: Touch,
    accept: Collection[str] = (),
    ratio_of: RatioOf = hold_ratio,
    *,
    scatter: float | None = None,
) -> tuple[Objection, ...]:
    """Return why a touch does not count; empty if it does.

    Flags in `accept` do not exclude it, nor does one whose error is less than a third of `scatter`,
    the relative scatter from touch to touch; None: the assumed one. With `level_ratio` a touch
    counts with the flag "offset", but not without a level ratio.
    """
    by_level = ratio_of is level_ratio
    if scatter is None:
        scatter = LEVEL_SCATTER if by_level else TOUCH_SCATTER
    against: list[Objection] = []
    for flag in touch.flags:
        meaning = flag.meaning
        is_avoided = by_level and meaning.avoided_by == "level"
        is_small = meaning.error(touch) < scatter / 3
        if meaning.excludes(touch) and not (flag in accept or is_avoided or is_small):
            against.append(flag)
    if by_level and not isfinite(touch.level_ratio):
        against.append(Missing.LEVEL_RATIO)
    if by_level and is_too_oblique(touch):
        against.append(Missing.TOO_OBLIQUE)
    return tuple(against)


def usable(
    touches: Sequence[Touch], accept: Collection[str] = (), ratio_of: RatioOf = hold_ratio
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
    ratio_of: RatioOf = hold_ratio,
) -> Touch:
    """Return the most reliable one of several touches on the same object.

    Parameters
    ----------
    touches : sequence of Touch
    by : str
        "agreement": among the usable touches, the one whose ratio is nearest to their mean; of only
        two, the one with the smaller standard error. "standard_error": the smallest one among the
        usable touches. "covariance": the smallest one among all touches, the choice of the paper
        (Sec. IV). bench/accuracy/reliability.py compares them.
    scatter : float or None
        As in `agreement`: touches that differ by more are not on one object. None: they are known
        to be on one object, and not tested.
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
        No usable touch; touches that differ by more than standard errors and scatter; or an unknown
        `by`.

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
    if by == "covariance" and touches:
        candidates = list(touches)
    else:
        candidates = usable(touches, accept, ratio_of)
    if scatter is not None:
        accepted = {flag for touch in candidates for flag in touch.flags}
        test = agreement(candidates, scatter=scatter, accept=accepted, ratio_of=ratio_of)
        if not test.agree:
            raise ValueError(
                f"touches: {test}, allowed: touches on one object, or scatter=None if they are "
                "known to be"
            )
    return _CHOICES[by](candidates, ratio_of)


def _nearest(touches: list[Touch], ratio_of: RatioOf) -> Touch:
    mean = sum(ratio_of(touch)[0] for touch in touches) / len(touches)

    def key(touch: Touch) -> tuple[float, float, float]:
        ratio, error = ratio_of(touch)
        distance = abs(ratio - mean) if len(touches) > 2 else 0.0
        return distance, _known_error(error, inf), touch.covariance

    return min(touches, key=key)


def _surest(touches: list[Touch], ratio_of: RatioOf) -> Touch:
    surest = min(touches, key=lambda touch: _known_error(ratio_of(touch)[1], inf))
    if not isfinite(ratio_of(surest)[1]):
        raise ValueError(
            "touches: got no touch with a standard error, allowed: at least one, or another `by`"
        )
    return surest


def _of_least_covariance(touches: list[Touch], _: RatioOf) -> Touch:
    return min(touches, key=lambda touch: touch.covariance)


_CHOICES: Mapping[str, Callable[[list[Touch], RatioOf], Touch]] = {
    "agreement": _nearest,
    "standard_error": _surest,
    "covariance": _of_least_covariance,
}


def within_groups(named: Iterable[tuple[str | None, Known]]) -> tuple[float, int, list[Known]]:
    """Return the pooled variance of the logarithms of ratios within groups, its degrees of freedom,
    and the ratios that count.

    A ratio counts with the name of a group, above 0 and finite. Without degrees of freedom the
    variance is inf.
    """  # noqa: D205
    groups: dict[str, list[Known]] = {}
    for name, known in named:
        if name and 0 < known[0] < inf:
            groups.setdefault(name, []).append(known)
    used: list[Known] = []
    squares = []
    for group in groups.values():
        used.extend(group)
        squares.append(len(group) * pvariance([log(ratio) for ratio, _ in group]))
    freedom = len(used) - len(groups)
    variance = sum(squares) / freedom if freedom else inf
    return variance, freedom, used


def session_scatter(
    touches: Iterable[tuple[str | None, Touch]], ratio_of: RatioOf = hold_ratio
) -> Scatter:
    """Return the scatter within the specimens of a session, pooled, without the standard errors.

    Parameters
    ----------
    touches : iterable of (str or None, Touch)
        The kept touches, each with the name of its specimen. A touch without a name, or without a
        ratio above 0, does not count.
    ratio_of : callable
        As in `agreement`.

    Returns
    -------
    Scatter
        The assumed one with fewer than 3 degrees of freedom: the touches less the specimens.

    Examples
    --------
    >>> import palpate
    >>> from palpate.simulation.hand import session
    >>> four = palpate.touches(session(0, moduli={"gel": 1.1})["gel"])
    >>> session_scatter(("gel", touch) for touch in four).source
    'session'
    """
    variance, freedom, used = within_groups((name, ratio_of(touch)) for name, touch in touches)
    squares = sum((error / ratio) ** 2 for ratio, error in used if isfinite(error))
    noise = squares / max(len(used), 1)
    return Scatter.of(max(variance - noise, 0.0), freedom, "session")


def with_scatter(known: Agreement, scatter: Scatter) -> Agreement:
    """Return an agreement whose mean has the scatter of the session, if it is known."""
    if scatter.source == "session":
        return replace(known, scatter=scatter.share)
    return known


def _known_error(error: float, unknown: float) -> float:
    return error if isfinite(error) else unknown


def _deviation(values: list[float]) -> float:
    mean = sum(values) / len(values)
    return sqrt(sum((value - mean) ** 2 for value in values) / (len(values) - 1))
