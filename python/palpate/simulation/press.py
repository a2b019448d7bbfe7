"""One simulated press: its force and the ratio of the object as functions of time."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.simulation.ranges import positive, within


@dataclass(frozen=True)
class Press:
    """One simulated press.

    Attributes
    ----------
    start_s : float
        Time at which the capacitances begin to rise.
    ratios : sequence of (float, float)
        (seconds since start_s, ratio from then on): one pair for one material, several for sliding.
    depth_pF : float
        Change of the soft channel during the hold.
    rise_s, hold_s, fall_s : float
        Duration of rise, hold and fall; rise and fall are half a cosine.
    creep : float
        Relative change of the depth during the hold.
    relaxes, relaxation_s : float
        The object relaxes: from contact on the ratio falls by this share (rises if below 0), with this time
        constant, s.
    tilt_deg : (float, float), degrees
        Tilt of the substrate in the plane through both bumps (above 0: the hard bump is deeper), and at right angles
        to it. What it does: `palpate.simulation.substrate.Substrate`.

    Raises
    ------
    ValueError
        A value is outside its range.

    Examples
    --------
    >>> round(Press(2.0, [(0.0, 2.5)]).stop_s, 2)
    9.15
    """

    start_s: float
    ratios: Sequence[tuple[float, float]]
    depth_pF: float = 0.25
    rise_s: float = 0.3
    hold_s: float = 6.6
    fall_s: float = 0.25
    creep: float = 0.0
    relaxes: float = 0.0
    relaxation_s: float = 1.0
    tilt_deg: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        """Check the ranges."""
        within(self, -np.inf, 1, "relaxes")
        within(self, -45, 45, "tilt_deg")
        positive(self, "rise_s", "hold_s", "fall_s", "relaxation_s")

    @property
    def stop_s(self) -> float:
        """Time of the end of the fall, s."""
        return self.start_s + self.rise_s + self.hold_s + self.fall_s

    def profile(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the press without tremor at times t, s: 0 to 1, times 1 + creep."""
        since = t - self.start_s
        rise = np.clip(since / self.rise_s, 0, 1)
        fall = np.clip((self.stop_s - t) / self.fall_s, 0, 1)
        creep = 1 + self.creep * np.clip((since - self.rise_s) / self.hold_s, 0, 1)
        return np.asarray(0.5 * (1 - np.cos(np.pi * np.minimum(rise, fall))) * creep)

    def ratio(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the ratio of this press at times t, s."""
        starts = self.start_s + np.array([after for after, _ in self.ratios])
        values = np.array([value for _, value in self.ratios])
        ratio = values[np.clip(np.searchsorted(starts, t, "right") - 1, 0, None)]
        if self.relaxes:
            ratio = ratio * (1 + self.relaxes * np.expm1(-np.maximum(t - self.start_s, 0) / self.relaxation_s))
        return np.asarray(ratio)
