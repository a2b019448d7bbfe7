"""The result of a calibration for one ratio: a modulus with an interval, a bound, or the reason why there is none."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import exp, inf, isfinite, isnan, nan

from palpate import digits
from palpate.elasticity import Elasticity

_LARGEST = 690.0  # exp of it is still finite


@dataclass(frozen=True)
class Modulus:
    """Modulus of an object with its interval; unpacks as value, low, high.

    Attributes
    ----------
    value : float, MPa
        By eq. (2); nan if the ratio is outside the range of the curve.
    low, high : float, MPa
        Ends of the interval. high is inf if all stiffer moduli agree with the ratio, low is 0 if all softer ones do;
        both are nan if no modulus agrees.
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
        plain = {name: number if isfinite(number) else None for name, number in numbers.items()}
        return {**plain, "text": str(self), "reason": self.reason, "extrapolated": self.extrapolated}

    def __str__(self) -> str:
        """Return the modulus as text: a value with its interval, or a bound."""
        if self.high == inf and self.low > 0:
            return f"stiffer than {digits.number(self.low)} MPa"
        if self.low == 0 and self.high < inf:
            return f"softer than {digits.number(self.high)} MPa"
        if not self.low > 0:
            return "no modulus agrees with this ratio" if self.low != 0 else "every modulus agrees with this ratio"
        if not isfinite(self.value):
            middle = (self.low + self.high) / 2
            _, low, high = digits.between(middle, self.low, self.high)
            return f"{low} to {high} MPa"
        value, low, high = digits.between(self.value, self.low, self.high)
        return f"{value} MPa ({low} to {high})"

    @classmethod
    def of(
        cls, probe: Elasticity, ratio: float, bounds: tuple[float, float], calibrated: tuple[float, float]
    ) -> "Modulus":
        """Make a result from a ratio, the interval of log(E / MPa), and the range of the calibrated moduli, MPa."""
        low, high = (_exp(x) for x in bounds)
        reason = _reason(probe, ratio, agrees=not isnan(low))
        value = nan if reason else probe.modulus(ratio)
        return cls(value, low, high, reason, extrapolated=not calibrated[0] <= value <= calibrated[1])


def _reason(probe: Elasticity, ratio: float, *, agrees: bool) -> str:
    far = "" if agrees else "; the difference is larger than the uncertainty"
    if ratio < probe.soft_ratio:
        return f"the ratio is below {digits.number(probe.soft_ratio)}, the ratio of an infinitely soft object{far}"
    if ratio >= probe.rigid_ratio:
        return f"the ratio is not below {digits.number(probe.rigid_ratio)}, the ratio of a rigid object{far}"
    return ""


def _exp(x: float) -> float:
    return x if isnan(x) else exp(x) if x < _LARGEST else inf
