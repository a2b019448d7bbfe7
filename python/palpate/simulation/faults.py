"""Disturbances of the readings: lost conversions, interference, pickup of the mains."""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from palpate.simulation.ranges import positive, within


@dataclass(frozen=True)
class Faults:
    """Disturbances of the readings.

    Attributes
    ----------
    lost : float
        Share of lost conversions, 0 to 1 (below 1 in runs).
    lost_run : float
        They are lost in runs with this mean number of conversions, 1 or more, both channels counted; 0: each at random.
    spikes_per_s, spike_pF : float
        Number of disturbed conversions per second, and the size of the disturbance, of either sign.
    bursts_per_s, burst_s, burst_factor : float
        Noise bursts: number per second, duration, and factor on the noise of the converter.
    pickup_pF, pickup_Hz : float
        Sine that both inputs pick up; a conversion averages it.

    Raises
    ------
    ValueError
        A value is outside its range.

    Examples
    --------
    >>> Faults(lost=0.5, lost_run=4.0).begin_run
    0.25
    """

    lost: float = 0.0
    lost_run: float = 0.0
    spikes_per_s: float = 0.0
    spike_pF: float = 0.0
    bursts_per_s: float = 0.0
    burst_s: float = 0.3
    burst_factor: float = 10.0
    pickup_pF: float = 0.0
    pickup_Hz: float = 50.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        within(self, 0, 1, "lost")
        within(self, 0, inf, "spikes_per_s", "spike_pF", "bursts_per_s", "burst_s", "burst_factor", "pickup_pF")
        positive(self, "pickup_Hz")
        if not (self.lost_run == 0 or 1 <= self.lost_run < inf):
            raise ValueError(f"lost_run: got {self.lost_run}, allowed: 0, or 1 or more")
        if self.lost_run and not self.lost <= self.lost_run / (1 + self.lost_run):
            limit = self.lost_run / (1 + self.lost_run)
            raise ValueError(f"lost: got {self.lost}, allowed: at most {limit:.3g} with lost_run {self.lost_run}")

    @property
    def begin_run(self) -> float:
        """Probability that a run of lost conversions begins after a good one: lost / ((1 - lost) lost_run)."""
        return self.lost / ((1 - self.lost) * self.lost_run)

    def lost_in_runs(self, count: int, random: np.random.Generator) -> NDArray[np.bool_]:
        """Return which of `count` conversions, in the order of time, are lost in runs; bool, shape (count,)."""
        if not self.lost:
            return np.zeros(count, bool)
        runs = count // 2 + 1  # every good and every lost run has one conversion or more
        lengths = np.stack((random.geometric(self.begin_run, runs), random.geometric(1 / self.lost_run, runs)), axis=1)
        good, lost = np.array([False, True]), random.random() < self.lost
        states, lengths = (good[::-1], lengths[:, ::-1]) if lost else (good, lengths)
        return np.repeat(np.tile(states, runs), np.minimum(lengths.ravel(), count))[:count]

    def burst_noise(
        self, duration_s: float, random: np.random.Generator
    ) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
        """Return the factor on the noise as a function of time, s: `burst_factor` in a burst, otherwise 1."""
        starts = random.uniform(0, duration_s, random.poisson(self.bursts_per_s * duration_s))

        def factor(t: NDArray[np.float64]) -> NDArray[np.float64]:
            inside = ((t[:, None] >= starts) & (t[:, None] < starts + self.burst_s)).any(axis=1)
            return np.where(inside, self.burst_factor, 1.0)

        return factor

    def pickup(self, phase: float, middles: NDArray[np.float64], span_s: float) -> NDArray[np.float64]:
        """Return the mean of the picked-up sine during conversions, pF, shape (n,).

        The mean of a sine over a span T is its value in the middle times sin(pi f T) / (pi f T).
        """
        share = self.pickup_pF * np.sinc(self.pickup_Hz * span_s)
        return np.asarray(share * np.sin(2 * np.pi * self.pickup_Hz * middles + phase))
