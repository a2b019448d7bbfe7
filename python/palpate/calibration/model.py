"""The calibration curve of a probe, fitted to specimens of known modulus; gives a modulus with an interval."""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import exp, inf, isfinite, isnan, log, nan, sqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from palpate import number_format
from palpate._core import Tracker, __version__
from palpate.calibration import calibration_file, verdict
from palpate.calibration.fit import (
    Array,
    CurveFit,
    MeanRatios,
    MeasuredRatio,
    allowance,
    bounds,
    curve,
    fit_curve,
    variances,
)
from palpate.calibration.validity import Refusal, refusal
from palpate.elasticity import Elasticity
from palpate.errors import CalibrationError, need
from palpate.repeatability import Agreement, Objection, agreement, objections
from palpate.touch import Touch
from palpate.uncertainty import Scatter

_LARGEST = 690.0  # exp of it is still finite
_LEAST = {"standard_errors": (0.0, "0 or more"), "touches": (1.0, "1 or more")}


@dataclass(frozen=True)
class Modulus:
    """Modulus of an object with its interval; unpacks as value, low, high.

    Attributes
    ----------
    value : float, MPa
        By eq. (2); nan if the ratio is outside the range of the curve.
    low, high : float, MPa
        Ends of the interval. high is inf if all stiffer moduli agree with the ratio, low is 0 if all softer ones do;
        both are nan if no modulus agrees, or there is no ratio.
    reason : str
        Why value is nan; else empty.
    extrapolated : bool
        Whether the value is unknown or outside the calibrated moduli.

    Examples
    --------
    >>> value, low, high = Modulus(1.1, 1.0, 1.3)
    >>> print(Modulus(value, low, high))
    1.10 MPa (1.00 to 1.30)
    """

    value: float
    low: float
    high: float
    reason: str = ""
    extrapolated: bool = False

    def __iter__(self) -> Iterator[float]:
        """Iterate over value, low, high."""
        return iter((self.value, self.low, self.high))

    def as_dict(self) -> dict[str, float | str | bool | None]:
        """Return all fields (moduli in MPa) and the text; nan and inf as None."""
        numbers = {"value_MPa": self.value, "low_MPa": self.low, "high_MPa": self.high}
        return {
            **number_format.plain(numbers),
            "text": str(self),
            "reason": self.reason,
            "extrapolated": self.extrapolated,
        }

    def __str__(self) -> str:
        """Return the modulus as text: a value with its interval, or a bound."""
        if self.high == inf and self.low > 0:
            return f"stiffer than {number_format.number(self.low)} MPa"
        if self.low == 0 and self.high < inf:
            return f"softer than {number_format.number(self.high)} MPa"
        if not self.low > 0:
            return "no modulus" if self.low != 0 else "every modulus agrees with this ratio"
        if not isfinite(self.value):
            _, low, high = number_format.between((self.low + self.high) / 2, self.low, self.high)
            return f"{low} to {high} MPa"
        value, low, high = number_format.between(self.value, self.low, self.high)
        return f"{value} MPa ({low} to {high})"


class UncertaintyPart(NamedTuple):
    """A part of the uncertainty of a modulus.

    Attributes
    ----------
    name : str
    of_ratio, of_modulus : float, %
        One standard deviation, in % of the ratio, and of the modulus that follows from it.

    Examples
    --------
    >>> UncertaintyPart("noise", 0.01, 0.02).of_modulus
    0.02
    """

    name: str
    of_ratio: float
    of_modulus: float


def _outside(probe: Elasticity, ratio: float) -> str:
    """Return why no modulus corresponds to a ratio; "": one does."""
    if ratio < probe.soft_ratio:
        return f"the ratio is below {number_format.number(probe.soft_ratio)}, the ratio of an infinitely soft object"
    if ratio >= probe.rigid_ratio:
        return f"the ratio is not below {number_format.number(probe.rigid_ratio)}, the ratio of a rigid object"
    return ""


def _check_touches(touches: float) -> None:
    if not touches >= 1:
        raise ValueError(f"touches: got {touches}, allowed: 1 or more")


def check_level(level: float) -> None:
    """Refuse a probability that is not between 0 and 1."""
    if not 0 < level < 1:
        raise ValueError(f"level: got {level}, allowed: 0 < level < 1")


