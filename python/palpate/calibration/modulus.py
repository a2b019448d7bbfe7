"""What a ratio says of the object: a modulus with an interval, only a bound, or nothing, with the reason."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import exp, inf, isfinite, isnan, nan

from palpate.elasticity import Elasticity

_LARGEST = 690.0  # exp of it is still a number


@dataclass(frozen=True)
class Modulus:
    """The modulus that a ratio stands for; unpacks as value, low, high.

    Attributes
    ----------
    value : float, MPa
        By eq. (2); nan where it has no answer.
    low, high : float, MPa
        Ends of the interval; high is inf where stiffer objects agree without end, low is 0 where softer ones do; both
        nan where no object agrees.
    reason : str
        Why value is nan; empty where it is not.
    extrapolated : bool
        Whether the value, or what is known of it, lies beyond the calibrated moduli.
    """

    value: float
    low: float
    high: float
    reason: str = ""
    extrapolated: bool = False

    def __iter__(self) -> Iterator[float]:
        """Value, low, high."""
        return iter((self.value, self.low, self.high))

    def as_dict(self) -> dict[str, float | str | bool | None]:
        """Every field, in MPa where it is a modulus, and the text; nan and inf as None."""
        numbers = {"value_MPa": self.value, "low_MPa": self.low, "high_MPa": self.high}
        plain = {name: number if isfinite(number) else None for name, number in numbers.items()}
        return {**plain, "text": str(self), "reason": self.reason, "extrapolated": self.extrapolated}

    def __str__(self) -> str:
        """As a person would say it."""
        if self.high == inf and self.low > 0:
            return f"stiffer than {self.low:.3g} MPa"
        if self.low == 0 and self.high < inf:
            return f"softer than {self.high:.3g} MPa"
        if not self.low > 0:
            return "no object" if self.low != 0 else "any object"
        if not isfinite(self.value):
            return f"{self.low:.3g} to {self.high:.3g} MPa"
        return f"{self.value:.3g} MPa ({self.low:.3g} to {self.high:.3g})"

    @classmethod
    def of(
        cls, probe: Elasticity, ratio: float, bounds: tuple[float, float], calibrated: tuple[float, float]
    ) -> "Modulus":
        """Put together what a ratio says: by eq. (2), the ends of the set of log(E / MPa), and the calibrated moduli."""
        low, high = (_exp(x) for x in bounds)
        reason = _reason(probe, ratio, agrees=not isnan(low))
        value = nan if reason else probe.modulus(ratio)
        return cls(value, low, high, reason, extrapolated=not calibrated[0] <= value <= calibrated[1])


def _reason(probe: Elasticity, ratio: float, *, agrees: bool) -> str:
    far = "" if agrees else ", by more than its uncertainty"
    if ratio < probe.soft_ratio:
        return f"the ratio is below {probe.soft_ratio:.4g}, that of an infinitely soft object{far}"
    if ratio >= probe.rigid_ratio:
        return f"the ratio is not below {probe.rigid_ratio:.4g}, that of a rigid object{far}"
    return ""


def _exp(x: float) -> float:
    return x if isnan(x) else exp(x) if x < _LARGEST else inf
