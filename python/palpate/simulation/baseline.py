"""Baseline of a channel: its capacitance without contact, and how it changes."""

from collections.abc import Callable
from dataclasses import dataclass
from math import exp, inf, sqrt

import numpy as np
from numpy.typing import NDArray

from palpate.simulation.first_order import recursion
from palpate.simulation.ranges import positive, within

_STEP_S = 0.01  # largest step of the grid of the wander


@dataclass(frozen=True)
class Baseline:
    """Baseline of one channel. The truth is the ratio of the changes from it.

    Attributes
    ----------
    level_pF : float
        Capacitance at the beginning.
    drift_pF_per_s, drift_from_s : float
        Linear drift, from this time on.
    wander_pF, wander_s : float
        Low-pass noise: its rms and its time constant. For times t much shorter than wander_s it is a random walk with
        a standard deviation of wander_pF * sqrt(2 t / wander_s).
    jump_pF, jump_s : float
        A jump, and its time.
    thermal_pF, thermal_s : float
        Exponential approach to this change, with this time constant, from the first contact on.

    Raises
    ------
    ValueError
        A value is outside its range.

    Examples
    --------
    >>> course = Baseline(0.5, drift_pF_per_s=0.01).course(2.0, 10.0, np.random.default_rng(0))
    >>> course(np.array([1.0, 5.0]), 0.011)
    array([0.51, 0.55])
    """

    level_pF: float = 0.0
    drift_pF_per_s: float = 0.0
    drift_from_s: float = 0.0
    wander_pF: float = 0.0
    wander_s: float = 1.0
    jump_pF: float = 0.0
    jump_s: float = 0.0
    thermal_pF: float = 0.0
    thermal_s: float = 1.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        within(self, 0, inf, "drift_from_s", "wander_pF", "jump_s")
        positive(self, "wander_s", "thermal_s")

    def course(
        self, contact_s: float, duration_s: float, random: np.random.Generator
    ) -> Callable[[NDArray[np.float64], float], NDArray[np.float64]]:
        """Return the baseline as a function of time.

        Parameters
        ----------
        contact_s : float
            First contact; inf: none.
        duration_s : float
            Length of the wander; later it stands still.
        random : numpy.random.Generator
            For the wander.

        Returns
        -------
        callable
            (middles, span): mean during conversions with these middles, s, shape (n,), that last span, s.
        """
        wander = self._wander(duration_s, random) if self.wander_pF else None

        def mean_pF(middles: NDArray[np.float64], span_s: float) -> NDArray[np.float64]:
            mean = self.level_pF + self.drift_pF_per_s * np.maximum(middles - self.drift_from_s, 0)
            if wander:
                mean += np.interp(middles, *wander)
            if self.jump_pF:
                mean += self.jump_pF * np.clip((middles - self.jump_s) / span_s + 0.5, 0, 1)
            if self.thermal_pF:
                mean -= self.thermal_pF * np.expm1(-np.maximum(middles - contact_s, 0) / self.thermal_s)
            return np.asarray(mean)

        return mean_pF

    def _wander(
        self, duration_s: float, random: np.random.Generator
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        step_s = min(_STEP_S, self.wander_s / 10)
        shocks = self.wander_pF * random.standard_normal(int(duration_s / step_s) + 2)
        pole = exp(-step_s / self.wander_s)
        shocks[1:] *= sqrt(1 - pole**2)  # stationary from the beginning
        return np.asarray(step_s * np.arange(len(shocks))), recursion(shocks, pole)
