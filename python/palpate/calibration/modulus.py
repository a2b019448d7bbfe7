"""A Young's modulus with its interval, as numbers and as text in MPa or kPa."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from math import hypot, inf, isfinite, isnan, log
from typing import NamedTuple

from palpate import number_format
from palpate.materials import KnownModulus

_COVERING = 1.96  # standard uncertainties that hold in 95 %


class ModulusUnit(StrEnum):
    """Unit in which moduli are printed; everywhere else a modulus is in MPa.

    Examples
    --------
    >>> ModulusUnit("kPa").of(0.143)
    143.0
    """

    MPA = "MPa"
    KPA = "kPa"

    def of(self, modulus: float) -> float:
        """Return a modulus in MPa converted to this unit."""
        return 1000 * modulus if self is ModulusUnit.KPA else modulus


class ModulusText(NamedTuple):
    """A modulus as text: the value without unit ("": unknown), and the interval or bound."""

    value: str
    interval: str


@dataclass(frozen=True)
class Modulus:
    """Modulus of an object with its interval; unpacks as value, low, high.

    Attributes
    ----------
    value : float, MPa
        By eq. (2); nan if the ratio is outside the range of the curve.
    low, high : float, MPa
        Ends of the interval. high is inf if all stiffer moduli agree with the ratio, low is 0 if
        all softer ones do; both are nan if no modulus agrees, or there is no ratio.
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

    def agrees_with(self, known: KnownModulus) -> bool:
        """Return whether a known modulus is in the interval.

        Outside of it, its distance from the value has to be at most the root of the sum of squares
        of half the interval and of 1.96 of its own standard uncertainties, all as logarithms.

        Examples
        --------
        >>> found = Modulus(1.1, 1.0, 1.3)
        >>> found.agrees_with(KnownModulus(0.95)), found.agrees_with(KnownModulus(0.95, 0.1))
        (False, True)
        """
        if self.low <= known.modulus <= self.high:
            return True
        end = self.low if known.modulus < self.low else self.high
        value = self.value if isfinite(self.value) else end
        if isnan(end) or not known.whole:
            return False
        distance = abs(log(known.modulus / value))
        return distance <= hypot(log(end / value), _COVERING * known.whole)

    def as_dict(self) -> dict[str, float | str | bool | None]:
        """Return all fields (moduli in MPa) and the text; nan and inf as None."""
        numbers = {"value_MPa": self.value, "low_MPa": self.low, "high_MPa": self.high}
        return {
            **number_format.plain(numbers),
            "text": str(self),
            "reason": self.reason,
            "extrapolated": self.extrapolated,
        }

    def texts(self, unit: ModulusUnit = ModulusUnit.MPA) -> ModulusText:
        """Return the value and the interval as text.

        Parameters
        ----------
        unit : ModulusUnit

        Returns
        -------
        ModulusText
            Without a value the interval contains the unit.

        Examples
        --------
        >>> Modulus(1.1, 1.0, 1.3).texts(ModulusUnit.KPA)
        ModulusText(value='1100', interval='1000 to 1300')
        >>> Modulus(1.1, 1.0, float("inf")).texts().interval
        'stiffer than 1.00 MPa'
        """
        low = unit.of(self.low)
        high = unit.of(self.high)
        if self.high == inf and self.low > 0:
            return ModulusText("", f"stiffer than {number_format.number(low)} {unit}")
        if self.low == 0 and self.high < inf:
            return ModulusText("", f"softer than {number_format.number(high)} {unit}")
        if self.low == 0:
            return ModulusText("", "every modulus agrees with this ratio")
        if isnan(self.low):
            return ModulusText("", "no modulus")
        if not isfinite(self.value):
            _, low_text, high_text = number_format.between((low + high) / 2, low, high)
            return ModulusText("", f"{low_text} to {high_text} {unit}")
        value = unit.of(self.value)
        value_text, low_text, high_text = number_format.between(value, low, high)
        return ModulusText(value_text, f"{low_text} to {high_text}")

    def __str__(self) -> str:
        """Return the modulus as text: a value with its interval, or a bound."""
        value, interval = self.texts()
        return f"{value} MPa ({interval})" if value else interval


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


class ParameterRow(NamedTuple):
    """A parameter of a calibration as text: name, value and 95 % interval."""

    name: str
    value: str
    interval: str


def parameter_row(
    name: str,
    unit: str,
    value: float,
    ends: tuple[float, float],
) -> ParameterRow:
    """Return a parameter with the ends of its interval; equal ends: it was given, not fitted."""
    low, high = ends
    if not high > low:
        return ParameterRow(name, f"{value:g}{unit}", "not fitted")
    value_text, low_text, high_text = number_format.between(value, low, high)
    return ParameterRow(name, f"{value_text}{unit}", f"{low_text} to {high_text}{unit}")
