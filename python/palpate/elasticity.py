"""The paper's specimens, and what a probe shows on an object of known modulus: eq. (2) as in palpate/elasticity.hpp."""

from dataclasses import dataclass
from math import isfinite

SORBOTHANE_MPA = {
    "30 OO": 0.143,
    "40 OO": 0.186,
    "50 OO": 0.289,
    "60 OO": 0.405,
    "70 OO": 0.515,
    "30 A": 0.87,
    "40 A": 1.54,
    "50 A": 2.18,
    "60 A": 3.46,
    "70 A": 8.68,
}
"""Table I of the paper: Young's modulus in MPa of its sorbothane specimens (McMaster-Carr 8450K3), by Shore scale.

Measured by the paper's authors with a rheometer (Rheometrics RMS 800); the paper states no error.
"""


@dataclass(frozen=True)
class Elasticity:
    """The parameters of eq. (2) for an object that is much larger than the bumps.

    The same, bit for bit, as `palpate::Elasticity<double>`.

    Attributes
    ----------
    rigid_ratio : float, above soft_ratio
        Ratio on a rigid object, k_h / k_s.
    half_modulus : float, MPa, above 0
        Modulus of the object at which the ratio is half-way between soft_ratio and rigid_ratio.
    soft_ratio : float
        Ratio on an infinitely soft object: 1, or the ratio of the channels' gains.
    """

    rigid_ratio: float = 10.0
    half_modulus: float = 2.0
    soft_ratio: float = 1.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        if not isfinite(self.soft_ratio):
            raise ValueError(f"soft_ratio: got {self.soft_ratio}, allowed: a finite number")
        if not (isfinite(self.rigid_ratio) and self.rigid_ratio > self.soft_ratio):
            raise ValueError(
                f"rigid_ratio: got {self.rigid_ratio}, allowed: soft_ratio ({self.soft_ratio}) < rigid_ratio"
            )
        if not (isfinite(self.half_modulus) and self.half_modulus > 0):
            raise ValueError(f"half_modulus: got {self.half_modulus}, allowed: 0 < half_modulus, MPa")

    @classmethod
    def of_stiffness(cls, hard_stiffness: float, soft_stiffness: float) -> "Elasticity":
        """Return the probe whose "modulus" is the object's stiffness k_o, in the unit of the bumps' own: (2) as printed.

        Examples
        --------
        >>> Elasticity.of_stiffness(800.0, 100.0).ratio(800.0)
        4.5
        """
        return cls(hard_stiffness / soft_stiffness, hard_stiffness)

    def ratio(self, modulus: float) -> float:
        """Return the ratio on an object of this modulus (MPa, inf for a rigid one): eq. (2), inverted.

        Examples
        --------
        >>> Elasticity().ratio(0.0), Elasticity().ratio(2.0), Elasticity().ratio(float("inf"))
        (1.0, 5.5, 10.0)
        """
        if not modulus >= 0:
            raise ValueError(f"modulus: got {modulus}, allowed: 0 <= modulus, MPa")
        span = self.rigid_ratio - self.soft_ratio
        if modulus < self.half_modulus:
            return self.soft_ratio + span * (modulus / (modulus + self.half_modulus))
        return self.rigid_ratio - span * (self.half_modulus / (modulus + self.half_modulus))

    def modulus(self, ratio: float) -> float:
        """Return the modulus (MPa) of the object on which the probe shows this ratio: eq. (2).

        Examples
        --------
        >>> Elasticity().modulus(5.5)
        2.0
        """
        self._require_answer(ratio)
        return self.half_modulus * ((ratio - self.soft_ratio) / (self.rigid_ratio - ratio))

    def slope(self, ratio: float) -> float:
        """Return the derivative of the modulus to the ratio, MPa: without limit towards the rigid ratio.

        Examples
        --------
        >>> Elasticity().slope(5.5), round(Elasticity().slope(9.99))
        (0.8888888888888888, 180000)
        """
        self._require_answer(ratio)
        left = self.rigid_ratio - ratio
        return self.half_modulus * ((self.rigid_ratio - self.soft_ratio) / left) / left

    def _require_answer(self, ratio: float) -> None:
        if not self.soft_ratio <= ratio < self.rigid_ratio:
            raise ValueError(f"ratio: got {ratio}, allowed: {self.soft_ratio} <= ratio < {self.rigid_ratio}")
