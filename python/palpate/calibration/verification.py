"""Measurement assurance: a specimen of known modulus compared with a calibration."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite, sqrt
from typing import Any, Self

import numpy as np

from palpate import number_format
from palpate.calibration.fit import CurveFit, curve, slope_by_log_modulus
from palpate.calibration.interval import MeasuredRatio, degrees_of_freedom, variances
from palpate.calibration.modulus import Modulus
from palpate.errors import need

DOUBT = 0.01
"""Probability below which a difference is not by chance."""


@dataclass(frozen=True)
class Verification:
    """A comparison of a calibration with a specimen of known modulus.

    Attributes
    ----------
    specimen : str
    date : str
        Of the comparison, UTC, as 2026-11-29; "": unknown.
    known : float, MPa
        Modulus of the specimen.
    known_uncertainty : float
        Its relative standard uncertainty.
    measured : Modulus
        By the calibration, from the mean of the touches.
    touches : int
    probability : float
        Probability of such a difference, or a larger one, if nothing has changed.

    Examples
    --------
    >>> one = Verification("gel", "2026-11-29", 1.1, 0.0, Modulus(1.3, 1.25, 1.36), 4, 1e-4)
    >>> print(one)
    gel (1.10 MPa) measures 1.30 MPa (1.25 to 1.36) on 2026-11-29, 18 % more: the calibration does \
not hold any more (probability by chance 0.0001)
    """

    specimen: str
    date: str
    known: float
    known_uncertainty: float
    measured: Modulus
    touches: int
    probability: float

    @property
    def agrees(self) -> bool:
        """Whether the calibration agrees with the specimen."""
        return self.probability >= DOUBT

    def as_dict(self) -> dict[str, Any]:
        """Return the content of a table of a calibration file; numbers that are not finite are left out."""
        numbers = {
            "known_MPa": self.known,
            "known_uncertainty": self.known_uncertainty,
            "value_MPa": self.measured.value,
            "low_MPa": self.measured.low,
            "high_MPa": self.measured.high,
            "probability": self.probability,
        }
        kept = {name: value for name, value in numbers.items() if isfinite(value)}
        return {"specimen": self.specimen, "date": self.date, "touches": self.touches, **kept}

    @classmethod
    def of_dict(cls, table: Mapping[str, Any]) -> Self:
        """Return the comparison from a table of a calibration file."""
        nan = float("nan")
        measured = Modulus(
            float(table.get("value_MPa", nan)),
            float(table.get("low_MPa", nan)),
            float(table.get("high_MPa", nan)),
        )
        return cls(
            specimen=str(table["specimen"]),
            date=str(table["date"]),
            known=float(table["known_MPa"]),
            known_uncertainty=float(table["known_uncertainty"]),
            measured=measured,
            touches=int(table["touches"]),
            probability=float(table["probability"]),
        )

    def __str__(self) -> str:
        """Return the result as a sentence."""
        known = f"{number_format.number(self.known)} MPa"
        measured = f"{self.specimen} ({known}) measures {self.measured}"
        if self.date:
            measured += f" on {self.date}"
        if self.agrees:
            return f"{measured}: the calibration holds"
        difference = ""
        if isfinite(self.measured.value):
            percent = 100 * (self.measured.value / self.known - 1)
            more = "more" if percent > 0 else "less"
            difference = f", {abs(percent):.2g} % {more}"
        chance = f"(probability by chance {self.probability:.1g})"
        return f"{measured}{difference}: the calibration does not hold any more {chance}"


def agreement_probability(
    fit: CurveFit, measured: MeasuredRatio, log_modulus: float, uncertainty: float
) -> float:
    """Return the probability of a ratio that differs from a known modulus as much, or by more.

    Parameters
    ----------
    fit : CurveFit
    measured : MeasuredRatio
    log_modulus : float
        Logarithm of the known modulus, MPa.
    uncertainty : float
        Relative standard uncertainty of the known modulus.

    Returns
    -------
    float
    """
    x = np.array(log_modulus)
    parts = variances(fit, measured, x)
    of_modulus = (float(slope_by_log_modulus(fit.parameters, x)) * uncertainty) ** 2
    parts = parts._replace(noise=parts.noise + of_modulus)
    total = float(parts.total)
    freedom = float(degrees_of_freedom(fit, parts))
    distance = abs(measured.ratio - float(curve(fit.parameters, x))) / sqrt(total)
    return 2 * float(need("scipy.special", "science").stdtr(freedom, -distance))