def checked_data(
    ratios: ArrayLike,
    moduli: ArrayLike,
    standard_errors: ArrayLike | None,
    touches: ArrayLike | None,
) -> dict[str, Array]:
    """Return the data of a fit as arrays of one length, by name; refuse what cannot be fitted."""
    shape = np.shape(ratios)
    count = np.asarray(1.0 if touches is None else touches, dtype=float)
    given = {
        "ratios": ratios,
        "moduli": moduli,
        "standard_errors": np.zeros(shape) if standard_errors is None else standard_errors,
        "touches": np.broadcast_to(count, shape) if count.ndim == 0 else count,
    }
    data = {name: np.array(values, dtype=float) for name, values in given.items()}
    for name, values in data.items():
        if values.ndim != 1 or values.shape != shape:
            raise ValueError(f"{name}: got shape {values.shape}, allowed: (n,), the same for all")
        least, allowed = _LEAST.get(name, (np.nextafter(0.0, 1.0), "positive numbers"))
        wrong = ~(np.isfinite(values) & (values >= least))
        if wrong.any():
            raise ValueError(f"{name}: got {values[wrong][0]}, allowed: {allowed}")
    return data


@dataclass(frozen=True, eq=False, repr=False)
class Calibration:
    """The calibration curve of a probe: converts a ratio to a modulus with an interval. Made by `fit` or `load`.

    Attributes
    ----------
    fitted : palpate.calibration.fit.CurveFit
        Parameters of the curve, their covariance, and the scatter.
    ratios, moduli, standard_errors, touches : numpy.ndarray, shape (n,)
        The fitted data; moduli in MPa; standard errors are 0 if none were given.
    about : dict of str
        Origin of the data; saved with the calibration.
    version : str
        The version of palpate that fitted it.
    ratio : str
        Which ratio of a touch it converts: "hold", or "level", the one over the swept depth.
    contact_exponent, age_s : float
        The settings of the tracker for its touches; an age of 0: the whole touch.
    error_share : float, 0 to 1
        Share of the standard errors of level ratios that showed in the scatter within the specimens.
    """

    fitted: CurveFit
    ratios: Array
    moduli: Array
    standard_errors: Array
    touches: Array
    about: Mapping[str, str] = field(default_factory=dict)
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
        about: Mapping[str, str] | None = None,
    ) -> "Calibration":
        """CurveFit a calibration curve, equation (2), to ratios on specimens of known modulus.

        The weights hold the standard errors, and the scatter from touch to touch and from specimen to specimen.

        Parameters
        ----------
        ratios : array_like, shape (n,)
            One ratio for each touch, or for each specimen.
        moduli : array_like, shape (n,), MPa
            Modulus of the specimen, taken as exact. Ratios with the same modulus belong to the same specimen.
        standard_errors : array_like, shape (n,), optional
            Standard errors of the ratios, 0 or more, as `Touch.standard_error`.
        touches : array_like, shape (n,) or (), optional
            Number of touches of which each ratio is the mean, 1 or more; default 1.
        soft_ratio : float or None
            Ratio on an infinitely soft object. None: fit it as a third parameter, for channels with different gains.
        about : mapping of str, optional
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
        data: dict[str, Any] = dict(checked_data(ratios, moduli, standard_errors, touches))
        if soft_ratio is not None and not isfinite(soft_ratio):
            raise ValueError(
                f"soft_ratio: got {soft_ratio}, allowed: a finite number, or None to fit it"
            )
        known, specimen = np.unique(data["moduli"], return_inverse=True)
        least = 3 if soft_ratio is not None else 4
        if len(known) < least:
            allowed = f"{least} or more, one more than the parameters"
            raise CalibrationError(f"moduli: got {len(known)} specimens, allowed: {allowed}")
        rows = MeanRatios(data["ratios"], data["standard_errors"], data["touches"], specimen)
        return cls(
            fit_curve(np.log(known), rows, soft_ratio),
            **data,
            about=dict(about or {}),
            version=__version__,
        )

    def __repr__(self) -> str:
        """Return the specimens, the range and the rigid ratio, in one line."""
        from palpate.display.text import calibration_line

        return calibration_line(self)

    def _repr_html_(self) -> str:
        from palpate.calibration import plot
        from palpate.display.cards import calibration_card

        return calibration_card(self, plot.curve_picture)

    def plot(self, ax: Any = None) -> Any:
        """Draw the curve, the band for a touch, and the measured ratios, over a logarithmic axis of moduli.

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
        from palpate.calibration import plot

        return plot.draw_calibration(ax, self)

    @property
    def probe(self) -> Elasticity:
        """Equation (2) with the fitted parameters."""
        rigid, log_half, soft = (float(value) for value in self.fitted.parameters)
        return Elasticity(rigid, exp(log_half), soft)

    @property
    def touch_spread(self) -> float:
        """Relative standard deviation of the ratio from touch to touch, without the part of the standard errors."""
        return float(self.fitted.touch_variance**0.5)

    @property
    def touch_scatter(self) -> Scatter:
        """The same as a part of an uncertainty: wider, as it was estimated; the assumed one with too few touches."""
        fitted = self.fitted
        found = Scatter.of(
            fitted.touch_variance, fitted.touch_freedom or fitted.specimen_freedom, "calibration"
        )
        return found._replace(by_level=self.ratio == "level" and found.source == "calibration")

    @property
    def scatter(self) -> str:
        """Scatter from touch to touch as text, and what else it holds."""
        percent = number_format.error(100 * self.touch_spread)
        if self.error_share < 1:
            return f"{number_format.error(self.error_share)} of the standard errors of the level ratios, as much as they scattered"
        if self.fitted.touch_freedom:
            return f"scatter from touch to touch ({percent} %)"
        return f"scatter of touches and specimens together ({percent} %; the calibration has one value a specimen)"

    @property
    def accepted(self) -> frozenset[str]:
        """Flags of touches that do not exclude them: those accepted for the fit; a level ratio has no offset."""
        return frozenset(
            [*self.about.get("accepted flags", "").split(), *["offset"] * (self.ratio == "level")]
        )

    def for_tracking(self, tracking: Mapping[str, Any]) -> dict[str, Any]:
        """Return scene and settings of a tracker with the age and exponent of this calibration, where the scene has them."""
        wanted = {"age": self.age_s} | (
            {"contact_exponent": self.contact_exponent} if self.ratio == "level" else {}
        )
        known: Mapping[str, Any] = {
            **Tracker(tracking.get("scene", "handheld")).settings,
            **tracking,
        }
        return {
            **tracking,
            **{name: value for name, value in wanted.items() if known.get(name, value) != value},
        }

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
        """Return the ratio of a touch that this calibration converts, and its standard error (nan: not known).

        Both are nan if it has none: measured with another exponent or age, or without a level ratio; see `refusal`.

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
        """Return the modulus of an object from a touch, as `modulus` of its `ratio_of`; without one the reason says why."""
        ratio, error = self.ratio_of(touch)
        refused = self.refusal(touch)
        if refused:
            return Modulus(nan, nan, nan, str(refused))
        return self.modulus(ratio, error if isfinite(error) else None)

    @property
    def range(self) -> tuple[float, float]:
        """Smallest and largest calibrated modulus, MPa."""
        return float(self.moduli.min()), float(self.moduli.max())

    @property
    def residuals(self) -> list[verdict.Residual]:
        """Distance of each specimen from the curve, in order of modulus."""
        return verdict.residuals(
            self.fitted, self.ratios, self.moduli, self.standard_errors, self.touches
        )

    @property
    def verdict(self) -> str:
        """Assessment of the fit, as text."""
        return verdict.verdict(self.fitted, self.residuals, len(self.ratios))

    @property
    def sound(self) -> bool:
        """Whether the fit has no objection."""
        return not verdict.objections_to_fit(self.fitted, self.residuals)

    def parameter_intervals(self, level: float = 0.95) -> dict[str, tuple[float, float]]:
        """Return the confidence interval of each parameter: rigid_ratio, half_modulus (MPa), soft_ratio."""
        check_level(level)
        t = float(
            need("scipy.special", "science").stdtrit(self.fitted.specimen_freedom, 0.5 + level / 2)
        )
        reach = t * np.sqrt(np.diag(self.fitted.covariance))
        ends = np.stack([self.fitted.parameters - reach, self.fitted.parameters + reach], axis=1)
        rigid, log_half, soft = ((float(low), float(high)) for low, high in ends)
        return {
            "rigid_ratio": rigid,
            "half_modulus": (exp(log_half[0]), exp(log_half[1])),
            "soft_ratio": soft,
        }

    def modulus(
        self,
        ratio: float,
        standard_error: float | None = None,
        *,
        touches: float = 1,
        level: float = 0.95,
    ) -> Modulus:
        """Return the modulus of an object from its ratio, with an interval.

        The interval includes the error of the fitted curve, the scatter from touch to touch and the standard error,
        inverted through the curve: it is not symmetric, and near the rigid ratio it has no upper end.

        Parameters
        ----------
        ratio : float
            Ratio of a touch, or the mean of several.
        standard_error : float, optional
            Standard error of the ratio, 0 or more; default 0.
        touches : float
            Number of touches of which the ratio is the mean, 1 or more.
        level : float, in (0, 1)
            Probability that the interval contains the modulus. In "stiffer than low" the bound is the lower end of
            the same interval: the modulus is above it with probability (1 + level) / 2.

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
        ends = bounds(self.fitted, MeasuredRatio(ratio, error, touches, level))
        low, high = (inf if x >= _LARGEST else exp(x) for x in ends)
        if reason := _outside(self.probe, ratio):
            far = "; the difference is larger than the uncertainty" if isnan(low) else ""
            return Modulus(nan, low, high, reason + far, extrapolated=True)
        value = self.probe.modulus(ratio)
        return Modulus(value, low, high, extrapolated=not self.range[0] <= value <= self.range[1])

    def budget(
        self,
        ratio: float,
        standard_error: float | None = None,
        *,
        touches: float = 1,
        linearity: float = 0.0,
    ) -> list[UncertaintyPart]:
        """Return what the uncertainty of a modulus consists of.

        Parameters
        ----------
        ratio, standard_error, touches
            As in `modulus`.
        linearity : float
            Standard deviation of the ratio by the linearity of the converter, `Uncertainty.linearity`; default 0. The
            interval of `modulus` has it in the scatter: the touches of the fit were measured with it.

        Returns
        -------
        list of UncertaintyPart
            "noise", "linearity", "scatter from touch to touch", "scatter of specimens", "fitted curve", and "together",
            the root of their sum of squares.

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
        of = variances(self.fitted, measured, np.array(log(modulus)))
        squares = {
            "noise": of.noise,
            "linearity": linearity**2,
            "scatter from touch to touch": float(of.touch),
            "scatter of specimens": float(of.specimen),
            "fitted curve": float(of.curve),
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
        freedom = self.fitted.touch_freedom or self.fitted.specimen_freedom
        return agreement(
            touches,
            scatter=self.touch_spread,
            freedom=freedom,
            accept=self.accepted,
            ratio_of=self.ratio_of,
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the calibration as TOML, with units, versions and the fitted data."""
        calibration_file.write_document(Path(path), self.as_dict())

    def as_dict(self) -> dict[str, Any]:
        """Return the contents of the file that `save` writes, as plain numbers and text."""
        return {
            "schema": calibration_file.SCHEMA,
            "palpate": self.version,
            "about": dict(self.about),
            "units": calibration_file.UNITS,
            "fit": {
                "rigid_ratio": self.probe.rigid_ratio,
                "half_modulus_MPa": self.probe.half_modulus,
                "soft_ratio": self.probe.soft_ratio,
                "calibrated_MPa": list(self.range),
                "verdict": self.verdict,
                "parameters": self.fitted.parameters.tolist(),
                "covariance": self.fitted.covariance.tolist(),
                "covariance_of": calibration_file.PARAMETERS,
            },
            "touch": {name: getattr(self, name) for name in calibration_file.TOUCH},
            "scatter": {name: getattr(self.fitted, name) for name in calibration_file.SCATTER},
            "data": {
                key: getattr(self, name).tolist() for name, key in calibration_file.DATA.items()
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
        return cls(**calibration_file.read_document(Path(path)))


_BELOW, _ABOVE = (
    2.0,
    4.0,
)  # the drawing ends at the smallest calibrated modulus / 2, and at the largest times 4


def band(calibration: Calibration, points: int) -> tuple[Array, Array, Array]:
    """Return points of the curve: log(E / MPa), the ratio, and the distance from it within which 95 % of single touches lie.

    They go in even steps from half the smallest calibrated modulus to four times the largest.
    """
    low, high = calibration.range
    log_modulus = np.linspace(np.log(low / _BELOW), np.log(high * _ABOVE), points)
    ratio = curve(calibration.fitted.parameters, log_modulus)
    return log_modulus, ratio, allowance(calibration.fitted, MeasuredRatio(1.0), log_modulus)
