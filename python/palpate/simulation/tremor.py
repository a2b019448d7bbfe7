"""Spectra of the hand tremor: two broad peaks, narrow lines with sway, or a record of an accelerometer."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate.simulation.ranges import within

LOWEST_HZ, HIGHEST_HZ = 3.0, 12.0
"""Band of physiological tremor."""
SWAY_HZ = (0.1, 1.0)
"""Band of the sway."""

Course = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Times, s -> tremor with an rms of 1."""


class Sines:
    """A sum of sines with an rms of 1 over a long time.

    Parameters
    ----------
    frequencies, phases, amplitudes : numpy.ndarray, shape (n,)
        Hz; rad; in any unit.
    """

    def __init__(
        self, frequencies: NDArray[np.float64], phases: NDArray[np.float64], amplitudes: NDArray[np.float64]
    ) -> None:
        self._frequencies = frequencies
        self._phases = phases
        self._amplitudes = amplitudes / np.sqrt((amplitudes**2).sum() / 2)

    def __call__(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the sum at times t, s."""
        total = np.zeros_like(t)
        for amplitude, frequency, phase in zip(self._amplitudes, self._frequencies, self._phases, strict=True):
            total += amplitude * np.sin(2 * np.pi * frequency * t + phase)
        return total


@dataclass(frozen=True)
class Peaks:
    """Sines with frequencies around two random, broad peaks between 3 and 12 Hz.

    Frequencies of physiological tremor: 8-12 Hz neurogenic, 3-5 Hz of the loaded wrist (Elble and Koller, Tremor,
    1990).
    """

    def course(self, random: np.random.Generator) -> Course:
        """Return the tremor as a function of time."""
        peaks = np.repeat([random.uniform(3.5, 5.0), random.uniform(7.0, 10.0)], 12)
        frequencies = np.clip(peaks + random.normal(0.0, 0.8, 24), LOWEST_HZ, HIGHEST_HZ)
        phases = random.uniform(0, 2 * np.pi, 24)
        return Sines(frequencies, phases, random.rayleigh(1.0, 24) * np.repeat([0.6, 1.0], 12))


@dataclass(frozen=True)
class Lines:
    """Lines with a width (narrow-band noise: sines close to each other), and sway.

    Attributes
    ----------
    lines_Hz : tuple of float, Hz
        Middle of each line, 3 to 12.
    width_Hz : float, Hz
        Standard deviation of the frequencies in a line. All are limited to 3 to 12 Hz.
    sway : float
        Rms of the part from 0.1 to 1 Hz, relative to the rms of the lines; it comes in addition.
    sines : int
        Number of sines of each line, and of the sway.

    Raises
    ------
    ValueError
        A value is outside its range.

    Examples
    --------
    >>> Lines((8.0,), sway=0.0).course(np.random.default_rng(1))(np.array([0.0])).shape
    (1,)
    """

    lines_Hz: tuple[float, ...] = (4.0, 9.0)
    width_Hz: float = 0.4
    sway: float = 0.5
    sines: int = 12

    def __post_init__(self) -> None:
        """Check the ranges."""
        within(self, LOWEST_HZ, HIGHEST_HZ, "lines_Hz")
        within(self, 0, np.inf, "width_Hz", "sway")
        within(self, 1, np.inf, "sines")

    def course(self, random: np.random.Generator) -> Course:
        """Return the tremor as a function of time."""
        middles = np.repeat(self.lines_Hz, self.sines)
        spread = middles + self.width_Hz * random.standard_normal(middles.size)
        lines = self._sum(np.clip(spread, LOWEST_HZ, HIGHEST_HZ), random)
        if not self.sway:
            return lines
        sway = self._sum(random.uniform(*SWAY_HZ, self.sines), random)
        return lambda t: lines(t) + self.sway * sway(t)

    @staticmethod
    def _sum(frequencies: NDArray[np.float64], random: np.random.Generator) -> Sines:
        count = frequencies.size
        return Sines(frequencies, random.uniform(0, 2 * np.pi, count), random.rayleigh(1.0, count))


@dataclass(frozen=True)
class Record:
    """A measured record, repeated.

    Attributes
    ----------
    time_s, values : array_like, shape (n,)
        Increasing times, s, and an acceleration in any unit.
    """

    time_s: ArrayLike
    values: ArrayLike

    def course(self, _: np.random.Generator) -> Course:
        """Return the record as a function of time."""
        times, values = np.asarray(self.time_s, float), np.asarray(self.values, float)
        values = (values - values.mean()) / values.std()
        span = times[-1] - times[0]
        return lambda t: np.interp(times[0] + np.mod(t, span), times, values)


Spectrum = Peaks | Lines | Record
