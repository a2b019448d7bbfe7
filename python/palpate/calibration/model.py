"""The calibration of a probe: fitted to specimens, it converts a ratio to a modulus."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import exp, inf, isfinite, isnan, log, nan, sqrt
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from palpate import number_format
from palpate._core import Tracker, __version__
from palpate.calibration import calibration_file
from palpate.calibration.assessment import Assessment, Residual, assess, residuals
from palpate.calibration.calibration_file import About
from palpate.calibration.fit import Array, CurveFit, MeanRatios, curve, fit_curve, fit_data
from palpate.calibration.interval import MeasuredRatio, allowance, bounds, variances
from palpate.calibration.modulus import Modulus, ParameterRow, UncertaintyPart, parameter_row
from palpate.calibration.plot import CalibrationCurve, curve_picture, draw_calibration
from palpate.calibration.validity import Refusal, refusal
from palpate.elasticity import Elasticity
from palpate.errors import CalibrationError, need
from palpate.repeatability import Agreement, Objection, agreement, objections
from palpate.touch import Touch
from palpate.uncertainty import Scatter

_LARGEST = 690.0  # exp of it is still finite
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


def _modulus_at(x: float) -> float:
    """Return the modulus at x = log(E / MPa); inf if a float cannot hold it."""
    return inf if x >= _LARGEST else exp(x)


def _check_touches(touches: float) -> None:
    if not touches >= 1:
        raise ValueError(f"touches: got {touches}, allowed: 1 or more")


def check_level(level: float) -> None:
    """Refuse a probability that is not between 0 and 1."""
    if not 0 < level < 1:
        raise ValueError(f"level: got {level}, allowed: 0 < level < 1")


@dataclass(frozen=True, eq=False, repr=False)
class Calibration:
    """The calibration curve of a probe, made by `fit` or `load`: converts a ratio to a modulus.

    Attributes
    ----------
    fitted : palpate.calibration.fit.CurveFit
        Parameters of the curve, their covariance, and the scatter.
    ratios, moduli, standard_errors, touches : numpy.ndarray, shape (n,)
        The fitted data; moduli in MPa; standard errors are 0 if none were given.
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
    """

    fitted: CurveFit
    ratios: Array
    moduli: Array
    standard_errors: Array
    touches: Array
    about: About = field(default_factory=About)
    version: str = ""
    ratio: str = "hold"
    contact_exponent: float = 1.0
    age_s: float = 0.0
    error_share: float = 1.0

    @classmethod
    def fit(
        cls,
        ratios: ArrayLike,
        moduli: ArrayLike,
        *,
        standard_errors: ArrayLike | None = None,
        touches: ArrayLike | None = None,
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
            Modulus of the specimen, taken as exact. Ratios with the same modulus belong to the same
            specimen.
        standard_errors : array_like, shape (n,), optional
            Standard errors of the ratios, 0 or more, as `Touch.standard_error`.
        touches : array_like, shape (n,) or (), optional
            Number of touches of which each ratio is the mean, 1 or more; default 1.
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
        data = fit_data(ratios, moduli, standard_errors, touches)
        if soft_ratio is not None and not isfinite(soft_ratio):
            raise ValueError(
                f"soft_ratio: got {soft_ratio}, allowed: a finite number, or None to fit it"
            )
        known, specimen = np.unique(data.moduli, return_inverse=True)
        least = 3 if soft_ratio is not None else 4
        if len(known) < least:
            allowed = f"{least} or more, one more than the parameters"
            raise CalibrationError(f"moduli: got {len(known)} specimens, allowed: {allowed}")
        rows = MeanRatios(data.ratios, data.standard_errors, data.touches, specimen)
        fitted = fit_curve(np.log(known), rows, soft_ratio)
        return cls(fitted, *data, about=about or About(), version=__version__)

    def __repr__(self) -> str:
        """Return the specimens, the range and the rigid ratio, in one line."""
        from palpate.display.text import calibration_line

        return calibration_line(self)

    def _repr_html_(self) -> str:
        from palpate.display.cards import calibration_card

        return calibration_card(self, lambda: curve_picture(self.curve()))

    def plot(self, ax: Any = None) -> Any:
        """Draw the curve, the band for a touch, and the measured ratios over the modulus.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Default: new axes of pyplot.

        Returns
        -------
        matplotlib Axes

        Raises
        ------
        MissingExtra
            matplotlib is missing; type: pip install 'palpate[science]'.
        """
        return draw_calibration(ax, self.curve(400))

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
        log_modulus = np.linspace(np.log(low / _BELOW), np.log(high * _ABOVE), points)
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
    def probe(self) -> Elasticity:
        """Equation (2) with the fitted parameters."""
        rigid, log_half, soft = (float(value) for value in self.fitted.parameters)
        return Elasticity(rigid, exp(log_half), soft)

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
            return f"{share} of the standard errors of the level ratios, as much as they scattered"
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
        return accepted | {"offset"} if self.ratio == "level" else accepted

    def for_tracking(self, tracking: Mapping[str, Any]) -> dict[str, Any]:
        """Return scene and settings of a tracker with the age and the exponent of this calibration.

        A setting that the scene does not have is not added.
        """
        known = {**Tracker(tracking.get("scene", "handheld")).settings, **tracking}
        changed = dict(tracking)
        if known.get("age", self.age_s) != self.age_s:
            changed["age"] = self.age_s
        exponent = self.contact_exponent
        if self.ratio == "level" and known.get("contact_exponent", exponent) != exponent:
            changed["contact_exponent"] = exponent
        return changed

    def refusal(self, touch: Touch) -> Refusal | None:
        """Return why a touch has no modulus by this calibration; None: it has one."""
        exponent = self.contact_exponent if self.ratio == "level" else None
        return refusal(touch, exponent, self.age_s)

    def objections(self, touch: Touch) -> tuple[Objection | Refusal, ...]:
        """Return why a touch does not count: flags, and `refusal`; empty if it does."""
        against = objections(touch, self.accepted)
        refused = self.refusal(touch)
        return (*against, refused) if refused else against

    def ratio_of(self, touch: Touch) -> tuple[float, float]:
        """Return the ratio of a touch that this calibration converts, and its standard error.

        Both are nan if the touch has none: measured with another exponent or age, or without a
        level ratio; see `refusal`. An unknown standard error is nan.

        Examples
        --------
        >>> import palpate
        >>> touch = palpate.touches(palpate.read("tests/data/four-specimens.csv"))[1]
        >>> found = Calibration.fit([2.0, 3.0, 4.0, 5.0], [0.18, 0.46, 1.0, 2.5])
        >>> found.ratio_of(touch) == (touch.ratio, touch.standard_error)
        True
        """
        if self.refusal(touch):
            return nan, nan
        if self.ratio == "level":
            return touch.level_ratio, self.error_share * touch.level_standard_error
        return touch.ratio, touch.standard_error

    def modulus_of(self, touch: Touch) -> Modulus:
        """Return the modulus of an object from a touch: `modulus` of its `ratio_of`."""
        refused = self.refusal(touch)
        if refused:
            return Modulus(nan, nan, nan, str(refused))
        ratio, error = self.ratio_of(touch)
        return self.modulus(ratio, error if isfinite(error) else None)

    @property
    def range(self) -> tuple[float, float]:
        """Smallest and largest calibrated modulus, MPa."""
        return float(self.moduli.min()), float(self.moduli.max())

    @property
    def residuals(self) -> list[Residual]:
        """Distance of each specimen from the curve, in order of modulus."""
        return residuals(self.fitted, self.ratios, self.moduli, self.standard_errors, self.touches)

    @property
    def assessment(self) -> Assessment:
        """What speaks against the fit; prints as the verdict."""
        return assess(self.fitted, self.residuals, len(self.ratios))

    @property
    def verdict(self) -> str:
        """Assessment of the fit, as text."""
        return str(self.assessment)

    @property
    def sound(self) -> bool:
        """Whether the fit has no objection."""
        return not self.assessment.objections

    def parameter_intervals(self, level: float = 0.95) -> dict[str, tuple[float, float]]:
        """Return the interval of each parameter: rigid_ratio, half_modulus (MPa), soft_ratio."""
        check_level(level)
        quantile = need("scipy.special", "science").stdtrit
        t = float(quantile(self.fitted.specimen_freedom, 0.5 + level / 2))
        reach = t * np.sqrt(np.diag(self.fitted.covariance))
        low = (self.fitted.parameters - reach).tolist()
        high = (self.fitted.parameters + reach).tolist()
        return {
            "rigid_ratio": (low[0], high[0]),
            "half_modulus": (exp(low[1]), exp(high[1])),
            "soft_ratio": (low[2], high[2]),
        }

    def parameter_rows(self) -> list[ParameterRow]:
        """Return name, value and 95 % interval of each parameter as text."""
        ends = self.parameter_intervals()
        probe = self.probe
        return [
            parameter_row("rigid_ratio", "", probe.rigid_ratio, ends["rigid_ratio"]),
            parameter_row("half_modulus", " MPa", probe.half_modulus, ends["half_modulus"]),
            parameter_row("soft_ratio", "", probe.soft_ratio, ends["soft_ratio"]),
        ]

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
        low = _modulus_at(low_x)
        high = _modulus_at(high_x)
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
        squares = {
            "noise": parts.noise,
            "linearity": linearity**2,
            "scatter from touch to touch": float(parts.touch),
            "scatter of specimens": float(parts.specimen),
            "fitted curve": float(parts.curve),
        }
        squares["together"] = sum(squares.values())
        errors = {name: 100 * sqrt(square) for name, square in squares.items()}
        slope = self.probe.slope(ratio) / modulus
        return [
            UncertaintyPart(name, error / ratio, error * slope) for name, error in errors.items()
        ]

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

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the calibration as TOML, with units, versions and the fitted data."""
        calibration_file.write_document(Path(path), self.as_dict())

    def as_dict(self) -> calibration_file.Table:
        """Return the contents of the file that `save` writes, as plain numbers and text."""
        fitted = self.fitted
        return {
            "schema": calibration_file.SCHEMA,
            "palpate": self.version,
            "about": self.about.entries(),
            "units": calibration_file.UNITS,
            "fit": {
                "rigid_ratio": self.probe.rigid_ratio,
                "half_modulus_MPa": self.probe.half_modulus,
                "soft_ratio": self.probe.soft_ratio,
                "calibrated_MPa": list(self.range),
                "verdict": self.verdict,
                "parameters": fitted.parameters.tolist(),
                "covariance": fitted.covariance.tolist(),
                "covariance_of": calibration_file.PARAMETERS,
            },
            "touch": {
                "ratio": self.ratio,
                "contact_exponent": self.contact_exponent,
                "age_s": self.age_s,
                "error_share": self.error_share,
            },
            "scatter": {
                "touch_variance": fitted.touch_variance,
                "touch_freedom": fitted.touch_freedom,
                "specimen_variance": fitted.specimen_variance,
                "specimen_freedom": fitted.specimen_freedom,
                "specimen_share": fitted.specimen_share,
                "misfit": fitted.misfit,
            },
            "data": {
                "moduli_MPa": self.moduli.tolist(),
                "ratios": self.ratios.tolist(),
                "standard_errors": self.standard_errors.tolist(),
                "touches": self.touches.tolist(),
            },
        }

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> "Calibration":
        """Return the calibration from a file that `save` wrote.

        Raises
        ------
        CalibrationError
            The file is not a calibration.
        """
        return cls(**calibration_file.read_fields(Path(path)))
