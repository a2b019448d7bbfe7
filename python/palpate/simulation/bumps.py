"""The two bumps and their gauges: from forces to changes of the capacitances."""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from palpate.simulation.first_order import follow
from palpate.simulation.ranges import positive, within

# Grids: a lag keeps the tremor, of which a line between two points loses (2 pi 12 Hz step)^2 / 12 = 5e-4 at 12 Hz;
# creep is slow.
_LAG_STEP_S, _CREEP_STEP_S = 0.001, 0.005


@dataclass(frozen=True)
class Bumps:
    """How the two bumps touch the object. The truth is the ratio of level bumps without cross-talk.

    Attributes
    ----------
    offset : float
        One bump is reached first: by this share of the depth, the soft bump if above 0, the hard bump if below.
        With c0 = offset * depth_pF: C1 = r (C2 - c0).
    bottoms_pF : (float, float), pF
        Largest force of the hard and the soft bump, which bottoms out there, as a capacitance of a linear gauge.
    cross_talk : float
        Share of the capacitance change of each channel that is added to the other.

    Raises
    ------
    ValueError
        A value is outside its range.

    Examples
    --------
    >>> Bumps(offset=0.02).force(np.array([0.0, 0.005, 0.25]), 0.25, 3.0, hard=True).round(3)
    array([0.   , 0.   , 0.735])
    """

    offset: float = 0.0
    bottoms_pF: tuple[float, float] = (inf, inf)
    cross_talk: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        within(self, -1, 1, "offset")
        within(self, 0, inf, "bottoms_pF")
        within(self, 0, 1, "cross_talk")

    def force(
        self, press: NDArray[np.float64], depth_pF: float, ratio: NDArray[np.float64] | float, *, hard: bool
    ) -> NDArray[np.float64]:
        """Return the force of one bump.

        Parameters
        ----------
        press : numpy.ndarray, pF
            Force of the soft bump if it is reached first or the bumps are level.
        depth_pF : float, pF
            Its value during the hold.
        ratio : numpy.ndarray or float
            Ratio of level bumps.
        hard : bool
            Which bump.

        Returns
        -------
        numpy.ndarray, pF
        """
        gap = max(self.offset if hard else -self.offset, 0.0) * depth_pF
        reached = np.maximum(press - gap, 0) if gap else press
        force = reached * ratio if hard else reached
        limit = self.bottoms_pF[0 if hard else 1]
        return np.minimum(force, limit) if limit < inf else force


@dataclass(frozen=True)
class Gauge:
    """How the capacitance of one bump follows its force f, here in pF of a linear gauge.

    c = f (f / reference)^(exponent - 1) (1 + quadratic f) / (1 + quadratic reference): at the reference force, where
    the gauge was calibrated, c = f. The truth is the ratio of the forces.

    Attributes
    ----------
    exponent : float, above 0
        Other than 1 only with a reference force.
    quadratic_per_pF : float, 1/pF
    reference_pF : float, pF
        Force of the calibration; 0: the limit of small forces.
    creep, creep_s : float
        Standard linear solid: after a step of the force the bump goes on by this share of it, with this time constant, s.
    lag_s : float, s
        First-order lag of the bump behind its force.

    Raises
    ------
    ValueError
        A value is outside its range.

    Examples
    --------
    >>> Gauge(exponent=0.9, reference_pF=0.5).curve(np.array([0.25, 0.5])).round(3)
    array([0.268, 0.5  ])
    """

    exponent: float = 1.0
    quadratic_per_pF: float = 0.0
    reference_pF: float = 0.0
    creep: float = 0.0
    creep_s: float = 5.0
    lag_s: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        positive(self, "exponent", "creep_s")
        within(self, 0, inf, "reference_pF", "lag_s")
        if self.exponent != 1 and not self.reference_pF:
            raise ValueError(f"reference_pF: got 0 with exponent {self.exponent}, allowed: above 0, or exponent 1")

    def curve(self, force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the capacitance change, pF, at constant forces, pF."""
        change = force * (1 + self.quadratic_per_pF * force) / (1 + self.quadratic_per_pF * self.reference_pF)
        if self.exponent != 1:
            # 0^(p - 1) is infinite for p below 1; the smallest normal number keeps 0 * x^(p - 1) at 0.
            share = np.maximum(force / self.reference_pF, np.finfo(float).tiny)
            change *= share ** (self.exponent - 1)
        return np.asarray(change)


class Gauged:
    """The capacitance change of one bump as a function of time.

    Parameters
    ----------
    gauge : Gauge
    force : callable
        (times, s) -> force, pF.
    duration_s : float
        Creep and lag are known until then; later they stand still.
    """

    def __init__(
        self, gauge: Gauge, force: Callable[[NDArray[np.float64]], NDArray[np.float64]], duration_s: float
    ) -> None:
        self._gauge = gauge
        self._force = force
        if not (gauge.creep or gauge.lag_s):
            return
        step_s = _LAG_STEP_S if gauge.lag_s else min(_CREEP_STEP_S, gauge.creep_s / 10)
        self._times = np.asarray(step_s * np.arange(int(duration_s / step_s) + 2))
        self._lagged = force(self._times)
        if gauge.lag_s:
            self._lagged = follow(self._lagged, step_s, gauge.lag_s)
        self._crept = gauge.creep * follow(self._lagged, step_s, gauge.creep_s)

    def __call__(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the capacitance change, pF, at times t, s."""
        gauge = self._gauge
        moved = np.interp(t, self._times, self._lagged) if gauge.lag_s else self._force(t)
        if gauge.creep:
            moved = moved + np.interp(t, self._times, self._crept)
        return gauge.curve(moved)
