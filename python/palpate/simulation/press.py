"""What a hand does: presses, tilt of the probe, spectra of the tremor."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def within(settings: object, low: float, high: float, *names: str) -> None:
    """Check that attributes are in a closed range."""
    allowed = f"{low:g} or more" if math.isinf(high) else f"{low:g} to {high:g}"
    for name in names:
        value = getattr(settings, name)
        if not all(
            low <= part <= high for part in (value if isinstance(value, tuple) else (value,))
        ):
            raise ValueError(f"{name}: got {value}, allowed: {allowed}")


def positive(settings: object, *names: str) -> None:
    """Check that attributes are finite and above 0."""
    for name in names:
        value = getattr(settings, name)
        if not 0 < value < math.inf:
            raise ValueError(f"{name}: got {value}, allowed: a finite number above 0")


def stream(seed: int, effect: str) -> np.random.Generator:
    """Return the random numbers of one effect: switching an effect on changes no random number of another effect."""
    return np.random.default_rng([seed, *effect.encode()])


_NEGLIGIBLE = 1e-18


def recursion(start: Array, pole: float) -> Array:
    """Return y with y(n) = pole y(n - 1) + start(n), y(0) = start(0)."""
    # The recursion is 1 / (1 - a L) with the lag operator L, and 1 / (1 - a L) = (1 + a L) (1 + a^2 L^2) (1 + a^4 L^4)
    # ...: log2(n) passes over the array.
    y, shift = start.copy(), 1
    while shift < len(y) and pole > _NEGLIGIBLE:
        y[shift:] += pole * y[:-shift]
        pole, shift = pole * pole, 2 * shift
    return y


def follow(x: Array, step_s: float, constant_s: float) -> Array:
    """Return y with constant_s y' = x - y, y(0) = x(0), for an x that is linear between its points."""
    # Over a step h, with a = exp(-h / tau) and g = (1 - a) tau / h: y(n) = a y(n - 1) + (1 - g) x(n) + (g - a) x(n -
    # 1), which is exact.
    pole = math.exp(-step_s / constant_s)
    mean = -math.expm1(-step_s / constant_s) * constant_s / step_s
    start = (1 - mean) * x
    start[1:] += (mean - pole) * x[:-1]
    start[:1] = x[:1]
    return recursion(start, pole)


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
        to it. What it does: `palpate.simulation.mechanics.Substrate`.

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

    def profile(self, t: Array) -> Array:
        """Return the press without tremor at times t, s: 0 to 1, times 1 + creep."""
        since = t - self.start_s
        rise = np.clip(since / self.rise_s, 0, 1)
        fall = np.clip((self.stop_s - t) / self.fall_s, 0, 1)
        creep = 1 + self.creep * np.clip((since - self.rise_s) / self.hold_s, 0, 1)
        return np.asarray(0.5 * (1 - np.cos(np.pi * np.minimum(rise, fall))) * creep)

    def ratio(self, t: Array) -> Array:
        """Return the ratio of this press at times t, s."""
        starts = self.start_s + np.array([after for after, _ in self.ratios])
        values = np.array([value for _, value in self.ratios])
        ratio = values[np.clip(np.searchsorted(starts, t, "right") - 1, 0, None)]
        if self.relaxes:
            ratio = ratio * (
                1 + self.relaxes * np.expm1(-np.maximum(t - self.start_s, 0) / self.relaxation_s)
            )
        return np.asarray(ratio)


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
    >>> tilting(Tilt(ramp_per_s=0.01), 10.0, np.random.default_rng(0))(2.0, np.array([2.0, 5.0]))
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


def tilting(
    tilt: Tilt, duration_s: float, random: np.random.Generator
) -> Callable[[float, Array], Array]:
    """Return the factor on the ratio, as a function of the begin of a press, s, and of times, s."""
    steps = random.standard_normal(int(duration_s / _STEP_S) + 1) if tilt.walk else np.zeros(1)
    times = _STEP_S * np.arange(len(steps) + 1)
    walk = tilt.walk * np.sqrt(_STEP_S) * np.cumsum(np.append(0.0, steps))

    def factor(start_s: float, t: Array) -> Array:
        since = np.clip(t - start_s, 0, None)
        ramped = 1 + tilt.ramp_per_s * since
        rocked = ramped * (1 + tilt.rock * np.sin(2 * np.pi * tilt.rock_Hz * since))
        walked = 1 + np.interp(start_s + since, times, walk) - np.interp(start_s, times, walk)
        return np.asarray(rocked * walked)

    return factor


LOWEST_HZ, HIGHEST_HZ = 3.0, 12.0  # band of physiological tremor
SWAY_HZ = (0.1, 1.0)  # band of the sway

Course = Callable[[Array], Array]  # times, s -> tremor with an rms of 1


def _sines(frequencies: Array, random: np.random.Generator, sizes: Array | float = 1.0) -> Course:
    """Return a sum of sines with random phases and amplitudes, with an rms of 1 over a long time."""
    phases = random.uniform(0, 2 * np.pi, frequencies.size)
    amplitudes = random.rayleigh(1.0, frequencies.size) * sizes
    sines = list(
        zip(amplitudes / np.sqrt((amplitudes**2).sum() / 2), frequencies, phases, strict=True)
    )

    def course(t: Array) -> Array:
        total = np.zeros_like(t)
        for amplitude, frequency, phase in sines:
            total += amplitude * np.sin(2 * np.pi * frequency * t + phase)
        return total

    return course


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
        return _sines(frequencies, random, np.repeat([0.6, 1.0], 12))


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
        lines = _sines(np.clip(spread, LOWEST_HZ, HIGHEST_HZ), random)
        if not self.sway:
            return lines
        sway = _sines(random.uniform(*SWAY_HZ, self.sines), random)
        return lambda t: lines(t) + self.sway * sway(t)


Spectrum = Peaks | Lines
