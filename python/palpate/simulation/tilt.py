"""Tilt of the probe: it changes the ratio from touch to touch, and during a touch."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.simulation.ranges import positive, within

_STEP_S = 0.01  # grid of the walk


@dataclass(frozen=True)
class Tilt:
    """How a tilt of the probe changes the ratio. The truth is the changed ratio.

    Attributes
    ----------
    oblique : float
        Standard deviation of a random factor on the ratio, one for each press.
    ramp_per_s : float, 1/s
        Relative change of the ratio per second of a touch.
    rock, rock_Hz : float, Hz
        Rocking: the ratio follows a sine with this relative amplitude, from 0 at contact.
    walk : float, 1/sqrt(s)
        Random walk: standard deviation of the relative change of the ratio after one second of a touch.

    Raises
    ------
    ValueError
        A value is outside its range.

    Examples
    --------
    >>> Tilting(Tilt(ramp_per_s=0.01), 10.0, np.random.default_rng(0)).factor(2.0, np.array([2.0, 5.0]))
    array([1.  , 1.03])
    """

    oblique: float = 0.0
    ramp_per_s: float = 0.0
    rock: float = 0.0
    rock_Hz: float = 0.5
    walk: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        within(self, 0, np.inf, "oblique", "rock", "walk")
        positive(self, "rock_Hz")


class Tilting:
    """The tilt as a function of time.

    Parameters
    ----------
    tilt : Tilt
    duration_s : float
        Length of the walk; later it stands still.
    random : numpy.random.Generator
        For the walk.
    """

    def __init__(self, tilt: Tilt, duration_s: float, random: np.random.Generator) -> None:
        self._tilt = tilt
        if tilt.walk:
            steps = random.standard_normal(int(duration_s / _STEP_S) + 1)
            self._times = _STEP_S * np.arange(len(steps) + 1)
            self._walk = tilt.walk * np.sqrt(_STEP_S) * np.cumsum(np.append(0.0, steps))

    def factor(self, start_s: float, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the factor on the ratio at times t, s, of a press that begins at start_s."""
        since = np.clip(t - start_s, 0, None)
        factor = 1 + self._tilt.ramp_per_s * since
        if self._tilt.rock:
            factor *= 1 + self._tilt.rock * np.sin(2 * np.pi * self._tilt.rock_Hz * since)
        if self._tilt.walk:
            begin = np.interp(start_s, self._times, self._walk)
            factor *= 1 + np.interp(start_s + since, self._times, self._walk) - begin
        return np.asarray(factor)
