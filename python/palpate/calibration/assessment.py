"""Assessment of a fit: distances from the curve, objections, a verdict; and where it applies."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import hypot, isnan, nan
from typing import TYPE_CHECKING

import numpy as np

from palpate import number_format
from palpate.calibration.fit import (
    Array,
    CurveFit,
    MeanRatios,
    curve,
    slope_by_log_modulus,
    specimen_means,
    variance_by_moduli,
)
from palpate.errors import need
from palpate.uncertainty import TOUCH_SCATTER

if TYPE_CHECKING:
    from palpate.calibration.calibration_file import StoredCalibration

DOUBT = 0.01  # probability below which a misfit is significant
LEAST_MISFIT = 0.003  # scatter of the specimens that is no objection: creep and gauges cause it
MOST_STIFFENING = 0.5  # share of the touches
MOST_SCATTER = 1.5 * TOUCH_SCATTER  # of level ratios from touch to touch
LOOSE = 0.2  # relative half width of the 95 % interval above which a parameter is not determined
USUAL_MODULUS_UNCERTAINTY = 0.15  # a durometer and a relation; above it, a modulus is rather wrong
_FAR = 2.5  # standard errors
_OUTLYING = (
    0.65  # share of the squares of all distances: a specimen with more differs from the others
)
_FEW = 4  # degrees of freedom below which more specimens help as well as a stiffer one


@dataclass(frozen=True)
class Residual:
    """Distance of one specimen from the fitted curve.

    Attributes
    ----------
    modulus : float, MPa
    touches : int
        Number of touches in the data.
    ratio, fitted : float
        Weighted mean of the measured ratios, and the ratio of the curve.
    standard_error : float
        Standard error of the mean, including the scatter of touches and specimens, and the
        uncertainty of the modulus.
    touch_error : float
        The part of it by the touches.

    Examples
    --------
    >>> one = Residual(modulus=1.0, touches=4, ratio=4.2, fitted=4.0, standard_error=0.1)
    >>> round(one.relative, 3), round(one.standardised, 1)
    (0.05, 2.0)
    """

    modulus: float
    touches: int
    ratio: float
    fitted: float
    standard_error: float
    touch_error: float = 0.0

    @property
    def relative(self) -> float:
        """Distance from the curve, relative to the curve."""
        return self.ratio / self.fitted - 1

    @property
    def standardised(self) -> float:
        """Distance from the curve in standard errors."""
        return (self.ratio - self.fitted) / self.standard_error

    @property
    def percent(self) -> str:
        """Relative distance from the curve as text, in per cent, with its sign."""
        text = number_format.number(100 * self.relative, 100 * self.standard_error / self.fitted)
        return text if text.startswith("-") else f"+{text}"


def residuals(
    fit: CurveFit,
    ratios: Array,
    moduli: Array,
    standard_errors: Array,
    touches: Array,
    modulus_uncertainties: Array,
) -> list[Residual]:
    """Return the distance of each specimen from the curve, in order of modulus."""
    known, first, specimen = np.unique(moduli, return_index=True, return_inverse=True)
    data = MeanRatios(ratios, standard_errors, touches, specimen)
    mean, variance = specimen_means(data, fit.touch_variance)
    x = np.log(known)
    level = curve(fit.parameters, x)
    by_moduli = variance_by_moduli(fit.parameters, x, modulus_uncertainties[first])
    error = np.sqrt(variance + fit.specimen_variance * level**2 + by_moduli)
    count = np.bincount(specimen, touches)
    return [
        Residual(
            modulus=float(known[row]),
            touches=int(count[row]),
            ratio=float(mean[row]),
            fitted=float(level[row]),
            standard_error=float(error[row]),
            touch_error=float(variance[row]) ** 0.5,
        )
        for row in range(len(known))
    ]


def _curve_misfit(fit: CurveFit, probability: float, rows: Sequence[Residual]) -> str:
    """Return the objection that the specimens scatter by more than their touches explain."""
    largest = max(rows, key=lambda row: abs(row.standardised))
    soft_ratio = float(fit.parameters[2])
    soft_error = float(fit.covariance[2, 2]) ** 0.5
    soft = f"{soft_ratio:g}"
    if soft_error:
        soft = number_format.number(soft_ratio, soft_error)
    objection = (
        f"The curve does not fit: the specimens scatter by a further "
        f"{_percent(fit.specimen_variance)} % around it (probability by chance "
        f"{probability:.1g}); the largest distance is {largest.percent} %, at "
        f"{largest.modulus:g} MPa. Check the moduli, and whether the soft ratio is {soft}."
    )
    needed = explaining_uncertainty(fit, rows)
    if isnan(needed):
        return objection
    stated = " in place of the stated one" if fit.modulus_share else ""
    return (
        f"{objection} A standard uncertainty of the moduli of "
        f"{number_format.error(100 * needed)} %{stated} would explain it: if they are not better "
        "known, state it (--moduli-uncertainty)."
    )


def explaining_uncertainty(fit: CurveFit, rows: Sequence[Residual]) -> float:
    """Return the relative uncertainty of all moduli that explains the distances from the curve.

    nan: a usual one does not explain them, or not that of one specimen.
    """
    distance = np.array([row.ratio - row.fitted for row in rows])
    by_touches = np.array([row.touch_error for row in rows]) ** 2
    x = np.log([row.modulus for row in rows])
    by_moduli = slope_by_log_modulus(fit.parameters, x) ** 2

    def squares(uncertainty: float) -> Array:
        return np.asarray(distance**2 / (by_touches + by_moduli * uncertainty**2))

    def excess(uncertainty: float) -> float:
        return float(squares(uncertainty).sum()) - fit.specimen_freedom

    if excess(0.0) <= 0 or excess(USUAL_MODULUS_UNCERTAINTY) > 0:
        return nan
    brentq = need("scipy.optimize", "science").brentq
    found = float(brentq(excess, 0.0, USUAL_MODULUS_UNCERTAINTY))
    largest = float(squares(found).max())
    return found if largest < _OUTLYING * fit.specimen_freedom else nan


def _too_scattered(fit: CurveFit) -> str:
    """Return the objection that the level ratios differ by more than a tilt explains."""
    return (
        f"The level ratio scatters from touch to touch by {_percent(fit.touch_variance)} %, which "
        "no tilt of the probe explains. Is a touch under the wrong specimen, or do the bumps have "
        "different shapes?"
    )


def _undetermined(
    fit: CurveFit,
    rigid: float,
    reach: float,
    rows: Sequence[Residual],
) -> str:
    """Return the objection that the interval of the rigid ratio, +- `reach`, is too wide."""
    stiffest = max(row.fitted for row in rows)
    needed = " is"
    if fit.specimen_freedom < _FEW:
        needed = " or more specimens are"
    return (
        f"The rigid ratio is not determined ({rigid - reach:.2g} to {rigid + reach:.2g}, 95 %): "
        f"the stiffest specimen reaches {100 * stiffest / rigid:.0f} % of it. "
        f"A stiffer specimen{needed} needed."
    )


@dataclass(frozen=True)
class Assessment:
    """Number of specimens and values of a fit, and what speaks against it.

    Attributes
    ----------
    fit : palpate.calibration.fit.CurveFit
    specimens, values : int
    objections : tuple of str
        Sentences; empty: the fit is sound.

    Examples
    --------
    >>> from palpate import Calibration
    >>> found = Calibration.fit([2.0, 3.0, 4.0, 5.0], [0.18, 0.46, 1.0, 2.5]).assessment
    >>> found.specimens, found.objections
    (4, ())
    """

    fit: CurveFit
    specimens: int
    values: int
    objections: tuple[str, ...]

    def __str__(self) -> str:
        """Return the complete verdict as text."""
        opening = "The curve fits."
        if self.objections:
            opening = "This calibration is not reliable."
        counts = f"{self.specimens} specimens, {self.values} values."
        scatter = _one_touch_each(self.fit)
        if self.fit.touch_freedom:
            scatter = _several_touches(self.fit)
        return " ".join([opening, counts, scatter, *self.objections])


def _one_touch_each(fit: CurveFit) -> str:
    """Return the sentence about the scatter of a fit with one value for each specimen."""
    if fit.modulus_share:
        return (
            "Beyond the stated uncertainty of the moduli the ratios scatter around the curve by "
            f"{_percent(fit.touch_variance)} % at most (as for one touch); with one value for each "
            "specimen this cannot be determined better."
        )
    return (
        f"The ratios scatter around the curve by {_percent(fit.touch_variance)} % (as for one "
        "touch); with one value for each specimen the scatter of the touches and the misfit of the "
        "curve cannot be separated."
    )


def _several_touches(fit: CurveFit) -> str:
    """Return the sentence about the scatter of touches and specimens."""
    touches = "as much as its standard errors say"
    if fit.touch_variance:
        touches = f"by {_percent(fit.touch_variance)} %"
    if fit.touch_variance > (2 * TOUCH_SCATTER) ** 2:
        usual = f"{100 * TOUCH_SCATTER:g} %"
        touches += f", much for a hand (some {usual}): is a touch under the wrong specimen?"
    explained = "this explains"
    beyond = ""
    if fit.modulus_share:
        explained = "this and the stated uncertainty of the moduli explain"
        beyond = ", beyond the stated uncertainty of the moduli"
    specimens = f"the scatter of the specimens around the curve is not larger than {explained}"
    if fit.specimen_variance:
        further = f"{_percent(fit.specimen_variance)} %"
        specimens = f"the specimens scatter by a further {further} around the curve{beyond}"
    freedom = f"({fit.touch_freedom} degrees of freedom)"
    return f"From touch to touch the ratio scatters {touches} {freedom}; {specimens}."


def _percent(variance: float) -> str:
    """Return the root of a relative variance, in per cent."""
    return number_format.error(100 * variance**0.5)


def assess(
    fit: CurveFit, rows: Sequence[Residual], values: int, kind: str, stiffening: float
) -> Assessment:
    """Return the assessment of a fit to this number of values of a kind, "hold" or "level".

    `stiffening`: share of the touches on objects that stiffen with depth.
    """
    objections = []
    probability = _misfit_probability(fit)
    if probability < DOUBT and fit.specimen_variance > LEAST_MISFIT**2:
        objections.append(_curve_misfit(fit, probability, rows))
    if kind == "level" and fit.touch_variance > MOST_SCATTER**2:
        objections.append(_too_scattered(fit))
    if stiffening > MOST_STIFFENING:
        objections.append(
            f"{100 * stiffening:.0f} % of the touches show a ratio that grows with depth. The "
            "specimens are thin or layered, or the bumps have different shapes."
        )
    rigid = float(fit.parameters[0])
    t = float(need("scipy.special", "science").stdtrit(fit.curve_freedom, 0.975))
    reach = t * float(fit.covariance[0, 0]) ** 0.5
    if reach > LOOSE * rigid:
        objections.append(_undetermined(fit, rigid, reach, rows))
    falling = []
    for softer, stiffer in pairwise(rows):
        if not stiffer.ratio > softer.ratio and not _may_fall(fit, softer, stiffer):
            falling.append(f"{softer.modulus:g} and {stiffer.modulus:g} MPa")
    if falling:
        pairs = ", ".join(falling)
        objections.append(f"The measured ratio does not rise with the modulus between {pairs}.")
    return Assessment(fit, len(rows), values, tuple(objections))


def _may_fall(fit: CurveFit, softer: Residual, stiffer: Residual) -> bool:
    """Return whether the stated uncertainty of two moduli explains that the ratio falls."""
    rise = stiffer.fitted - softer.fitted
    fall = softer.ratio - stiffer.ratio
    error = hypot(softer.standard_error, stiffer.standard_error)
    return fit.modulus_share > 0 and rise + fall < _FAR * error


def _misfit_probability(fit: CurveFit) -> float:
    """Return the probability of such a misfit by chance; 1 if it is unknown."""
    if not fit.touch_freedom:
        return 1.0
    above = need("scipy.special", "science").fdtrc
    return float(above(fit.specimen_freedom, fit.touch_freedom, fit.misfit))


def other_settings(measured: Mapping[str, float], calibrated: Mapping[str, float]) -> str:
    """Return why a touch has no modulus: it was measured with other settings of the tracker.

    Examples
    --------
    >>> print(other_settings({"age": 0.0}, {"age": 1.3}))
    measured with age 0, but calibrated with age 1.3: use --set age=1.3
    """
    of_touch = []
    of_calibration = []
    options = []
    for name, value in calibrated.items():
        if measured[name] != value:
            of_touch.append(f"{name} {measured[name]:g}")
            of_calibration.append(f"{name} {value:g}")
            options.append(f"--set {name}={value:g}")
    return (
        f"measured with {' and '.join(of_touch)}, but calibrated with "
        f"{' and '.join(of_calibration)}: use {' '.join(options)}"
    )


def calibration_doubts(calibration: "StoredCalibration", scene: str) -> list[str]:
    """Return why the moduli by a calibration may be wrong in a measurement with this scene.

    Examples
    --------
    >>> from palpate import Calibration
    >>> from palpate.calibration.calibration_file import About
    >>> about = About(scene="paper")
    >>> found = Calibration.fit([2.0, 3.0, 4.0, 5.0], [0.18, 0.46, 1.0, 2.5], about=about)
    >>> [reason[:41] for reason in calibration_doubts(found, "handheld")]
    ['the calibration was made with scene paper']
    """
    about = calibration.about
    reasons = []
    if not calibration.sound:
        reasons.append(f"calibration: {calibration.verdict}")
    unknown = calibration.ranges.unknown
    if calibration.ratio == "level" and unknown:
        reasons.append(
            f"the calibration file has no range of {', '.join(unknown)}, so the intervals are wider: "
            "calibrate again"
        )
    if about.scene and about.scene != scene:
        reasons.append(
            f"the calibration was made with scene {about.scene}, but this is scene {scene}: the "
            "moduli may be wrong"
        )
    if about.doubts:
        reasons.append(
            "the calibration was made from recordings that were not as written, so the moduli may "
            f"be wrong: {'; '.join(about.doubts)}"
        )
    newest = calibration.newest_verification
    if newest is not None and not newest.agrees:
        reasons.append(
            f"the newest verification disagrees, so the moduli may be wrong: {newest}; verify "
            "again, or calibrate again"
        )
    return reasons
