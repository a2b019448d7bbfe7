"""Choose one ratio from the touches on a specimen, and fit a calibration to specimens."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from palpate.calibration.fit import Array
from palpate.calibration.model import Calibration
from palpate.errors import CalibrationError
from palpate.messages import unlike
from palpate.repeatability import most_reliable, usable
from palpate.touch import Touch
from palpate.uncertainty import RatioOf, hold_ratio, level_ratio

# Data of a fit: all touches; their mean, plain, or weighted by the standard errors; or the most reliable touch.
CHOICES = ("all", "mean", "weighted", "agreement", "standard_error", "covariance")


@dataclass(frozen=True)
class CombinedRatio:
    """One ratio computed from several touches on one object.

    Attributes
    ----------
    ratio : float
    standard_error : float
        That of the estimator, without the scatter from touch to touch.
    touches : float
        Number of touches of which the ratio is the mean; with unequal weights the effective number.

    Examples
    --------
    >>> CombinedRatio(4.1, 0.002).touches
    1.0
    """

    ratio: float
    standard_error: float
    touches: float = 1.0


@dataclass(frozen=True)
class SpecimenTouches:
    """The touches on one specimen of known modulus.

    Attributes
    ----------
    name : str
    modulus : float, MPa
    touches : sequence of Touch
    accept : collection of str
        Flags that do not exclude a touch.
    ratio_of : callable
        As in `palpate.repeatability.agreement`: `hold`, the default, or `level`.

    Examples
    --------
    >>> import palpate
    >>> from palpate.simulation import scenarios
    >>> specimen = SpecimenTouches("70 A", 8.68, palpate.touches(scenarios.run("stiff-steady")))
    >>> specimen.mean == specimen.touches[0].ratio
    True
    """

    name: str
    modulus: float
    touches: Sequence[Touch]
    accept: Collection[str] = ()
    ratio_of: RatioOf = hold_ratio

    @property
    def mean(self) -> float:
        """Mean ratio of the usable touches."""
        return self.choose("mean").ratio

    @property
    def usable(self) -> list[Touch]:
        """The touches without a flag that excludes them."""
        return usable(self.touches, self.accept, self.ratio_of)

    def choose(self, by: str) -> CombinedRatio:
        """Return one ratio for the touches, as `combined_ratio` does."""
        return combined_ratio(self.touches, by, self.accept, self.ratio_of)

    @property
    def spread(self) -> float:
        """Standard deviation of these ratios, divided by their mean; nan for one touch."""
        ratios = [self.ratio_of(touch)[0] for touch in self.usable]
        return float(np.std(ratios, ddof=1) / np.mean(ratios)) if len(ratios) > 1 else float("nan")


def combined_ratio(
    touches: Sequence[Touch], by: str, accept: Collection[str] = (), ratio_of: RatioOf = hold_ratio
) -> CombinedRatio:
    """Return one ratio for several touches on one object.

    Parameters
    ----------
    touches : sequence of Touch
    by : str
        One of `CHOICES` except "all". A mean uses the usable touches; the other ones as in `palpate.most_reliable`, without
        the test whether they agree.
    accept : collection of str
        Flags that do not exclude a touch.
    ratio_of : callable
        As in `palpate.repeatability.agreement`.

    Returns
    -------
    CombinedRatio

    Raises
    ------
    ValueError
        No usable touch, or an unknown `by`.

    Examples
    --------
    >>> import palpate
    >>> from palpate.simulation import scenarios
    >>> four = palpate.touches(scenarios.run("four-specimens"))
    >>> combined_ratio(four, "mean").touches
    4.0
    """
    if by not in ("mean", "weighted"):
        return _single_ratio(
            ratio_of(most_reliable(touches, by=by, scatter=None, accept=accept, ratio_of=ratio_of))
        )
    each = [_single_ratio(ratio_of(touch)) for touch in usable(touches, accept, ratio_of)]
    errors = np.array([one.standard_error for one in each])
    weights = 1 / errors**2 if by == "weighted" and (errors > 0).all() else np.ones(len(each))
    return weighted_mean(each, weights)


def weighted_mean(each: Sequence[CombinedRatio], weights: Array) -> CombinedRatio:
    """Return the mean of ratios with these weights."""
    weights = weights / weights.sum()
    ratios, errors = np.array([(one.ratio, one.standard_error) for one in each]).T
    return CombinedRatio(
        float(weights @ ratios),
        float(np.sqrt(weights**2 @ errors**2)),
        float(1 / (weights**2).sum()),
    )


def _single_ratio(known: tuple[float, float]) -> CombinedRatio:
    return CombinedRatio(known[0], known[1] if np.isfinite(known[1]) else 0.0)


def rises(ratios: Sequence[float]) -> bool:
    """Return whether each ratio is above the one before."""
    return all(after > before for before, after in pairwise(ratios))


def fit_specimens(
    specimens: Sequence[SpecimenTouches],
    *,
    by: str = "all",
    soft_ratio: float | None = 1.0,
    about: Mapping[str, str] | None = None,
) -> Calibration:
    """Return a calibration fitted to specimens.

    Parameters
    ----------
    specimens : sequence of SpecimenTouches
        Their touches with one age and, for the level ratio, one exponent: the calibration has them.
    by : str
        One of `CHOICES`. With "all", the default, the fit can estimate the scatter from touch to touch.
    soft_ratio, about
        As in `Calibration.fit`.

    Returns
    -------
    Calibration

    Raises
    ------
    ValueError
        A specimen without a usable touch, or an unknown `by`.
    CalibrationError
        As in `Calibration.fit`; or touches with different ages, exponents or kinds of ratio.

    Examples
    --------
    >>> import palpate
    >>> from palpate.elasticity import SORBOTHANE_MPA
    >>> from palpate.simulation.hand import session
    >>> runs = session(0, touches=2)
    >>> specimens = [SpecimenTouches(name, E, palpate.touches(runs[name])) for name, E in SORBOTHANE_MPA.items()]
    >>> fit_specimens(specimens).about["fitted on"]
    'all'
    """
    if by not in CHOICES:
        raise ValueError(f"by: {unlike(by, CHOICES)}")
    by_level, share = any(specimen.ratio_of is level_ratio for specimen in specimens), 1.0
    ages, exponents = (
        {getattr(t, name) for s in specimens for t in s.usable}
        for name in ("age_s", "contact_exponent")
    )
    if (
        max(
            len(ages), len(exponents) * by_level, len({specimen.ratio_of for specimen in specimens})
        )
        > 1
    ):
        raise CalibrationError(
            "touches: got several ages, exponents or kinds of ratio, allowed: one of each"
        )
    if by_level:
        share = error_share(
            [level_ratio(touch) for touch in specimen.usable] for specimen in specimens
        )
    rows = [
        (chosen, specimen.modulus)
        for specimen in specimens
        for chosen in (
            [_single_ratio(specimen.ratio_of(touch)) for touch in specimen.usable]
            if by == "all"
            else [specimen.choose(by)]
        )
    ]
    found = Calibration.fit(
        [chosen.ratio for chosen, _ in rows],
        [modulus for _, modulus in rows],
        standard_errors=[share * chosen.standard_error for chosen, _ in rows],
        touches=[chosen.touches for chosen, _ in rows],
        soft_ratio=soft_ratio,
        about={**(about or {}), "fitted on": by},
    )
    exponent = max(exponents) if by_level else 1.0
    kind = "level" if by_level else "hold"
    return replace(
        found,
        ratio=kind,
        contact_exponent=exponent,
        age_s=max(ages, default=0.0),
        error_share=share,
    )


def error_share(specimens: Iterable[Sequence[tuple[float, float]]]) -> float:
    """Return the share of their standard errors by which ratios scatter within specimens; 1 if it is more, or not known.

    The standard error of a level ratio is a bound of what a wrong model costs; how much of it is the same in each touch,
    so that the calibrated curve has it, shows in the scatter: R. T. Birge, Physical Review 40 (1932) 207. With few degrees
    of freedom v it is larger by v / (v - 2), as in `Scatter.of`.
    """
    squares, freedom = 0.0, 0
    for known in specimens:
        ratios, errors = np.array(known, float).reshape(-1, 2).T
        weights = 1 / np.maximum(errors, 1e-9 * ratios) ** 2
        squares += (
            float(weights @ (ratios - np.average(ratios, weights=weights)) ** 2)
            if len(known) > 1
            else 0.0
        )
        freedom += max(len(known) - 1, 0)
    return min(float(np.sqrt(squares / (freedom - 2))), 1.0) if freedom > 2 else 1.0
