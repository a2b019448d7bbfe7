"""From capacitance to readings: baselines, the converter and its time stamps, disturbances."""

from collections.abc import Callable
from dataclasses import dataclass
from math import exp, inf, sqrt

import numpy as np
from numpy.random import Generator

from palpate.ad7746.registers import CODES_PER_PF, CONVERSION_S, LAST_CODE, NOISE_PF, ZERO_CODE
from palpate.simulation.signals import (
    Array,
    Codes,
    Course,
    Mask,
    recursion,
    require_positive,
    require_within,
)

_STEP_S = 0.01  # largest step of the grid of the wander


@dataclass(frozen=True)
class BaselineModel:
    """Baseline of one channel. The truth is the ratio of the changes from it.

    Attributes
    ----------
    level_pF : float
        Capacitance at the beginning.
    drift_pF_per_s, drift_from_s : float
        Linear drift, from this time on.
    wander_pF, wander_s : float
        Low-pass noise: its rms and its time constant. For times t much shorter than wander_s it is
        a random walk with a standard deviation of wander_pF * sqrt(2 t / wander_s).
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
    >>> baseline = BaselineModel(0.5, drift_pF_per_s=0.01)
    >>> baseline.course(2.0, 10.0, np.random.default_rng(0))(np.array([1.0, 5.0]), 0.011)
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
        require_within(
            0, inf, drift_from_s=self.drift_from_s, wander_pF=self.wander_pF, jump_s=self.jump_s
        )
        require_positive(wander_s=self.wander_s, thermal_s=self.thermal_s)

    def course(
        self, contact_s: float, duration_s: float, random: Generator
    ) -> Callable[[Array, float], Array]:
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
            (middles, span): mean during conversions with these middles, s, shape (n,), that last
            span, s.
        """
        wander = self._wander(duration_s, random) if self.wander_pF else None

        def mean_pF(middles: Array, span_s: float) -> Array:
            drifting_s = np.maximum(middles - self.drift_from_s, 0)
            mean = self.level_pF + self.drift_pF_per_s * drifting_s
            if wander:
                mean += np.interp(middles, *wander)
            if self.jump_pF:
                after = (middles - self.jump_s) / span_s + 0.5
                mean += self.jump_pF * np.clip(after, 0, 1)
            if self.thermal_pF:
                since = np.maximum(middles - contact_s, 0)
                approach = np.expm1(-since / self.thermal_s)
                mean -= self.thermal_pF * approach
            return mean

        return mean_pF

    def _wander(self, duration_s: float, random: Generator) -> tuple[Array, Array]:
        step_s = min(_STEP_S, self.wander_s / 10)
        count = int(duration_s / step_s) + 2
        shocks = self.wander_pF * random.standard_normal(count)
        pole = exp(-step_s / self.wander_s)
        shocks[1:] *= sqrt(1 - pole**2)  # stationary from the beginning
        times = step_s * np.arange(float(count))
        return times, recursion(shocks, pole)


@dataclass(frozen=True)
class ConverterModel:
    """Speed, noise and resolution of the conversions.

    Attributes
    ----------
    capf : int
        Speed of the AD7746, 0 to 7; it gives the duration and the noise of a conversion.
    bus_s, jitter_s : float
        Time between two conversions, and its random part, which is real: it adds up.
    together : bool
        The two channels are converted at the same time (two converters), not in turn.
    conversion_s, noise_pF : float, optional
        Duration and rms noise of a conversion of another converter.
    code_pF : float
        Step of the codes of a coarser converter; 0: 24 bits.

    Raises
    ------
    ValueError
        A value is outside its range.

    Examples
    --------
    >>> ConverterModel().period_s
    0.026
    >>> ConverterModel(together=True, conversion_s=0.0009, bus_s=0.0001).period_s
    0.001
    """

    capf: int = 0
    bus_s: float = 0.002
    jitter_s: float = 0.0002
    together: bool = False
    conversion_s: float | None = None
    noise_pF: float | None = None
    code_pF: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        require_within(0, len(CONVERSION_S) - 1, capf=self.capf)
        require_within(0, inf, bus_s=self.bus_s, jitter_s=self.jitter_s, code_pF=self.code_pF)
        if self.conversion_s is not None:
            require_positive(conversion_s=self.conversion_s)
        if self.noise_pF is not None:
            require_within(0, inf, noise_pF=self.noise_pF)

    @property
    def span_s(self) -> float:
        """Duration of a conversion, s."""
        if self.conversion_s is None:
            return CONVERSION_S[self.capf]
        return self.conversion_s

    @property
    def rms_pF(self) -> float:
        """Noise of a conversion, pF rms."""
        if self.noise_pF is None:
            return NOISE_PF[self.capf]
        return self.noise_pF

    @property
    def step_s(self) -> float:
        """Mean time from one conversion of this bus to the next, s."""
        return self.span_s + self.bus_s

    @property
    def period_s(self) -> float:
        """Mean time from pair to pair, s."""
        if self.together:
            return self.step_s
        return 2 * self.step_s

    def middles(self, duration_s: float, random: Generator) -> tuple[Array, Array]:
        """Return the middles of the conversions of the hard and the soft channel, s, shape (n,)."""
        count = int(duration_s / self.period_s)
        if not self.together:
            count *= 2
        jitter = random.uniform(-1, 1, count)
        steps = self.step_s + self.jitter_s * jitter
        middles = np.cumsum(steps) - self.span_s / 2
        if self.together:
            return middles, middles
        return middles[0::2], middles[1::2]

    def codes(self, capacitance: Array) -> Codes:
        """Return the 24-bit codes of capacitances, pF, with the ends of the range as limits."""
        if self.code_pF:
            capacitance = self.code_pF * np.rint(capacitance / self.code_pF)
        codes = np.rint(capacitance * CODES_PER_PF).astype(int) + ZERO_CODE
        return np.asarray(np.clip(codes, 0, LAST_CODE))


