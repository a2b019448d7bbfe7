"""Touches on the specimens of a calibration: combined ratios, their table, and the fit."""

from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import chain, pairwise
from math import isfinite, nan, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate import number_format
from palpate.calibration.calibration_file import About
from palpate.calibration.evidence import (
    EXPONENTS,
    OF_GROWTH,
    TILT_COSTS,
    EvidenceTable,
    TouchEvidence,
    evidence_of_all,
    mean_evidence,
    table_of,
    tilt_growth,
)
from palpate.calibration.exponent_fits import (
    FEWEST,
    ExponentFit,
    depth_slope,
    scatter_evidence,
    weighted,
)
from palpate.calibration.fit import Array
from palpate.calibration.model import Calibration
from palpate.calibration.ranges import Ranges
from palpate.errors import CalibrationError
from palpate.flags import Flag
from palpate.materials import KnownModulus
from palpate.messages import unlike
from palpate.repeatability import most_reliable, objections, usable
from palpate.touch import Touch
from palpate.uncertainty import RatioOf, hold_ratio, level_ratio

_SHARES = np.linspace(0.1, 1, 19)
_SCATTERS = np.geomspace(1e-5, 0.1, 41)  # relative
_IMPOSSIBLE = -1e3  # logarithm of a likelihood
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
    chosen, weights = _selected(touches, by, accept, ratio_of)
    each = list(map(_single_ratio, map(ratio_of, chosen)))
    return weighted_mean(each, weights)


def _selected(
    touches: Sequence[Touch], by: str, accept: Collection[str], ratio_of: RatioOf
) -> tuple[list[Touch], Array]:
    """Return the touches that make one ratio, and their weights."""
    if by not in ("mean", "weighted"):
        best = most_reliable(touches, by=by, scatter=None, accept=accept, ratio_of=ratio_of)
        return [best], np.ones(1)
    chosen = usable(touches, accept, ratio_of)
    weights = np.ones(len(chosen))
    if by == "weighted":
        errors = np.array([_single_ratio(ratio_of(touch)).standard_error for touch in chosen])
        if (errors > 0).all():
            weights = 1 / errors**2
    return chosen, weights


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
    exponents: ArrayLike | None = None,
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
    exponents : array_like, shape (n,), optional
        Exponents that the contact may have; for level ratios. Default: all of
        `palpate.calibration.evidence.EXPONENTS`.
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
    kind, measured_exponent, age_s = _settings_of(specimens)
    possible = np.array([measured_exponent])
    if kind == "level":
        given = EXPONENTS if exponents is None else np.asarray(exponents, float)
        possible = np.union1d(given, possible)
    if not specimens:
        raise CalibrationError(
            "specimens: got none with a usable touch, allowed: 3 or more of different moduli"
        )
    data = _SpecimenData.of(specimens, by, kind, possible)
    likelihood = scatter_evidence(data.groups, 1.0)
    if exponents is not None and kind == "level":
        likelihood = np.where(np.isin(possible, exponents), likelihood, _IMPOSSIBLE)
    own = int(np.flatnonzero(possible == measured_exponent)[0])
    share = 1.0
    if kind == "level":
        shown = likelihood[own] < likelihood.max()
        share = error_share(data.groups, int(np.argmax(likelihood)) if shown else own)
    fits = []
    calibrations = []
    for number, exponent in enumerate(possible):
        ratios, errors, slope, slope_error = data.ratios(number, exponent, kind, share)
        found = Calibration.fit(
            ratios,
            data.moduli,
            standard_errors=errors,
            touches=data.table.touches,
            modulus_uncertainties=data.modulus_uncertainties,
            common_uncertainties=data.common_uncertainties,
            soft_ratio=soft_ratio,
            about=replace(about or About(), fitted_on=by),
        )
        calibrations.append(found)
        fits.append(ExponentFit(float(exponent), found.fitted, slope, slope_error))
    return replace(
        calibrations[own],
        ratio=kind,
        contact_exponent=measured_exponent,
        age_s=age_s,
        error_share=share,
        stiffening_share=_stiffening_share(specimens),
        exponent_fits=weighted(fits, likelihood),
        ranges=Ranges.of(data.touches),
    )


def _stiffening_share(specimens: Sequence[SpecimenTouches]) -> float:
    """Return the share of the usable touches that have the flag `stiffens`."""
    used = list(chain.from_iterable(specimen.usable for specimen in specimens))
    return sum(Flag.STIFFENS in touch.flags for touch in used) / max(len(used), 1)


