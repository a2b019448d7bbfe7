"""Touches on the specimens of a calibration: combined ratios, their table, and the fit."""

from collections.abc import Collection, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import chain, pairwise
from math import isfinite, nan, sqrt

import numpy as np

from palpate import number_format
from palpate.calibration.calibration_file import About
from palpate.calibration.fit import Array
from palpate.calibration.model import Calibration
from palpate.errors import CalibrationError
from palpate.materials import KnownModulus
from palpate.messages import unlike
from palpate.repeatability import most_reliable, objections, usable
from palpate.touch import Touch
from palpate.uncertainty import RatioOf, hold_ratio, level_ratio

# Data of a fit: all touches; their mean, plain or weighted; or the most reliable touch.
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
    modulus_uncertainty, common_uncertainty : float
        As in `Calibration.fit`.

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
    modulus_uncertainty: float = 0.0
    common_uncertainty: float = 0.0

    @property
    def known(self) -> KnownModulus:
        """Its modulus with the uncertainties."""
        return KnownModulus(self.modulus, self.modulus_uncertainty, self.common_uncertainty)

    @property
    def uncertainty_text(self) -> str:
        """The standard uncertainty of its modulus; "-": none is stated."""
        if not self.known.whole:
            return "-"
        return f"{number_format.error(100 * self.known.whole)} %"

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
        if len(ratios) < 2:
            return nan
        return float(np.std(ratios, ddof=1) / np.mean(ratios))

    @property
    def ratios(self) -> dict[str, float]:
        """The ratios of `RATIO_COLUMNS`; nan if no touch is usable for one."""
        ratios = dict.fromkeys(RATIO_COLUMNS, nan)
        for column, by in RATIO_COLUMNS.items():
            with suppress(ValueError):
                ratios[column] = self.choose(by).ratio
        return ratios

    @property
    def counted(self) -> int:
        """Number of touches that nothing speaks against."""
        count = 0
        for touch in self.touches:
            if not objections(touch, self.accept, self.ratio_of):
                count += 1
        return count

    def as_dict(self) -> dict[str, object]:
        """Return plain values for JSON; None for nan."""
        return {
            "specimen": self.name,
            "modulus_MPa": self.modulus,
            "modulus_uncertainty": self.modulus_uncertainty,
            "common_uncertainty": self.common_uncertainty,
            "touches": len(self.touches),
            "usable": self.counted,
            **number_format.plain({**self.ratios, "spread": self.spread}),
        }

    def cells(self) -> list[str]:
        """Return the row of a table; ratios have two digits of their scatter (less for a mean)."""
        modulus = f"{self.modulus:g}"
        if self.known.whole:
            modulus = number_format.number(self.modulus, self.known.whole * self.modulus)
        cells = [self.name, modulus, str(len(self.touches))]
        for column, ratio in self.ratios.items():
            scatter = self.spread * abs(ratio)
            if column == "mean":
                scatter /= sqrt(max(self.counted, 1))
            cells.append(number_format.number(ratio, scatter))
        if isfinite(self.spread):
            return [*cells, f"{number_format.error(100 * self.spread)} %"]
        return [*cells, "-"]


RATIO_COLUMNS = {
    "smallest P": "covariance",
    "smallest error": "standard_error",
    "nearest to mean": "agreement",
    "mean": "mean",
}
"""Columns of the table of specimens, and the choice of each ratio; the first is the paper's."""


def specimen_table(specimens: Sequence[SpecimenTouches]) -> list[list[str]]:
    """Return the table as text: header, a row for each specimen, and which columns rise."""
    rows = [["specimen", "MPa", "touches", *RATIO_COLUMNS, "spread"]]
    rows += [specimen.cells() for specimen in specimens]
    rising = []
    for ratios in zip(*(specimen.ratios.values() for specimen in specimens), strict=True):
        if not np.isfinite(ratios).all():
            rising.append("-")
        elif rises(ratios):
            rising.append("yes")
        else:
            rising.append("no")
    rows.append(["rises", "", "", *rising, ""])
    if not any(specimen.known.whole for specimen in specimens):
        return rows
    rows[0].insert(2, "u(E), k = 1")
    for row, specimen in zip(rows[1:], specimens, strict=False):
        row.insert(2, specimen.uncertainty_text)
    rows[-1].insert(2, "")
    return rows


