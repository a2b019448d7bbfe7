"""The substrate that carries both bumps, tilted against the surface of the object: oblique contact."""

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from palpate.elasticity import Elasticity
from palpate.simulation.ranges import positive, within

_Values = NDArray[np.float64] | float
_SOFTEST = 1e-6  # stiffness of the softest object beside that of the soft bump: at r = 1 it has none
_STEPS = 12  # of Newton's method: the forces add up to 1e-9 pF


@dataclass(frozen=True)
class Substrate:
    """Where the two bumps sit, and how a tilt shares the force between them. The truth is the ratio of level bumps.

    A substrate tilted by an angle a puts the hard bump deeper than the soft one by g = spacing tan a. With the depth d
    between the bumps, F_1 = r K (d + g/2)^s and F_2 = K (d - g/2)^s, each 0 before its bump is reached; K is the
    stiffness of soft bump and object in series, eq. (1): K = k_s (1 - 1/r) / (1 - 1/rigid_ratio). The hand sets the
    force F = F_1 + F_2, not d. For s = 1, with both bumps in contact, F_1 = r F_2 + r K g: an offset.

    Attributes
    ----------
    spacing_mm : float, mm
        Distance between the middles of the bumps.
    soft_pF_per_mm : float, pF/mm
        Stiffness k_s of the soft bump, as the capacitance of a linear gauge; of a press 1 mm deep.
    rigid_ratio : float, above 1
        k_h / k_s.
    exponent : float, 1 or more
        s: 1 for bumps with a flat end, 1.5 for domes (Hertz).
    tremor_deg : float, degrees
        Tremor of the angle, rms, with the spectrum of the scenario, independent of the tremor of the force.
    settles, settle_s : float, s
        At contact the tilt is 1 + settles times that of the hold, which it approaches with this time constant.

    Raises
    ------
    ValueError
        A value is outside its range.

    Notes
    -----
    The default values are choices of this simulator: bumps 3 mm apart, and a press of 1 pF in both channels together
    that is 0.3 mm deep on a rigid object. The paper gives neither.

    Examples
    --------
    >>> level = np.array([0.0, 0.1, 0.2])
    >>> Substrate().pressed(level, 5.0, 0.5, hard=False).round(4)
    array([0.    , 0.0942, 0.1942])
    """

    spacing_mm: float = 3.0
    soft_pF_per_mm: float = 0.3
    rigid_ratio: float = Elasticity().rigid_ratio
    exponent: float = 1.0
    tremor_deg: float = 0.0
    settles: float = 0.0
    settle_s: float = 0.3

    def __post_init__(self) -> None:
        """Check the ranges."""
        positive(self, "spacing_mm", "soft_pF_per_mm", "settle_s")
        within(self, 0, inf, "tremor_deg", "settles")
        within(self, 1, 3, "exponent")
        if not self.rigid_ratio > 1:
            raise ValueError(f"rigid_ratio: got {self.rigid_ratio}, allowed: above 1")

    def angle_deg(self, held_deg: float, since_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the tilt at times since the contact, s, without tremor, for a tilt of the hold; degrees."""
        return held_deg * (1 + self.settles * np.exp(-np.maximum(since_s, 0) / self.settle_s))

    def pressed(
        self, level: NDArray[np.float64], ratio: _Values, angle_deg: _Values, *, hard: bool
    ) -> NDArray[np.float64]:
        """Return the force of the soft bump, or that of the hard bump divided by the ratio.

        Parameters
        ----------
        level : numpy.ndarray, pF
            The same without a tilt.
        ratio : numpy.ndarray or float
            Ratio of level bumps.
        angle_deg : numpy.ndarray or float, degrees
            Tilt in the plane through both bumps; above 0 the hard bump is deeper.
        hard : bool
            Which bump.

        Returns
        -------
        numpy.ndarray, pF
        """
        stiffness = self.soft_pF_per_mm * np.maximum(1 - 1 / ratio, _SOFTEST) / (1 - 1 / self.rigid_ratio)
        half = self.spacing_mm * np.tan(np.radians(angle_deg)) / 2
        if self.exponent == 1:
            shift = stiffness * 2 * half / (1 + ratio)
            if hard:
                return np.clip(level + shift, 0, level * (1 + ratio) / ratio)
            return np.clip(level - ratio * shift, 0, level * (1 + ratio))
        depth = self._depth_mm(level / stiffness, ratio, half)
        own = np.maximum(depth + half if hard else depth - half, 0)
        return np.asarray(stiffness * own**self.exponent)

    def _depth_mm(self, reduced: NDArray[np.float64], ratio: _Values, half: _Values) -> NDArray[np.float64]:
        """Solve r (d + half)_+^s + (d - half)_+^s = (1 + r) reduced for d by Newton's method, mm.

        The left side is convex and rises with d, and at the first value it is too large: the steps go down to the root.
        """
        s = self.exponent
        depth = reduced ** (1 / s) + np.abs(half)
        for _ in range(_STEPS):
            one, two = np.maximum(depth + half, 0), np.maximum(depth - half, 0)
            excess = ratio * one**s + two**s - (1 + ratio) * reduced
            depth = depth - excess / np.maximum(s * (ratio * one ** (s - 1) + two ** (s - 1)), 1e-12)
        return np.asarray(depth)