def _settings_of(specimens: Sequence[SpecimenTouches]) -> tuple[str, float, float]:
    """Return kind, exponent and age of the ratios of the usable touches: they have to be the same."""
    used = list(chain.from_iterable(specimen.usable for specimen in specimens))
    kinds = {specimen.ratio_of for specimen in specimens}
    ages = {touch.age_s for touch in used}
    exponents = {touch.contact_exponent for touch in used}
    by_level = level_ratio in kinds
    if len(kinds) > 1 or len(ages) > 1 or (by_level and len(exponents) > 1):
        raise CalibrationError(
            "touches: got several ages, exponents or kinds of ratio, allowed: one of each"
        )
    age_s = max(ages, default=0.0)
    if by_level:
        return "level", max(exponents), age_s
    return "hold", 1.0, age_s


@dataclass(frozen=True)
class _SpecimenData:
    """Evidence of the specimens: of each usable touch, and of each row of the fit.

    Attributes
    ----------
    groups : list of list of TouchEvidence
        Of the usable touches of each specimen.
    rows : list of TouchEvidence
        The values that are fitted.
    specimen : numpy.ndarray of int
        Number of the specimen of each row.
    moduli : numpy.ndarray, MPa
        Of each row.
    modulus_uncertainties, common_uncertainties : numpy.ndarray
        As in `Calibration.fit`.
    """

    groups: list[list[TouchEvidence]]
    rows: list[TouchEvidence]
    specimen: NDArray[np.intp]
    moduli: Array
    modulus_uncertainties: Array
    common_uncertainties: Array

    @classmethod
    def of(
        cls, specimens: Sequence[SpecimenTouches], by: str, kind: str, exponents: Array
    ) -> "_SpecimenData":
        """Return the evidence of specimens."""
        groups = []
        rows = []
        numbers = []
        moduli = []
        for number, specimen in enumerate(specimens):
            own = evidence_of_all(specimen.usable, kind, exponents)
            groups.append(own)
            if by != "all":
                chosen, weights = _selected(
                    specimen.touches, by, specimen.accept, specimen.ratio_of
                )
                each = evidence_of_all(chosen, kind, exponents)
                own = [mean_evidence(each, weights)]
            rows += own
            numbers += [number] * len(own)
            known = (specimen.modulus, specimen.modulus_uncertainty, specimen.common_uncertainty)
            moduli += [known] * len(own)
        return cls(groups, rows, np.array(numbers), *np.array(moduli).T)

    def ratios(
        self, number: int, exponent: float, kind: str, share: float
    ) -> tuple[Array, Array, float, float]:
        """Return ratio and standard error of each row at the median depth, and the slope by depth."""
        table = self.table
        log_ratios = table.log_ratio[:, number]
        tilts = float(tilt_growth(exponent)) * np.nan_to_num(table.tilt)
        by_tilt = TILT_COSTS[kind].within * tilts
        own = share * table.standard_error
        by_growth = OF_GROWTH * table.derived[:, number]
        variances = own**2 + by_tilt**2 + by_growth**2
        slope, slope_error = depth_slope(log_ratios, variances, table.depth_pF, self.specimen)
        if np.isfinite(table.depth_pF).all():
            middle = np.median(table_of(self.touches).depth_pF)
            log_ratios = log_ratios - slope * (table.depth_pF - middle)
        ratios = np.exp(log_ratios)
        return ratios, ratios * np.sqrt(variances), slope, slope_error

    @property
    def table(self) -> EvidenceTable:
        """The rows by columns."""
        return table_of(self.rows)

    @property
    def touches(self) -> list[TouchEvidence]:
        """All usable touches."""
        return list(chain.from_iterable(self.groups))


def error_share(groups: Sequence[Sequence[TouchEvidence]], number: int) -> float:
    """Return the share of the standard errors that shows in the scatter within specimens.

    `number`: place of the exponent. The standard error of a level ratio is a bound of what a wrong
    model costs; much of it is the same in each touch, so that the calibrated curve has it. The
    variance of a touch within its specimen is (share * standard error)^2 and a scatter that is the
    same for all: both by restricted maximum likelihood (H. D. Patterson and R. Thompson, Biometrika
    58, 1971), on a grid. 1: the touches are too few.
    """
    shares, scatters = np.meshgrid(_SHARES, _SCATTERS)
    log_likelihood: Array = np.zeros(shares.shape)
    freedom = 0
    for group in groups:
        freedom += len(group) - 1
        table = table_of(group)
        log_ratios = table.log_ratio[:, number, None, None]
        errors = table.standard_error[:, None, None]
        variances = (shares * errors) ** 2 + scatters**2
        weights = 1 / variances
        total = weights.sum(axis=0)
        mean = (weights * log_ratios).sum(axis=0) / total
        squares = (weights * (log_ratios - mean) ** 2).sum(axis=0)
        log_likelihood -= (np.log(variances).sum(axis=0) + np.log(total) + squares) / 2
    if freedom < FEWEST:
        return 1.0
    return float(shares.flat[np.argmax(log_likelihood)])
