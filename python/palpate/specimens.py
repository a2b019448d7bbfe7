"""Young's moduli of the paper's specimens, and the ratio that a probe shows on an object of known modulus."""

from dataclasses import dataclass

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
"""Table I of the paper: sorbothane specimens by Shore scale, modulus in MPa by rheometer."""


@dataclass(frozen=True)
class Probe:
    """The two parameters of eq. (2) for an object that is much larger than the bumps.

    Attributes
    ----------
    rigid_ratio : float
        Ratio on a rigid object, k_h / k_s.
    half_modulus : float, MPa
        Modulus of the object at which the ratio is half-way between 1 and `rigid_ratio`.
    """

    rigid_ratio: float = 10.0
    half_modulus: float = 2.0

    def ratio(self, modulus: float) -> float:
        """Return the ratio on an object of this modulus (MPa): eq. (2), inverted.

        Examples
        --------
        >>> Probe().ratio(0.0), Probe().ratio(2.0)
        (1.0, 5.5)
        """
        if not modulus >= 0:
            raise ValueError(f"modulus: got {modulus}, allowed: 0 <= modulus, MPa")
        return (modulus * self.rigid_ratio + self.half_modulus) / (modulus + self.half_modulus)

    def modulus(self, ratio: float) -> float:
        """Return the modulus (MPa) of the object on which the probe shows this ratio: eq. (2).

        Examples
        --------
        >>> Probe().modulus(5.5)
        2.0
        """
        if not 1 <= ratio < self.rigid_ratio:
            raise ValueError(f"ratio: got {ratio}, allowed: 1 <= ratio < {self.rigid_ratio}")
        return self.half_modulus * (ratio - 1) / (self.rigid_ratio - ratio)
