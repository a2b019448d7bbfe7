"""Measurement assurance: a specimen of known modulus compared with a calibration."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from math import inf, isfinite, nan, sqrt
from typing import NamedTuple, Self

import numpy as np

from palpate import number_format
from palpate.calibration.fit import CurveFit, curve, slope_by_log_modulus
from palpate.calibration.interval import MeasuredRatio, degrees_of_freedom, variances
from palpate.calibration.modulus import Modulus
from palpate.errors import need
from palpate.messages import quoted

DOUBT = 0.01
"""Probability below which a difference is not by chance."""
_SEEN = 0.95
"""Probability with which `CalibrationVerification.noticed` is noticed."""


def today() -> str:
    """Return the date of now, UTC, as 2026-11-29."""
    return datetime.now(UTC).date().isoformat()


@dataclass(frozen=True)
class CalibrationVerification:
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
    noticed : float
        Relative change of the ratio that such touches notice in 95 of 100 verifications; nan:
        unknown.

    Examples
    --------
    >>> one = CalibrationVerification("gel", "2026-11-29", 1.1, 0.0, Modulus(1.3, 1.25, 1.36), 4, 1e-4)
    >>> print(one)
    gel (1.10 MPa) measures 1.300 MPa (1.250 to 1.360) on 2026-11-29, 18 % more: the calibration does \
not hold any more (probability by chance 0.0001)
    """

    specimen: str
    date: str
    known: float
    known_uncertainty: float
    measured: Modulus
    touches: int
    probability: float
    noticed: float = nan

    @property
    def agrees(self) -> bool:
        """Whether the calibration agrees with the specimen."""
        return self.probability >= DOUBT

    def as_dict(self) -> dict[str, object]:
        """Return the content of a table of a calibration file; numbers that are not finite are left out."""
        numbers = {
            "known_MPa": self.known,
            "known_uncertainty": self.known_uncertainty,
            "value_MPa": self.measured.value,
            "low_MPa": self.measured.low,
            "high_MPa": self.measured.high,
            "probability": self.probability,
            "noticed": self.noticed,
        }
        kept = {name: value for name, value in numbers.items() if isfinite(value)}
        return {"specimen": self.specimen, "date": self.date, "touches": self.touches, **kept}

    @classmethod
    def of_dict(cls, table: object) -> Self:
        """Return the comparison from a table of a calibration file.

        Raises
        ------
        KeyError, TypeError, ValueError
            An entry is missing, or is not of its kind.
        """
        if not isinstance(table, Mapping):
            raise TypeError(f"verifications: got {quoted(table)}, allowed: tables")
        value = float(table.get("value_MPa", nan))
        measured = Modulus(value, nan, nan)
        if "low_MPa" in table:
            low = float(table["low_MPa"])
            measured = Modulus(value, low, float(table.get("high_MPa", inf)))
        known = float(table["known_MPa"])
        probability = float(table["probability"])
        if not (0 < known < inf and 0 <= probability <= 1):
            raise ValueError(
                f"verifications: got known_MPa {known} and probability {probability}, allowed: a "
                "positive number, and 0 to 1"
            )
        return cls(
            specimen=str(table["specimen"]),
            date=str(table["date"]),
            known=known,
            known_uncertainty=float(table["known_uncertainty"]),
            measured=measured,
            touches=int(table["touches"]),
            probability=probability,
            noticed=float(table.get("noticed", nan)),
        )

    def __str__(self) -> str:
        """Return the result as a sentence."""
        known = f"{number_format.number(self.known)} MPa"
        measured = f"{self.specimen} ({known}) measures {self.measured}"
        if self.date:
            measured += f" on {self.date}"
        if self.agrees:
            return f"{measured}: the calibration holds{self._resolution}"
        difference = ""
        if isfinite(self.measured.value):
            percent = 100 * (self.measured.value / self.known - 1)
            more = "more" if percent > 0 else "less"
            difference = f", {number_format.error(abs(percent))} % {more}"
        chance = f"(probability by chance {self.probability:.1g})"
        return f"{measured}{difference}: the calibration does not hold any more {chance}"

    @property
    def _resolution(self) -> str:
        """The smallest change that such touches notice, as a clause."""
        if not isfinite(self.noticed):
            return ""
        percent = number_format.error(100 * self.noticed)
        return f" (a change of the ratio by {percent} % or more would show)"


class Comparison(NamedTuple):
    """A ratio compared with the curve at a known modulus.

    Attributes
    ----------
    probability : float
        Probability of a ratio that differs as much, or by more, if nothing has changed.
    noticed : float
        Relative change of the ratio that is noticed with a probability of 95 %.
    """

    probability: float
    noticed: float


def compare(
    fit: CurveFit, measured: MeasuredRatio, log_modulus: float, uncertainty: float
) -> Comparison:
    """Return how a ratio compares with the curve at a known modulus.

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
    Comparison
    """
    x = np.array(log_modulus)
    parts = variances(fit, measured, x)
    of_modulus = (float(slope_by_log_modulus(fit.parameters, x)) * uncertainty) ** 2
    parts = parts._replace(noise=parts.noise + of_modulus)
    error = sqrt(float(parts.total))
    predicted = float(curve(fit.parameters, x))
    distance = abs(measured.ratio - predicted)
    if error == 0:
        return Comparison(float(distance == 0), 0.0)
    freedom = float(degrees_of_freedom(fit, parts))
    special = need("scipy.special", "science")
    probability = 2 * float(special.stdtr(freedom, -distance / error))
    # A change is noticed beyond the quantile of DOUBT; its own estimate scatters by the error.
    quantiles = special.stdtrit(freedom, [1 - DOUBT / 2, _SEEN])
    return Comparison(probability, float(quantiles.sum()) * error / predicted)
