"""Conversion between ratio and modulus, eq. (2) as in palpate/elasticity.hpp.

The table of the specimens of the paper is here, too.
"""

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
"""Table I of the paper: Shore hardness -> Young's modulus, MPa, of the sorbothane specimens
(McMaster-Carr 8450K3).

The authors of the paper measured them with a rheometer (Rheometrics RMS 800), and give no
uncertainty.
"""


@dataclass(frozen=True)
class Elasticity:
    """Conversion between ratio and modulus, equation (2), for an object much larger than the bumps.

    The results have the same bits as `palpate::Elasticity<double>`.

    Attributes
    ----------
    rigid_ratio : float, above soft_ratio
        Ratio on a rigid object, k_h / k_s.
    half_modulus : float, MPa, above 0
        Modulus of an object with a ratio half-way between soft_ratio and rigid_ratio.
    soft_ratio : float
        Ratio on an infinitely soft object: 1, or the ratio of the gains of the channels.

    Raises
    ------
    ValueError
        A value is outside its range.

    Examples
    --------
    >>> probe = Elasticity(rigid_ratio=8.0, half_modulus=1.0)
    >>> probe.ratio(1.0), probe.modulus(4.5)
    (4.5, 1.0)
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
                f"rigid_ratio: got {self.rigid_ratio}, allowed: "
                f"soft_ratio ({self.soft_ratio}) < rigid_ratio"
            )
        if not (isfinite(self.half_modulus) and self.half_modulus > 0):
            raise ValueError(
                f"half_modulus: got {self.half_modulus}, allowed: 0 < half_modulus, MPa"
            )

    @classmethod
    def of_stiffness(cls, hard_stiffness: float, soft_stiffness: float) -> "Elasticity":
        """Return a probe that converts ratios to stiffness, not modulus: equation (2) as printed.

        Parameters
        ----------
        hard_stiffness, soft_stiffness : float, above 0
            Stiffness of the bumps, k_h > k_s, in any unit.

        Returns
        -------
        Elasticity
            Its `modulus` is the stiffness k_o of the object, in the same unit.

        Examples
        --------
        >>> Elasticity.of_stiffness(800.0, 100.0).ratio(800.0)
        4.5
        """
        return cls(hard_stiffness / soft_stiffness, hard_stiffness)

    def ratio(self, modulus: float) -> float:
        """Return the ratio on an object with this modulus: the inverse of equation (2).

        Parameters
        ----------
        modulus : float, MPa, 0 or more
            inf: a rigid object.

        Returns
        -------
        float
            soft_ratio to rigid_ratio.

        Raises
        ------
        ValueError
            `modulus` is negative or nan.

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
        """Return the modulus of an object with this ratio, MPa: equation (2).

        Parameters
        ----------
        ratio : float
            soft_ratio <= ratio < rigid_ratio.

        Returns
        -------
        float
            Modulus, MPa.

        Raises
        ------
        ValueError
            `ratio` is outside this range: no modulus corresponds to it.

        Examples
        --------
        >>> Elasticity().modulus(5.5)
        2.0
        """
        self._require_invertible(ratio)
        return self.half_modulus * ((ratio - self.soft_ratio) / (self.rigid_ratio - ratio))

    def slope(self, ratio: float) -> float:
        """Return the derivative of the modulus with respect to the ratio, MPa.

        Parameters
        ----------
        ratio : float
            soft_ratio <= ratio < rigid_ratio.

        Returns
        -------
        float
            Derivative, MPa.

        Raises
        ------
        ValueError
            `ratio` is outside this range.

        Examples
        --------
        >>> Elasticity().slope(5.5), round(Elasticity().slope(9.99))
        (0.8888888888888888, 180000)
        """
        self._require_invertible(ratio)
        left = self.rigid_ratio - ratio
        span = self.rigid_ratio - self.soft_ratio
        return self.half_modulus * (span / left) / left

    def _require_invertible(self, ratio: float) -> None:
        if not self.soft_ratio <= ratio < self.rigid_ratio:
            raise ValueError(
                f"ratio: got {ratio}, allowed: {self.soft_ratio} <= ratio < {self.rigid_ratio}"
            )
