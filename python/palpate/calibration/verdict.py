"""How good a fit is: the specimens' distance from the curve, and what follows from it, in plain words."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from palpate.calibration.curve_fit import Fit, Rows, curve, means
from palpate.extras import need

Array = NDArray[np.float64]
DOUBT = 0.01  # probability below which a misfit is not taken for chance
LOOSE = 0.1  # relative standard error above which a parameter counts as not determined


@dataclass(frozen=True)
class Residual:
    """One specimen against the curve.

    Attributes
    ----------
    modulus : float, MPa
    touches : int
        Rows of data, or touches they are the mean of.
    ratio, fitted : float
        Weighted mean of what was measured, and the curve's.
    standard_error : float
        Of the mean, with every scatter.
    """

    modulus: float
    touches: int
    ratio: float
    fitted: float
    standard_error: float

    @property
    def relative(self) -> float:
        """Distance from the curve, relative to it."""
        return self.ratio / self.fitted - 1

    @property
    def standardised(self) -> float:
        """Distance from the curve in standard errors."""
        return (self.ratio - self.fitted) / self.standard_error


def residuals(fit: Fit, ratios: Array, moduli: Array, standard_errors: Array, touches: Array) -> list[Residual]:
    """Return how far each specimen is off the curve, in order of modulus."""
    known, specimen = np.unique(moduli, return_inverse=True)
    mean, variance = means(Rows(ratios, standard_errors, touches, specimen), fit.touch_variance)
    level = curve(fit.parameters, np.log(known))
    error = np.sqrt(variance + fit.specimen_variance * level**2)
    count = np.bincount(specimen, touches).astype(int)
    columns = (known, count, mean, level, error)
    return [Residual(float(e), int(n), float(r), float(f), float(s)) for e, n, r, f, s in zip(*columns, strict=True)]


def objections(fit: Fit, rows: list[Residual]) -> list[str]:
    """Return what speaks against a calibration; empty where nothing does."""
    found = []
    misfit = _misfit_probability(fit)
    if misfit < DOUBT:
        worst = max(rows, key=lambda row: abs(row.standardised))
        found.append(
            f"The curve does not fit: the specimens are {100 * fit.specimen_variance**0.5:.2g} % off it beyond what the "
            f"touches' scatter explains (probability {misfit:.1g}); the farthest, of {worst.modulus:g} MPa, by "
            f"{100 * worst.relative:+.2g} %. A wrong modulus, or a soft ratio that is not {fit.parameters[2]:.3g}?"
        )
    error = float(fit.covariance[0, 0] ** 0.5)
    if error > LOOSE * fit.parameters[0]:
        reached = max(row.fitted for row in rows) / fit.parameters[0]
        found.append(
            f"The rigid ratio is not determined (standard error {100 * error / fit.parameters[0]:.0f} %): the stiffest "
            f"specimen reaches {100 * reached:.0f} % of it. A stiffer specimen is needed."
        )
    wrong = [(a.modulus, b.modulus) for a, b in pairwise(rows) if not b.ratio > a.ratio]
    if wrong:
        pairs = ", ".join(f"{a:g} and {b:g} MPa" for a, b in wrong)
        found.append(f"The measured ratio does not rise with the modulus between {pairs}.")
    return found


def verdict(fit: Fit, rows: list[Residual], count: int) -> str:
    """Return the whole verdict, one sentence after the other."""
    against = objections(fit, rows)
    spread = f"{100 * fit.touch_variance**0.5:.2g} %"
    if fit.touch_freedom:
        off = (
            f"{100 * fit.specimen_variance**0.5:.2g} % off the curve beyond"
            if fit.specimen_variance
            else "no farther off than"
        )
        scatter = (
            f"From touch to touch the ratio scatters by {spread} ({fit.touch_freedom} degrees of freedom); the specimens "
            f"are {off} what this explains."
        )
    else:
        scatter = (
            f"About the curve the ratios scatter by {spread} of one touch; with one value a specimen the scatter of the "
            "touches and the misfit of the curve cannot be told apart."
        )
    opening = "This calibration is not to be relied on." if against else "The curve fits."
    return " ".join([f"{opening} {len(rows)} specimens, {count} values.", scatter, *against])


def _misfit_probability(fit: Fit) -> float:
    """Probability of so large a misfit by chance; 1 where it cannot be told."""
    if not fit.touch_freedom:
        return 1.0
    return float(need("scipy.special", "science").fdtrc(fit.specimen_freedom, fit.touch_freedom, fit.misfit))
