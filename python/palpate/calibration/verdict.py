"""Assessment of a fit: distances of the specimens from the curve, objections, and a verdict as text."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from palpate import number_format
from palpate.calibration.fit import Array, CurveFit, MeanRatios, curve, specimen_means
from palpate.errors import need
from palpate.uncertainty import TOUCH_SCATTER

DOUBT = 0.01  # probability below which a misfit is significant
LOOSE = 0.2  # half of the 95 % interval of a parameter, relative, above which it counts as not determined


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


def residuals(
    fit: CurveFit, ratios: Array, moduli: Array, standard_errors: Array, touches: Array
) -> list[Residual]:
    """Return the distance of each specimen from the curve, in order of modulus."""
    known, specimen = np.unique(moduli, return_inverse=True)
    mean, variance = specimen_means(
        MeanRatios(ratios, standard_errors, touches, specimen), fit.touch_variance
    )
    level = curve(fit.parameters, np.log(known))
    error = np.sqrt(variance + fit.specimen_variance * level**2)
    count = np.bincount(specimen, touches).astype(int)
    columns = (known, count, mean, level, error)
    return [
        Residual(float(e), int(n), float(r), float(f), float(s))
        for e, n, r, f, s in zip(*columns, strict=True)
    ]


def objections_to_fit(fit: CurveFit, rows: list[Residual]) -> list[str]:
    """Return the objections against a fit; empty if there are none."""
    found = []
    if (misfit := _misfit_probability(fit)) < DOUBT:
        worst = max(rows, key=lambda row: abs(row.standardised))
        found.append(
            f"The curve does not fit: the specimens scatter by a further {_share(fit.specimen_variance)} % around it (probability "
            f"by chance {misfit:.1g}); the largest distance is {percent(worst)} %, at {worst.modulus:g} MPa. Check the moduli, and "
            f"whether the soft ratio is {_soft(fit)}."
        )
    rigid = float(fit.parameters[0])
    t = float(need("scipy.special", "science").stdtrit(fit.specimen_freedom, 0.975))
    reach = t * float(fit.covariance[0, 0]) ** 0.5
    if reach > LOOSE * rigid:
        reached = f"the stiffest specimen reaches {100 * max(row.fitted for row in rows) / rigid:.0f} % of it"
        interval = f"({rigid - reach:.2g} to {rigid + reach:.2g}, 95 %)"
        more = f"A stiffer specimen{' or more specimens are' if fit.specimen_freedom < 4 else ' is'} needed."
        found.append(f"The rigid ratio is not determined {interval}: {reached}. {more}")
    pairs = [
        f"{a.modulus:g} and {b.modulus:g} MPa" for a, b in pairwise(rows) if not b.ratio > a.ratio
    ]
    if pairs:
        found.append(
            f"The measured ratio does not rise with the modulus between {', '.join(pairs)}."
        )
    return found


def _share(variance: float) -> str:
    """Return the root of a relative variance, in per cent."""
    return number_format.error(100 * variance**0.5)


def percent(row: Residual) -> str:
    """Return the relative distance of a specimen from the curve, in per cent, with its sign."""
    text = number_format.number(100 * row.relative, 100 * row.standard_error / row.fitted)
    return text if text.startswith("-") else f"+{text}"


def verdict(fit: CurveFit, rows: list[Residual], count: int) -> str:
    """Return the complete verdict as text."""
    against = objections_to_fit(fit, rows)
    spread = f"{_share(fit.touch_variance)} %"
    scatter = f"The ratios scatter around the curve by {spread} (as for one touch); with one value for each specimen the "
    scatter += "scatter of the touches and the misfit of the curve cannot be separated."
    if fit.touch_freedom:
        more = "the scatter of the specimens around the curve is not larger than this explains"
        if fit.specimen_variance:
            more = f"the specimens scatter by a further {_share(fit.specimen_variance)} % around the curve"
        by = f"by {spread}" if fit.touch_variance else "as much as its standard errors say"
        large = f", much for a hand (some {100 * TOUCH_SCATTER:g} %): is a touch under the wrong specimen?"
        by += large * (fit.touch_variance > (3 * TOUCH_SCATTER) ** 2)
        scatter = f"From touch to touch the ratio scatters {by} ({fit.touch_freedom} degrees of freedom); {more}."
    opening = "This calibration is not reliable." if against else "The curve fits."
    return " ".join([f"{opening} {len(rows)} specimens, {count} values.", scatter, *against])


def _soft(fit: CurveFit) -> str:
    ratio, error = float(fit.parameters[2]), float(fit.covariance[2, 2]) ** 0.5
    return number_format.number(ratio, error) if error else f"{ratio:g}"  # given, not fitted


def _misfit_probability(fit: CurveFit) -> float:
    """Return the probability of such a misfit by chance; 1 if it is unknown."""
    if not fit.touch_freedom:
        return 1.0
    return float(
        need("scipy.special", "science").fdtrc(fit.specimen_freedom, fit.touch_freedom, fit.misfit)
    )