def combined_ratio(
    touches: Sequence[Touch],
    by: str,
    accept: Collection[str] = (),
    ratio_of: RatioOf = hold_ratio,
) -> CombinedRatio:
    """Return one ratio for several touches on one object.

    Parameters
    ----------
    touches : sequence of Touch
    by : str
        One of `CHOICES` except "all". A mean uses the usable touches; the other ones as in
        `palpate.most_reliable`, without the test whether they agree.
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
        best = most_reliable(touches, by=by, scatter=None, accept=accept, ratio_of=ratio_of)
        return _single_ratio(ratio_of(best))
    each = list(map(_single_ratio, map(ratio_of, usable(touches, accept, ratio_of))))
    weights = np.ones(len(each))
    if by == "weighted":
        errors = np.array([one.standard_error for one in each])
        if (errors > 0).all():
            weights = 1 / errors**2
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
    """Return the ratio of one touch; an unknown standard error counts as 0."""
    ratio, error = known
    return CombinedRatio(ratio, error if isfinite(error) else 0.0)


def rises(ratios: Sequence[float]) -> bool:
    """Return whether each ratio is above the one before."""
    return all(after > before for before, after in pairwise(ratios))


def fit_specimens(
    specimens: Sequence[SpecimenTouches],
    *,
    by: str = "all",
    soft_ratio: float | None = 1.0,
    about: About | None = None,
) -> Calibration:
    """Return a calibration fitted to specimens.

    Parameters
    ----------
    specimens : sequence of SpecimenTouches
        Their touches with one age and, for the level ratio, one exponent: the calibration has them.
    by : str
        One of `CHOICES`. With "all", the default, the fit can estimate the scatter from touch to
        touch.
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
    >>> specimens = []
    >>> for name, modulus in SORBOTHANE_MPA.items():
    ...     specimens.append(SpecimenTouches(name, modulus, palpate.touches(runs[name])))
    >>> fit_specimens(specimens).about.fitted_on
    'all'
    """
    if by not in CHOICES:
        raise ValueError(f"by: {unlike(by, CHOICES)}")
    kinds = {specimen.ratio_of for specimen in specimens}
    used = list(chain.from_iterable(specimen.usable for specimen in specimens))
    ages = {touch.age_s for touch in used}
    exponents = {touch.contact_exponent for touch in used}
    by_level = level_ratio in kinds
    if len(kinds) > 1 or len(ages) > 1 or (by_level and len(exponents) > 1):
        raise CalibrationError(
            "touches: got several ages, exponents or kinds of ratio, allowed: one of each"
        )
    share = 1.0
    if by_level:
        share = error_share([level_ratio(touch) for touch in each.usable] for each in specimens)
    ratios = []
    moduli = []
    errors = []
    touches = []
    own = []
    common = []
    for specimen in specimens:
        for row in _ratios(specimen, by):
            ratios.append(row.ratio)
            moduli.append(specimen.modulus)
            errors.append(share * row.standard_error)
            touches.append(row.touches)
            own.append(specimen.modulus_uncertainty)
            common.append(specimen.common_uncertainty)
    found = Calibration.fit(
        ratios,
        moduli,
        standard_errors=errors,
        touches=touches,
        modulus_uncertainties=own,
        common_uncertainties=common,
        soft_ratio=soft_ratio,
        about=replace(about or About(), fitted_on=by),
    )
    return replace(
        found,
        ratio="level" if by_level else "hold",
        contact_exponent=max(exponents) if by_level else 1.0,
        age_s=max(ages, default=0.0),
        error_share=share,
    )


def _ratios(specimen: SpecimenTouches, by: str) -> list[CombinedRatio]:
    """Return the values of a specimen that are fitted."""
    if by == "all":
        return list(map(_single_ratio, map(specimen.ratio_of, specimen.usable)))
    return [specimen.choose(by)]


def error_share(specimens: Iterable[Sequence[tuple[float, float]]]) -> float:
    """Return the scatter within specimens as a share of the standard errors; at most 1.

    The standard error of a level ratio is a bound of what a wrong model costs; how much of it is
    the same in each touch, so that the calibrated curve has it, shows in the scatter: R. T. Birge,
    Physical Review 40 (1932) 207. With few degrees of freedom v it is larger by v / (v - 2), as in
    `Scatter.of`.
    """
    squares = 0.0
    freedom = 0
    for known in specimens:
        if len(known) < 2:
            continue
        ratios, errors = np.array(known, float).T
        weights = 1 / np.maximum(errors, 1e-9 * ratios) ** 2
        mean = np.average(ratios, weights=weights)
        squares += float(weights @ (ratios - mean) ** 2)
        freedom += len(known) - 1
    if freedom <= 2:
        return 1.0
    return min(float(np.sqrt(squares / (freedom - 2))), 1.0)