@dataclass(frozen=True)
class Stamps:
    """Errors of the reported times; the conversions and the truth keep their real times.

    Attributes
    ----------
    host_s : float
        The host dates each conversion (each pair, if the channels are converted together) when it
        gets it: error of up to this, uniform, of either sign.
    skew_s : float
        Constant error of the times of the soft channel.

    Raises
    ------
    ValueError
        A value is outside its range.

    Examples
    --------
    >>> times = np.array([1.0, 2.0])
    >>> Stamps(skew_s=0.5).reported(times, times, np.random.default_rng(0))
    (array([1., 2.]), array([1.5, 2.5]))
    """

    host_s: float = 0.0
    skew_s: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        require_within(0, inf, host_s=self.host_s)

    def reported(self, hard: Array, soft: Array, random: Generator) -> tuple[Array, Array]:
        """Return the reported times of both channels, s, from the real ones, shape (n,).

        The channels share a stamp if both arrays are the same object.
        """
        together = hard is soft
        if self.host_s:
            hard = hard + self._late(hard.size, random)
            if together:
                soft = hard
            else:
                soft = soft + self._late(soft.size, random)
        if self.skew_s:
            soft = soft + self.skew_s
        return hard, soft

    def _late(self, count: int, random: Generator) -> Array:
        return self.host_s * random.uniform(-1, 1, count)


@dataclass(frozen=True)
class Faults:
    """Disturbances of the readings.

    Attributes
    ----------
    lost : float
        Share of lost conversions, 0 to 1 (below 1 in runs).
    lost_run : float
        They are lost in runs with this mean number of conversions, 1 or more, both channels
        counted; 0: each at random.
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
        require_within(0, 1, lost=self.lost)
        require_within(
            0,
            inf,
            spikes_per_s=self.spikes_per_s,
            spike_pF=self.spike_pF,
            bursts_per_s=self.bursts_per_s,
            burst_s=self.burst_s,
            burst_factor=self.burst_factor,
            pickup_pF=self.pickup_pF,
        )
        require_positive(pickup_Hz=self.pickup_Hz)
        if self.lost_run == 0:
            return
        if not 1 <= self.lost_run < inf:
            raise ValueError(f"lost_run: got {self.lost_run}, allowed: 0, or 1 or more")
        limit = self.lost_run / (1 + self.lost_run)
        if not self.lost <= limit:
            allowed = f"at most {limit:.3g} with lost_run {self.lost_run}"
            raise ValueError(f"lost: got {self.lost}, allowed: {allowed}")

    @property
    def begin_run(self) -> float:
        """Probability that a run begins after a good conversion: lost / ((1 - lost) lost_run)."""
        return self.lost / ((1 - self.lost) * self.lost_run)

    def lost_in_runs(self, count: int, random: Generator) -> Mask:
        """Return which conversions, in order, are lost in runs; bool, shape (count,)."""
        if not self.lost:
            return np.zeros(count, bool)
        runs = count // 2 + 1  # every good and every lost run has one conversion or more
        good = random.geometric(self.begin_run, runs)
        lost = random.geometric(1 / self.lost_run, runs)
        begins_lost = random.random() < self.lost
        lengths = np.stack((lost, good) if begins_lost else (good, lost), axis=1)
        states = np.tile([begins_lost, not begins_lost], runs)
        return np.repeat(states, np.minimum(lengths.ravel(), count))[:count]

    def burst_noise(self, duration_s: float, random: Generator) -> Course:
        """Return the factor on the noise at times, s: `burst_factor` in a burst, otherwise 1."""
        count = random.poisson(self.bursts_per_s * duration_s)
        starts = random.uniform(0, duration_s, count)

        def factor(t: Array) -> Array:
            times = t[:, None]
            inside = (times >= starts) & (times < starts + self.burst_s)
            return np.where(inside.any(axis=1), self.burst_factor, 1.0)

        return factor

    def pickup(self, phase: float, middles: Array, span_s: float) -> Array:
        """Return the mean of the picked-up sine during conversions, pF, shape (n,).

        The mean of a sine over a span T is its value in the middle times sin(pi f T) / (pi f T).
        """
        share = self.pickup_pF * np.sinc(self.pickup_Hz * span_s)
        angle = 2 * np.pi * self.pickup_Hz * middles + phase
        return share * np.sin(angle)
