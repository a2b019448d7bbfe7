"""Tools of all parts of the simulation: checks, random numbers, filters, tremor."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

Array = NDArray[np.float64]
Codes = NDArray[np.int64]
Mask = NDArray[np.bool_]
Course = Callable[[Array], Array]
"""A value at times, s."""


def require_within(low: float, high: float, **settings: float | tuple[float, ...]) -> None:
    """Check that settings, or all parts of them, are in a closed range."""
    allowed = f"{low:g} to {high:g}"
    if math.isinf(high):
        allowed = f"{low:g} or more"
    for name, value in settings.items():
        parts = value if isinstance(value, tuple) else (value,)
        if not all(low <= part <= high for part in parts):
            raise ValueError(f"{name}: got {value}, allowed: {allowed}")


def require_positive(**settings: float) -> None:
    """Check that settings are finite and above 0."""
    for name, value in settings.items():
        if not 0 < value < math.inf:
            raise ValueError(f"{name}: got {value}, allowed: a finite number above 0")


def random_of(seed: int, effect: str) -> Generator:
    """Return the random generator of one effect, so that no effect changes another one's numbers."""
    return np.random.default_rng([seed, *effect.encode()])


_NEGLIGIBLE = 1e-18


def recursion(start: Array, pole: float) -> Array:
    """Return y with y(n) = pole y(n - 1) + start(n), y(0) = start(0)."""
    # The recursion is 1 / (1 - a L) with the lag operator L, and
    # 1 / (1 - a L) = (1 + a L) (1 + a^2 L^2) (1 + a^4 L^4) ...: log2(n) passes over the array.
    y = start.copy()
    shift = 1
    while shift < len(y) and pole > _NEGLIGIBLE:
        y[shift:] += pole * y[:-shift]
        pole *= pole
        shift *= 2
    return y


def follow(x: Array, step_s: float, constant_s: float) -> Array:
    """Return y with constant_s y' = x - y, y(0) = x(0); x is linear between its points."""
    # Over a step h, with a = exp(-h / tau) and g = (1 - a) tau / h:
    # y(n) = a y(n - 1) + (1 - g) x(n) + (g - a) x(n - 1), which is exact.
    exponent = -step_s / constant_s
    pole = math.exp(exponent)
    mean = -math.expm1(exponent) * constant_s / step_s
    start = (1 - mean) * x
    start[1:] += (mean - pole) * x[:-1]
    start[:1] = x[:1]
    return recursion(start, pole)


# band of physiological tremor
LOWEST_HZ = 3.0
HIGHEST_HZ = 12.0
SWAY_HZ = (0.1, 1.0)  # band of the sway


def _sines(frequencies: Array, random: Generator, sizes: Array | float = 1.0) -> Course:
    """Return a sum of sines with random phases and amplitudes, with a long-time rms of 1."""
    count = frequencies.size
    phases = random.uniform(0, 2 * np.pi, count)
    amplitudes = random.rayleigh(1.0, count) * sizes
    mean_square = (amplitudes**2).sum() / 2
    amplitudes = amplitudes / np.sqrt(mean_square)

    def course(t: Array) -> Array:
        total = np.zeros_like(t)
        for amplitude, frequency, phase in zip(amplitudes, frequencies, phases, strict=True):
            angle = 2 * np.pi * frequency * t + phase
            total += amplitude * np.sin(angle)
        return total

    return course


@dataclass(frozen=True)
class Peaks:
    """Sines with frequencies around two random, broad peaks between 3 and 12 Hz.

    Frequencies of physiological tremor: 8-12 Hz neurogenic, 3-5 Hz of the loaded wrist (Elble and
    Koller, Tremor, 1990).
    """

    def course(self, random: Generator) -> Course:
        """Return the tremor as a function of time."""
        low = random.uniform(3.5, 5.0)
        high = random.uniform(7.0, 10.0)
        spread = np.repeat([low, high], 12) + random.normal(0.0, 0.8, 24)
        frequencies = np.clip(spread, LOWEST_HZ, HIGHEST_HZ)
        sizes = np.repeat([0.6, 1.0], 12)
        return _sines(frequencies, random, sizes)


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
        Rms of the part from 0.1 to 1 Hz, relative to the rms of the lines; it is added to them.
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
        require_within(LOWEST_HZ, HIGHEST_HZ, lines_Hz=self.lines_Hz)
        require_within(0, np.inf, width_Hz=self.width_Hz, sway=self.sway)
        require_within(1, np.inf, sines=self.sines)

    def course(self, random: Generator) -> Course:
        """Return the tremor as a function of time."""
        middles = np.repeat(self.lines_Hz, self.sines)
        spread = middles + self.width_Hz * random.standard_normal(middles.size)
        frequencies = np.clip(spread, LOWEST_HZ, HIGHEST_HZ)
        lines = _sines(frequencies, random)
        if not self.sway:
            return lines
        slow = random.uniform(*SWAY_HZ, self.sines)
        sway = _sines(slow, random)
        return lambda t: lines(t) + self.sway * sway(t)


Spectrum = Peaks | Lines
