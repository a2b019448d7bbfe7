"""Assessment of a fit: distances of the specimens from the curve, objections, and a verdict."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from palpate import number_format
from palpate.calibration.fit import Array, CurveFit, MeanRatios, curve, specimen_means
from palpate.errors import need
from palpate.uncertainty import TOUCH_SCATTER

DOUBT = 0.01  # probability below which a misfit is significant
LOOSE = 0.2  # relative half width of the 95 % interval above which a parameter is not determined
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
        Standard error of the mean, including the scatter of touches and specimens.

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
    fit: CurveFit, ratios: Array, moduli: Array, standard_errors: Array, touches: Array
) -> list[Residual]:
    """Return the distance of each specimen from the curve, in order of modulus."""
    known, specimen = np.unique(moduli, return_inverse=True)
    data = MeanRatios(ratios, standard_errors, touches, specimen)
    mean, variance = specimen_means(data, fit.touch_variance)
    level = curve(fit.parameters, np.log(known))
    error = np.sqrt(variance + fit.specimen_variance * level**2)
    count = np.bincount(specimen, touches)
    return [
        Residual(
            modulus=float(known[row]),
            touches=int(count[row]),
            ratio=float(mean[row]),
            fitted=float(level[row]),
            standard_error=float(error[row]),
        )
        for row in range(len(known))
    ]


@dataclass(frozen=True)
class CurveMisfit:
    """Objection: the specimens scatter around the curve by more than their touches explain."""

    fit: CurveFit
    probability: float
    largest: Residual

    def __str__(self) -> str:
        """Return the objection as sentences."""
        soft_ratio = float(self.fit.parameters[2])
        soft_error = float(self.fit.covariance[2, 2]) ** 0.5
        soft = f"{soft_ratio:g}"
        if soft_error:
            soft = number_format.number(soft_ratio, soft_error)
        return (
            f"The curve does not fit: the specimens scatter by a further "
            f"{_percent(self.fit.specimen_variance)} % around it (probability by chance "
            f"{self.probability:.1g}); the largest distance is {self.largest.percent} %, at "
            f"{self.largest.modulus:g} MPa. Check the moduli, and whether the soft ratio is {soft}."
        )


@dataclass(frozen=True)
class RigidRatioUndetermined:
    """Objection: the interval of the rigid ratio, plus and minus `reach`, is too wide."""

    rigid_ratio: float
    reach: float
    stiffest: float  # ratio of the curve at the stiffest specimen
    few: bool

    def __str__(self) -> str:
        """Return the objection as sentences."""
        low = self.rigid_ratio - self.reach
        high = self.rigid_ratio + self.reach
        needed = " or more specimens are" if self.few else " is"
        return (
            f"The rigid ratio is not determined ({low:.2g} to {high:.2g}, 95 %): the stiffest "
            f"specimen reaches {100 * self.stiffest / self.rigid_ratio:.0f} % of it. "
            f"A stiffer specimen{needed} needed."
        )


@dataclass(frozen=True)
class NotRising:
    """Objection: between these pairs of moduli, MPa, the mean ratio does not rise."""

    moduli: tuple[tuple[float, float], ...]

    def __str__(self) -> str:
        """Return the objection as a sentence."""
        pairs = ", ".join(f"{softer:g} and {stiffer:g} MPa" for softer, stiffer in self.moduli)
        return f"The measured ratio does not rise with the modulus between {pairs}."


Objection = CurveMisfit | RigidRatioUndetermined | NotRising


@dataclass(frozen=True)
class Assessment:
    """Number of specimens and values of a fit, and what speaks against it.

    Attributes
    ----------
    fit : palpate.calibration.fit.CurveFit
    specimens, values : int
    objections : tuple of CurveMisfit, RigidRatioUndetermined and NotRising
        Empty: the fit is sound. Each prints as a sentence.

    Examples
    --------
    >>> from palpate import Calibration
    >>> found = Calibration.fit([2.0, 3.0, 4.0, 5.0], [0.18, 0.46, 1.0, 2.5]).assessment
    >>> found.specimens, [type(each).__name__ for each in found.objections]
    (4, [])
    """

    fit: CurveFit
    specimens: int
    values: int
    objections: tuple[Objection, ...]

    def __str__(self) -> str:
        """Return the complete verdict as text."""
        opening = "The curve fits."
        if self.objections:
            opening = "This calibration is not reliable."
        counts = f"{self.specimens} specimens, {self.values} values."
        scatter = _one_touch_each(self.fit)
        if self.fit.touch_freedom:
            scatter = _several_touches(self.fit)
        return " ".join([opening, counts, scatter, *map(str, self.objections)])


def _one_touch_each(fit: CurveFit) -> str:
    """Return the sentence about the scatter of a fit with one value for each specimen."""
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
    if fit.touch_variance > (3 * TOUCH_SCATTER) ** 2:
        usual = f"{100 * TOUCH_SCATTER:g} %"
        touches += f", much for a hand (some {usual}): is a touch under the wrong specimen?"
    specimens = "the scatter of the specimens around the curve is not larger than this explains"
    if fit.specimen_variance:
        further = f"{_percent(fit.specimen_variance)} %"
        specimens = f"the specimens scatter by a further {further} around the curve"
    freedom = f"({fit.touch_freedom} degrees of freedom)"
    return f"From touch to touch the ratio scatters {touches} {freedom}; {specimens}."


def _percent(variance: float) -> str:
    """Return the root of a relative variance, in per cent."""
    return number_format.error(100 * variance**0.5)


def assess(fit: CurveFit, rows: Sequence[Residual], values: int) -> Assessment:
    """Return the assessment of a fit to this number of values."""
    objections: list[Objection] = []
    probability = _misfit_probability(fit)
    if probability < DOUBT:
        largest = max(rows, key=lambda row: abs(row.standardised))
        objections.append(CurveMisfit(fit, probability, largest))
    rigid = float(fit.parameters[0])
    t = float(need("scipy.special", "science").stdtrit(fit.specimen_freedom, 0.975))
    reach = t * float(fit.covariance[0, 0]) ** 0.5
    if reach > LOOSE * rigid:
        stiffest = max(row.fitted for row in rows)
        few = fit.specimen_freedom < _FEW
        objections.append(RigidRatioUndetermined(rigid, reach, stiffest, few))
    falling = tuple((a.modulus, b.modulus) for a, b in pairwise(rows) if not b.ratio > a.ratio)
    if falling:
        objections.append(NotRising(falling))
    return Assessment(fit, len(rows), values, tuple(objections))


def _misfit_probability(fit: CurveFit) -> float:
    """Return the probability of such a misfit by chance; 1 if it is unknown."""
    if not fit.touch_freedom:
        return 1.0
    above = need("scipy.special", "science").fdtrc
    return float(above(fit.specimen_freedom, fit.touch_freedom, fit.misfit))
