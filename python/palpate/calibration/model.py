"""The calibration of a probe: fitted to specimens, it converts a ratio to a modulus."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import exp, hypot, inf, isfinite, isnan, log, nan, sqrt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from palpate import number_format
from palpate._core import Tracker, __version__
from palpate.calibration.assessment import other_settings
from palpate.calibration.assurance import CalibrationVerification, compare
from palpate.calibration.calibration_file import About, StoredCalibration
from palpate.calibration.evidence import TouchEvidence, evidence_of_all
from palpate.calibration.exponent_fits import ExponentFit, scatter_evidence, weighted
from palpate.calibration.fit import MeanRatios, ModulusErrors, curve, fit_curve, fit_data
from palpate.calibration.interval import (
    MeasuredRatio,
    Variances,
    allowance,
    bounds,
    check_level,
    variances,
)
from palpate.calibration.modulus import Modulus, UncertaintyPart
from palpate.calibration.plot import CalibrationCurve, curve_picture, draw_calibration
from palpate.calibration.ranges import differences_of
from palpate.calibration.touch_modulus import (
    RatioAtExponent,
    modulus_at,
    ratio_at,
    spread_of,
    union,
)
from palpate.elasticity import Elasticity
from palpate.errors import CalibrationError
from palpate.flags import Flag
from palpate.plotted import Plotted
from palpate.repeatability import (
    MOST_TILTED,
    Agreement,
    agreement,
    is_too_oblique,
    objections,
)
from palpate.touch import Touch
from palpate.uncertainty import LEVEL_SCATTER, Scatter

_TOO_OBLIQUE = (
    f"held too obliquely: the hold differs from the level ratio by more than {MOST_TILTED:g} of "
    "it, so one bump has hardly any contact: hold the probe upright"
)
_STIFFENS = (
    "the object stiffens with depth: it is thin, layered, or stiffens by strain, so only an upper "
    "bound of its modulus is known"
)
_BELOW = 2.0  # a drawing begins at the smallest calibrated modulus divided by this
_ABOVE = 4.0  # and ends at the largest multiplied by this


def _outside(probe: Elasticity, ratio: float) -> str:
    """Return why no modulus corresponds to a ratio; "": one does."""
    if ratio < probe.soft_ratio:
        soft = number_format.number(probe.soft_ratio)
        return f"the ratio is below {soft}, the ratio of an infinitely soft object"
    if ratio >= probe.rigid_ratio:
        rigid = number_format.number(probe.rigid_ratio)
        return f"the ratio is not below {rigid}, the ratio of a rigid object"
    return ""


def _check_touches(touches: float) -> None:
    if not touches >= 1:
        raise ValueError(f"touches: got {touches}, allowed: 1 or more")


def _squares(parts: Variances, linearity: float) -> dict[str, float]:
    """Return the variances of a ratio by name."""
    return {
        "noise": float(parts.noise),
        "linearity": linearity**2,
        "scatter from touch to touch": float(parts.touch),
        "scatter of specimens": float(parts.specimen),
        "fitted curve": float(parts.curve),
    }


def _parts(squares: dict[str, float], ratio: float, slope: float) -> list[UncertaintyPart]:
    """Return the parts of a budget and their sum; `slope`: of log E against the ratio."""
    budget = []
    for name, square in [*squares.items(), ("together", sum(squares.values()))]:
        error = 100 * sqrt(square)
        budget.append(UncertaintyPart(name, error / ratio, error * slope))
    return budget


@dataclass(frozen=True, eq=False, repr=False)
class Calibration(StoredCalibration, Plotted):
    """The calibration curve of a probe, made by `fit` or `load`: converts a ratio to a modulus.

    Attributes
    ----------
    fitted : palpate.calibration.fit.CurveFit
        Parameters of the curve, their covariance, and the scatter.
    ratios, moduli, standard_errors, touches : numpy.ndarray, shape (n,)
        The fitted data; moduli in MPa; standard errors are 0 if none were given.
    modulus_uncertainties, common_uncertainties : numpy.ndarray, shape (n,)
        Relative standard uncertainties of the moduli, as in `fit`.
    about : palpate.calibration.calibration_file.About
        Origin of the data; saved with the calibration.
    version : str
        The version of palpate that fitted it.
    ratio : str
        Which ratio of a touch it converts: "hold", or "level", the one over the swept depth.
    contact_exponent, age_s : float
        The settings of the tracker for its touches; an age of 0: the whole touch.
    error_share : float, 0 to 1
        Share of the standard errors of level ratios that showed in the scatter within the
        specimens.
    exponent_fits : tuple of palpate.calibration.exponent_fits.ExponentFit
        A curve for each contact exponent; `is_possible` says whether the touches leave it open.
    ranges : palpate.calibration.ranges.Ranges
        Tilt, depth and rise of the touches that calibrated.
    verifications : tuple of palpate.calibration.assurance.CalibrationVerification
        Comparisons with specimens of known modulus since then.
    stiffening_share : float, 0 to 1
        Share of the touches with the flag "stiffens".

    Examples
    --------
    >>> import palpate
    >>> ratios = [1.98, 2.02, 2.97, 3.03, 3.95, 4.05, 4.94, 5.06]
    >>> moduli = [0.18, 0.18, 0.46, 0.46, 1.0, 1.0, 2.5, 2.5]  # MPa, of the touched specimens
    >>> calibration = palpate.Calibration.fit(ratios, moduli)
    >>> modulus = calibration.modulus(3.5, standard_error=0.01)
    >>> modulus.low < modulus.value < modulus.high, round(modulus.value, 2)
    (True, 0.69)
    """

    @classmethod
    def fit(
        cls,
        ratios: ArrayLike,
        moduli: ArrayLike,
        *,
        standard_errors: ArrayLike | None = None,
        touches: ArrayLike | None = None,
        modulus_uncertainties: ArrayLike | None = None,
        common_uncertainties: ArrayLike | None = None,
        soft_ratio: float | None = 1.0,
        about: About | None = None,
    ) -> "Calibration":
        """Fit a calibration curve, equation (2), to ratios on specimens of known modulus.

        The weights hold the standard errors, and the scatter from touch to touch and from specimen
        to specimen.

        Parameters
        ----------
        ratios : array_like, shape (n,)
            One ratio for each touch, or for each specimen.
        moduli : array_like, shape (n,), MPa
            Modulus of the specimen. Ratios with the same modulus belong to the same specimen.
        standard_errors : array_like, shape (n,), optional
            Standard errors of the ratios, 0 or more, as `Touch.standard_error`.
        touches : array_like, shape (n,) or (), optional
            Number of touches of which each ratio is the mean, 1 or more; default 1.
        modulus_uncertainties : array_like, shape (n,) or (), optional
            Relative standard uncertainty (k = 1) of the modulus of the specimen, 0 to below 1; the
            same for all ratios of a specimen. Default 0: the modulus is exact. The errors of
            different specimens are independent.
        common_uncertainties : array_like, shape (n,) or (), optional
            The same for an error that all specimens share, as that of the relation from which the
            moduli were computed; default 0. No number of specimens reduces it.
        soft_ratio : float or None
            Ratio on an infinitely soft object. None: fit it as a third parameter, for channels with
            different gains.
        about : palpate.calibration.calibration_file.About, optional
            Origin of the data; saved with the calibration.

        Returns
        -------
        Calibration

        Raises
        ------
        ValueError
            Arguments of different lengths, not finite, or not positive.
        CalibrationError
            Too few specimens, or the ratios do not follow equation (2).

        Examples
        --------
        >>> from palpate.elasticity import SORBOTHANE_MPA, Elasticity
        >>> moduli = list(SORBOTHANE_MPA.values())
        >>> four = [1.02, 0.99, 0.98, 1.01]  # four touches on each, at different angles
        >>> ratios = [factor * Elasticity().ratio(E) for E in moduli for factor in four]
        >>> found = Calibration.fit(ratios, [E for E in moduli for _ in four])
        >>> value, low, high = found.modulus(5.0)
        >>> low < value < high, round(value, 1)
        (True, 1.6)
        >>> print(found.modulus(9.9))
        stiffer than 34.5 MPa
        """
        data = fit_data(
            ratios,
            moduli,
            standard_errors,
            touches,
            modulus_uncertainties,
            common_uncertainties,
        )
        if soft_ratio is not None and not isfinite(soft_ratio):
            raise ValueError(
                f"soft_ratio: got {soft_ratio}, allowed: a finite number, or None to fit it"
            )
        known, first, specimen = np.unique(data.moduli, return_index=True, return_inverse=True)
        least = 3 if soft_ratio is not None else 4
        if len(known) < least:
            allowed = f"{least} or more, one more than the parameters"
            raise CalibrationError(f"moduli: got {len(known)} specimens, allowed: {allowed}")
        rows = MeanRatios(data.ratios, data.standard_errors, data.touches, specimen)
        errors = ModulusErrors(data.modulus_uncertainties[first], data.common_uncertainties[first])
        fitted = fit_curve(np.log(known), rows, soft_ratio, errors)
        return cls(
            fitted,
            *data,
            about=about or About(),
            version=__version__,
            exponent_fits=(ExponentFit(1.0, fitted),),
        )

    def __repr__(self) -> str:
        """Return the specimens, the range and the rigid ratio, in one line."""
        from palpate.display.text import calibration_line

        return calibration_line(self)

    def _repr_html_(self) -> str:
        from palpate.display.cards import calibration_card

        return calibration_card(self, lambda: curve_picture(self.curve()))

    def _draw(self, ax: Any) -> None:
        draw_calibration(ax, self.curve(400))

    def curve(self, points: int = 80) -> CalibrationCurve:
        """Return the numbers of a drawing: the curve with its band, and the data.

        Parameters
        ----------
        points : int
            Points of the curve, in even steps of the logarithm of the modulus, from half the
            smallest calibrated modulus to four times the largest.

        Returns
        -------
        palpate.calibration.plot.CalibrationCurve

        Examples
        --------
        >>> found = Calibration.fit([2.0, 3.0, 4.0, 5.0], [0.18, 0.46, 1.0, 2.5])
        >>> found.curve(3).modulus.round(2).tolist()
        [0.09, 0.95, 10.0]
        """
        low, high = self.range
        lowest = np.log(low / _BELOW)
        highest = np.log(high * _ABOVE)
        log_modulus = np.linspace(lowest, highest, points)
        return CalibrationCurve(
            log_modulus=log_modulus,
            ratio=curve(self.fitted.parameters, log_modulus),
            reach=allowance(self.fitted, MeasuredRatio(1.0), log_modulus),
            rigid_ratio=self.probe.rigid_ratio,
            rigid_error=float(self.fitted.covariance[0, 0]) ** 0.5,
            soft_ratio=self.probe.soft_ratio,
            moduli=self.moduli,
            ratios=self.ratios,
            specimens=self.residuals,
        )

    @property
    def touch_spread(self) -> float:
        """Relative standard deviation from touch to touch, without the standard errors."""
        return float(self.fitted.touch_variance**0.5)

    @property
    def touch_scatter(self) -> Scatter:
        """The same for an uncertainty: wider as an estimate; assumed with few touches."""
        found = Scatter.of(self.fitted.touch_variance, self._scatter_freedom, "calibration")
        by_level = self.ratio == "level" and found.source == "calibration"
        return found._replace(by_level=by_level)

    @property
    def _scatter_freedom(self) -> int:
        """Degrees of freedom of `touch_spread`."""
        return self.fitted.touch_freedom or self.fitted.specimen_freedom

    @property
    def scatter(self) -> str:
        """Scatter from touch to touch as text, and what else it holds."""
        percent = number_format.error(100 * self.touch_spread)
        if self.error_share < 1:
            share = number_format.error(self.error_share)
            return (
                f"scatter from touch to touch ({percent} %) and {share} of the standard errors of "
                "the level ratios, as much as they scattered"
            )
        if self.fitted.touch_freedom:
            return f"scatter from touch to touch ({percent} %)"
        return (
            f"scatter of touches and specimens together ({percent} %; the calibration has one "
            "value a specimen)"
        )

    @property
    def accepted(self) -> frozenset[str]:
        """Flags that do not exclude a touch: accepted for the fit; offset for level ratios."""
        accepted = frozenset(self.about.accepted_flags)
        if self.ratio == "level":
            return accepted | {"offset"}
        return accepted

    def for_tracking(self, tracking: Mapping[str, Any]) -> dict[str, Any]:
        """Return scene and settings of a tracker with the age and the exponent of this calibration.

        A setting that the scene does not have is not added.
        """
        known = {**Tracker(tracking.get("scene", "handheld")).settings, **tracking}
        needed = {"age": self.age_s}
        if self.ratio == "level":
            needed["contact_exponent"] = self.contact_exponent
        changed = dict(tracking)
        for name, value in needed.items():
            if known.get(name, value) != value:
                changed[name] = value
        return changed

    def refusal(self, touch: Touch) -> str:
        """Return why a touch has no modulus by this calibration; "": it has one."""
        by_level = self.ratio == "level"
        measured = {"age": touch.age_s}
        calibrated = {"age": self.age_s}
        if by_level:
            measured["contact_exponent"] = touch.contact_exponent
            calibrated["contact_exponent"] = self.contact_exponent
        if measured != calibrated:
            return other_settings(measured, calibrated)
        if is_too_oblique(touch):
            return _TOO_OBLIQUE
        if not (isfinite(touch.ratio) and touch.ratio > 0):
            return "no ratio"
        if by_level and not (isfinite(touch.level_ratio) and touch.level_ratio > 0):
            return (
                "no level ratio, as the press shows no sweep of the depth: press more slowly, "
                "and hold"
            )
        return ""

    def objections(self, touch: Touch) -> tuple[str, ...]:
        """Return why a touch does not count: flags, and `refusal`; empty if it does."""
        scatter = self.touch_scatter.share
        if self.ratio == "level":
            scatter = max(scatter, LEVEL_SCATTER)
        against = [*objections(touch, self.accepted, scatter=scatter), self.refusal(touch)]
        return tuple(filter(None, against))

    def ratio_of(self, touch: Touch) -> tuple[float, float]:
        """Return the ratio of a touch that this calibration converts, and its standard error.

        The standard error contains what differs from the touches that calibrated, and the exponents
        of the contact that are left open. Both are nan if the touch has none: measured with another exponent or age, or without a
        level ratio; see `refusal`. An unknown standard error is nan.

        Examples
        --------
        >>> import palpate
        >>> touch = palpate.touches(palpate.read("tests/data/four-specimens.csv"))[1]
        >>> found = Calibration.fit([2.0, 3.0, 4.0, 5.0], [0.18, 0.46, 1.0, 2.5])
        >>> found.ratio_of(touch)[0] == touch.ratio
        True
        """
        if self.refusal(touch):
            return nan, nan
        ratio = touch.level_ratio if self.ratio == "level" else touch.ratio
        error = touch.level_standard_error if self.ratio == "level" else touch.standard_error
        [evidence] = self._evidence([touch])
        exponents = self._exponents
        number = exponents.index(self.contact_exponent) if self.ratio == "level" else 0
        differences = differences_of(
            evidence,
            number,
            exponents[number],
            self.ranges,
            kind=self.ratio,
            depth_slope_error=self.exponent_fits[number].depth_slope_error,
        )
        possible = [fit.is_possible for fit in self.exponent_fits]
        of_exponents = float(np.sqrt(np.mean(evidence.derived[possible] ** 2)))
        further = ratio * hypot(*differences, of_exponents)
        return ratio, hypot(self.error_share * error, further)

    def modulus_of(self, touch: Touch) -> Modulus:
        """Return the modulus of an object from a touch.

        Its interval is the union of those for all exponents of the contact that the calibration
        leaves open. It is wider for a touch that differs from those that calibrated; `differences`
        says how.
        """
        refused = self.refusal(touch)
        if refused:
            return Modulus(nan, nan, nan, refused)
        return self.mean_modulus([touch])

    def mean_modulus(self, touches: Sequence[Touch], *, level: float = 0.95) -> Modulus:
        """Return the modulus of an object from the mean of several touches on it.

        Parameters
        ----------
        touches : sequence of Touch
            One or more. Those without a ratio for this calibration do not count.
        level : float, in (0, 1)
            As in `modulus`.

        Returns
        -------
        Modulus

        Raises
        ------
        ValueError
            No touch has a ratio for this calibration, or the level is out of its range.
        """
        check_level(level)
        counted = self._counted(touches)
        ratios = self._ratios_at(counted)
        value_x, low_x, high_x = union(ratios, level)
        low = modulus_at(low_x)
        high = modulus_at(high_x)
        if 2 * sum(Flag.STIFFENS in touch.flags for touch in counted) >= len(counted):
            return Modulus(nan, 0.0, high, _STIFFENS, extrapolated=True)
        if isnan(value_x):
            reason = self._reason_outside(ratios, low)
            return Modulus(nan, low, high, reason, extrapolated=True)
        value = modulus_at(value_x)
        softest, stiffest = self.range
        return Modulus(value, low, high, extrapolated=not softest <= value <= stiffest)

    def _counted(self, touches: Sequence[Touch]) -> list[Touch]:
        """Return the touches that have a ratio for this calibration."""
        counted = [touch for touch in touches if not self.refusal(touch)]
        if not counted:
            raise ValueError(
                f"touches: got {len(touches)} without a ratio for this calibration, allowed: at "
                "least one with it; Calibration.refusal says why not"
            )
        return counted

    def _evidence(self, touches: Sequence[Touch]) -> list[TouchEvidence]:
        return evidence_of_all(touches, self.ratio, np.array(self._exponents))

    @property
    def _exponents(self) -> list[float]:
        """Exponents of the contact of `exponent_fits`."""
        return [fit.contact_exponent for fit in self.exponent_fits]

    def _ratios_at(self, touches: Sequence[Touch]) -> list[RatioAtExponent]:
        """Return the mean ratio of touches for each possible exponent."""
        evidence = self._evidence(touches)
        ratios = []
        for number, fit in enumerate(self.exponent_fits):
            if fit.is_possible:
                ratios.append(self._ratio_at(evidence, number))
        return ratios

    def _ratio_at(self, evidence: Sequence[TouchEvidence], number: int) -> RatioAtExponent:
        """Return the mean ratio of touches at the exponent with this number."""
        return ratio_at(
            evidence,
            self.exponent_fits[number],
            number,
            self.ranges,
            kind=self.ratio,
            error_share=self.error_share,
        )

    def _reason_outside(self, ratios: Sequence[RatioAtExponent], low: float) -> str:
        """Return why the mean of touches has no modulus."""
        for one in ratios:
            rigid, log_half, soft = one.fit.fitted.parameters.tolist()
            reason = _outside(Elasticity(rigid, exp(log_half), soft), one.ratio)
            if reason:
                break
        if isnan(low):
            reason += "; the difference is larger than the uncertainty"
        return reason

    def differences(self, touch: Touch) -> list[str]:
        """Return sentences about how a touch differs from those that calibrated; empty: it does not.

        Its interval is wider for it.
        """
        if self.refusal(touch):
            return []
        [evidence] = self._evidence([touch])
        return self.ranges.differences(evidence)

    def learned(self, groups: Iterable[Sequence[Touch]]) -> "Calibration":
        """Return the calibration with what repeated touches show of the contact exponent.

        Touches of the hand that measures, held at different angles, scatter least at the right
        exponent. This narrows the range that the calibration leaves open, and with it the
        intervals of oblique touches.

        Parameters
        ----------
        groups : iterable of sequence of Touch
            Touches on one object each, of any modulus.

        Returns
        -------
        Calibration
        """
        if len(self.exponent_fits) < 2:
            return self
        evidence = []
        for touches in groups:
            counted = [touch for touch in touches if not self.objections(touch)]
            if len(counted) > 1:
                evidence.append(self._evidence(counted))
        if not evidence:
            return self
        fits = weighted(self.exponent_fits, scatter_evidence(evidence, self.error_share))
        return replace(self, exponent_fits=fits)

    @property
    def possible_exponents(self) -> tuple[float, float]:
        """Smallest and largest exponent of the contact that the touches leave open."""
        possible = [fit.contact_exponent for fit in self.exponent_fits if fit.is_possible]
        return min(possible), max(possible)

    def verify(
        self,
        touches: Sequence[Touch],
        modulus: float,
        modulus_uncertainty: float = 0.0,
        *,
        specimen: str = "",
        date: str = "",
    ) -> CalibrationVerification:
        """Return whether touches on a specimen of known modulus agree with this calibration.

        Parameters
        ----------
        touches : sequence of Touch
            On the specimen. Those that do not count are left out; see `objections`.
        modulus : float, MPa
            Of the specimen.
        modulus_uncertainty : float
            Its relative standard uncertainty, 0 or more.
        specimen, date : str
            For the sentence and the file.

        Returns
        -------
        CalibrationVerification

        Raises
        ------
        ValueError
            No touch counts, or a value is out of its range.
        """
        if not 0 < modulus < inf:
            raise ValueError(f"modulus: got {modulus}, allowed: a positive number, MPa")
        if not 0 <= modulus_uncertainty < inf:
            raise ValueError(
                f"modulus_uncertainty: got {modulus_uncertainty}, allowed: 0 or more, relative"
            )
        counted = [touch for touch in touches if not self.objections(touch)]
        if not counted:
            raise ValueError(f"touches: got {len(touches)}, none counts, allowed: at least one")
        probability = 0.0
        noticed = 0.0
        for one in self._ratios_at(counted):
            measured = one.measured(0.95)
            found = compare(one.fit.fitted, measured, log(modulus), modulus_uncertainty)
            probability = max(probability, found.probability)
            noticed = max(noticed, found.noticed)
        return CalibrationVerification(
            specimen,
            date,
            modulus,
            modulus_uncertainty,
            self.mean_modulus(counted),
            len(counted),
            probability,
            noticed,
        )

    def modulus(
        self,
        ratio: float,
        standard_error: float | None = None,
        *,
        touches: float = 1,
        level: float = 0.95,
    ) -> Modulus:
        """Return the modulus of an object from its ratio, with an interval.

        The interval includes the error of the fitted curve, the scatter from touch to touch and the
        standard error, inverted through the curve: it is not symmetric, and near the rigid ratio it
        has no upper end.

        Parameters
        ----------
        ratio : float
            Ratio of a touch, or the mean of several.
        standard_error : float, optional
            Standard error of the ratio, 0 or more; default 0.
        touches : float
            Number of touches of which the ratio is the mean, 1 or more.
        level : float, in (0, 1)
            Probability that the interval contains the modulus. In "stiffer than low" the bound is
            the lower end of the same interval: the modulus is above it with probability (1 + level)
            / 2.

        Returns
        -------
        Modulus

        Raises
        ------
        ValueError
            An argument is out of its range.

        Examples
        --------
        >>> found = Calibration.fit([2.0, 3.0, 4.0, 5.0], [0.18, 0.46, 1.0, 2.5])
        >>> found.modulus(3.5, 0.01).extrapolated
        False
        """
        error = 0.0 if standard_error is None else standard_error
        if not isfinite(ratio):
            raise ValueError(f"ratio: got {ratio}, allowed: a finite number")
        if not 0 <= error < inf:
            raise ValueError(f"standard_error: got {standard_error}, allowed: 0 or more, or None")
        _check_touches(touches)
        check_level(level)
        low_x, high_x = bounds(self.fitted, MeasuredRatio(ratio, error, touches, level))
        low = modulus_at(low_x)
        high = modulus_at(high_x)
        reason = _outside(self.probe, ratio)
        if reason:
            if isnan(low):
                reason += "; the difference is larger than the uncertainty"
            return Modulus(nan, low, high, reason, extrapolated=True)
        value = self.probe.modulus(ratio)
        softest, stiffest = self.range
        return Modulus(value, low, high, extrapolated=not softest <= value <= stiffest)

    def budget(
        self,
        ratio: float,
        standard_error: float | None = None,
        *,
        touches: float = 1,
        linearity: float = 0.0,
    ) -> list[UncertaintyPart]:
        """Return the parts of the uncertainty of a modulus.

        Parameters
        ----------
        ratio, standard_error, touches
            As in `modulus`.
        linearity : float
            Standard deviation of the ratio by the linearity of the converter,
            `Uncertainty.linearity`; default 0. The interval of `modulus` has it in the scatter: the
            touches of the fit were measured with it.

        Returns
        -------
        list of UncertaintyPart
            "noise", "linearity", "scatter from touch to touch", "scatter of specimens", "fitted
            curve", and "together", the root of their sum of squares.

        Raises
        ------
        ValueError
            No modulus corresponds to the ratio, or `touches` is below 1.

        Examples
        --------
        >>> found = Calibration.fit([2.0, 3.0, 4.0, 5.0], [0.18, 0.46, 1.0, 2.5])
        >>> max(found.budget(3.5, 0.01)[:-1], key=lambda part: part.of_modulus).name
        'scatter from touch to touch'
        """
        _check_touches(touches)
        modulus = self.probe.modulus(ratio)
        measured = MeasuredRatio(ratio, standard_error or 0.0, touches)
        parts = variances(self.fitted, measured, np.array(log(modulus)))
        return _parts(_squares(parts, linearity), ratio, self.probe.slope(ratio) / modulus)

    def budget_of(
        self, touches: Sequence[Touch], *, linearity: float = 0.0
    ) -> list[UncertaintyPart]:
        """Return the parts of the uncertainty of a modulus from the mean of touches.

        Parameters
        ----------
        touches : sequence of Touch
            On one object. Those without a ratio for this calibration do not count.
        linearity : float
            As in `budget`.

        Returns
        -------
        list of UncertaintyPart
            Those of `budget`; before "together" two more: "difference from the calibration", by
            tilt, depth and speed of the press, and "open contact exponent", by the exponents that
            the calibration leaves open.

        Raises
        ------
        ValueError
            No modulus corresponds to the ratio, or no touch counts.
        """
        ratios = self._ratios_at(self._counted(touches))
        by_weight = sorted(
            ratios, key=lambda one: one.fit.contact_exponent != self.contact_exponent
        )
        likeliest = max(by_weight, key=lambda one: one.fit.log_weight)
        rigid, log_half, soft = likeliest.fit.fitted.parameters.tolist()
        probe = Elasticity(rigid, exp(log_half), soft)
        ratio = likeliest.ratio
        modulus = probe.modulus(ratio)
        measured = MeasuredRatio(ratio, ratio * likeliest.noise, likeliest.touches)
        parts = variances(likeliest.fit.fitted, measured, np.array(log(modulus)))
        squares = _squares(parts, linearity)
        squares["difference from the calibration"] = (ratio * hypot(*likeliest.differences)) ** 2
        squares["open contact exponent"] = (ratio * spread_of(ratios)) ** 2
        return _parts(squares, ratio, probe.slope(ratio) / modulus)

    def agreement(self, touches: Sequence[Touch]) -> Agreement:
        """Return whether touches agree, and their mean, with the scatter of this calibration.

        Raises
        ------
        ValueError
            No usable touch.
        """
        return agreement(
            touches,
            scatter=self.touch_spread,
            freedom=self._scatter_freedom,
            accept=self.accepted,
            ratio_of=self.ratio_of,
        )
