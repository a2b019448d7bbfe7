"""The converter and its bus: when conversions happen, and which times and codes are reported."""

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from palpate.ad7746.datasheet import CODES_PER_PF, CONVERSION_S, NOISE_PF, ZERO_CODE
from palpate.simulation.ranges import positive, within


@dataclass(frozen=True)
class Converter:
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
    >>> Converter().period_s, Converter(together=True, conversion_s=0.0009, bus_s=0.0001).period_s
    (0.026, 0.001)
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
        within(self, 0, len(CONVERSION_S) - 1, "capf")
        within(self, 0, inf, "bus_s", "jitter_s", "code_pF")
        if self.conversion_s is not None:
            positive(self, "conversion_s")
        if self.noise_pF is not None:
            within(self, 0, inf, "noise_pF")

    @property
    def span_s(self) -> float:
        """Duration of a conversion, s."""
        return CONVERSION_S[self.capf] if self.conversion_s is None else self.conversion_s

    @property
    def rms_pF(self) -> float:
        """Noise of a conversion, pF rms."""
        return NOISE_PF[self.capf] if self.noise_pF is None else self.noise_pF

    @property
    def step_s(self) -> float:
        """Mean time from one conversion of this bus to the next, s."""
        return self.span_s + self.bus_s

    @property
    def period_s(self) -> float:
        """Mean time from pair to pair, s."""
        return self.step_s if self.together else 2 * self.step_s

    def middles(
        self, duration_s: float, random: np.random.Generator
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the middles of the conversions of the hard and the soft channel, s, each of shape (n,)."""
        pairs = int(duration_s / self.period_s)
        count = pairs if self.together else 2 * pairs
        steps = self.step_s + self.jitter_s * random.uniform(-1, 1, count)
        middles = np.cumsum(steps) - self.span_s / 2
        return (middles, middles) if self.together else (middles[0::2], middles[1::2])

    def codes(self, capacitance: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the 24-bit codes of capacitances, pF, with the ends of the range as limits."""
        if self.code_pF:
            capacitance = self.code_pF * np.rint(capacitance / self.code_pF)
        return np.asarray(np.clip(np.rint(capacitance * CODES_PER_PF).astype(int) + ZERO_CODE, 0, 2**24 - 1))


@dataclass(frozen=True)
class Stamps:
    """Errors of the reported times; the conversions and the truth keep their real times.

    Attributes
    ----------
    host_s : float
        The host dates each conversion (each pair, if the channels are converted together) when it gets it: error of up
        to this, uniform, of either sign.
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
        within(self, 0, inf, "host_s")

    def reported(
        self, hard: NDArray[np.float64], soft: NDArray[np.float64], random: np.random.Generator
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the reported times of both channels, s, from the real ones, shape (n,); equal arrays share a stamp."""
        if self.host_s:
            together = hard is soft
            hard = hard + self.host_s * random.uniform(-1, 1, hard.size)
            soft = hard if together else soft + self.host_s * random.uniform(-1, 1, soft.size)
        return hard, (soft + self.skew_s if self.skew_s else soft)
