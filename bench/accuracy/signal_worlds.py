"""Two signals of which one follows the other, in the ways in which an estimator of their ratio can be wrong.

Each world takes a seed and returns what it made, with the true ratio. `sd` is the standard deviation of the noise of the
output. Needs the extra science.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Generator = np.random.Generator


@dataclass(frozen=True)
class Signals:
    """Two signals.

    Attributes
    ----------
    output, regressor : NDArray, shape (n,)
    ratio : NDArray, shape (n,)
        The true one at each sample.
    noise : float
        Standard deviation of the noise of the output; rivals that need it know it.
    """

    output: Array
    regressor: Array
    ratio: Array
    noise: float


@dataclass(frozen=True)
class SeveralSignals:
    """An output of several regressors, shape (n, size), with constant coefficients; the last one may be an intercept."""

    output: Array
    regressors: Array
    coefficients: Array
    intercept: bool


def generator(seed: int, world: int) -> Generator:
    """Return the random numbers of one run of a world."""
    return np.random.default_rng([seed, 1000 + world])


def coloured(white: Array, rho: float) -> Array:
    """Return AR(1) noise of white noise, its variance divided by 1 - rho^2; it begins with the first white value."""
    from scipy.signal import lfilter

    return np.asarray(lfilter([1.0], [1.0, -rho], white))


def noisy(regressor: Array, ratio: Array, noise: Array, sd: float) -> Signals:
    """Return the signals of a regressor, a ratio and the noise of the output."""
    return Signals(ratio * regressor + noise, regressor, ratio, sd)


def stepped(size: int, at: int, before: float, after: float) -> Array:
    """Return a ratio with one step."""
    return np.where(np.arange(size) < at, before, after)


LATE_GAIN = 3.0


def late_sine(seed: int, period: float, late: float, offset: float) -> Signals:
    """Return 6,000 samples of a sine and of 3 times this sine, late by some samples, with an offset and noise of .02."""
    t = np.arange(6000)
    sd = 0.02
    output = LATE_GAIN * np.sin(2 * np.pi * (t - late) / period) + offset
    output += sd * generator(seed, 11).standard_normal(len(t))
    regressor = np.sin(2 * np.pi * t / period)
    return Signals(output, regressor, np.full(len(t), LATE_GAIN), sd)


def early_step(seed: int, size_sd: float) -> Signals:
    """Return a ratio of 3 that steps after 60 samples of 360: x is 1 with 5 % of white noise, sd is .01."""
    random = generator(seed, 171)
    sd = 0.01
    regressor = 1 + 0.05 * random.standard_normal(360)
    ratio = stepped(360, 60, 3.0, 3 + sd * size_sd)
    return noisy(regressor, ratio, sd * random.standard_normal(360), sd)


def small_step(seed: int, size_sd: float) -> Signals:
    """Return a ratio of 2 that steps after 1,000 samples of 1,301: x is uniform from .5 to 1.5, sd is 1."""
    random = generator(seed, 172)
    regressor = random.uniform(0.5, 1.5, 1301)
    ratio = stepped(1301, 1000, 2.0, 2 + size_sd)
    return noisy(regressor, ratio, random.standard_normal(1301), 1.0)


def hedge(seed: int) -> Signals:
    """Return returns of two assets: hedge ratio .8, from 1,000 of 1,700 samples on 1.3, residuals of .8 (R2 .5 and .7)."""
    random = generator(seed, 173)
    regressor = random.standard_normal(1700)
    ratio = stepped(1700, 1000, 0.8, 1.3)
    return noisy(regressor, ratio, 0.8 * random.standard_normal(1700), 0.8)


def drifting(seed: int, drift_sd: float) -> Signals:
    """Return a ratio that grows from 2 evenly, by some sd in 1,000 samples: x is uniform from .5 to 1.5, sd is 1."""
    random = generator(seed, 174)
    regressor = random.uniform(0.5, 1.5, 1000)
    ratio = 2 + drift_sd * np.arange(1000) / 1000
    return noisy(regressor, ratio, random.standard_normal(1000), 1.0)


PAIRS_PER_S = 38.0
SLIDE_AT_S = 4.0
AFTER_S = 0.5


def slide(seed: int, share: float, duration_s: float) -> Signals:
    """Return a ratio of 2.5 that slides to another one, as a probe does from object to object.

    38 pairs a second. From 4 s on, delayed by a random part of one pair, the ratio goes from 2.5 to 2.5 (1 + share) in
    `duration_s` along half a period of a cosine; the record ends .5 s after it. The regressor is 1 + AR(1) of rho .95 and
    a standard deviation of 2 %. sd is 2e-4 of the first ratio.
    """
    random = generator(seed, 176)
    size = math.ceil(PAIRS_PER_S * (SLIDE_AT_S + duration_s + AFTER_S))
    since_s = (np.arange(size) - random.uniform()) / PAIRS_PER_S - SLIDE_AT_S
    progress = (1 - np.cos(np.pi * np.clip(since_s / duration_s, 0, 1))) / 2
    ratio = 2.5 * (1 + share * progress)
    sd = 2e-4 * 2.5
    regressor = wandering(random, size)
    return noisy(regressor, ratio, sd * random.standard_normal(size), sd)


def wandering(random: Generator, size: int) -> Array:
    """Return 1 + AR(1) of rho .95 with a standard deviation of 2 %."""
    return 1 + 0.02 * math.sqrt(1 - 0.95**2) * coloured(random.standard_normal(size), 0.95)


def slow_noise(seed: int, regressor_rho: float) -> Signals:
    """Return 100,000 samples: regressor AR(1) around 0 with innovations of 1, noise AR(.9) with innovations of .4."""
    random = generator(seed, 175)
    size = 100_000
    regressor = coloured(random.standard_normal(size), regressor_rho)
    noise = 0.4 * coloured(random.standard_normal(size), 0.9)
    return noisy(regressor, np.full(size, 2.0), noise, 0.4 / math.sqrt(1 - 0.9**2))


GROWS_AT = 200


def growing_noise(seed: int) -> Signals:
    """Return 400 samples with a ratio of 2: x is uniform from .5 to 1.5, the noise .01 and from 200 samples on .05."""
    random = generator(seed, 5)
    regressor = random.uniform(0.5, 1.5, 400)
    noise = 0.01 * random.standard_normal(400)
    noise[GROWS_AT:] *= 5
    return noisy(regressor, np.full(400, 2.0), noise, 0.01)


def steady(seed: int, size: int) -> Signals:
    """Return a ratio of 2 in white noise of .01: x is 1 with 5 % of white noise."""
    random = generator(seed, 177)
    regressor = 1 + 0.05 * random.standard_normal(size)
    return noisy(regressor, np.full(size, 2.0), 0.01 * random.standard_normal(size), 0.01)


def several(
    seed: int, world: int, size: int, intercept: bool, rho: float = 0.0
) -> tuple[SeveralSignals, Generator]:
    """Return two AR(1) regressors with coefficients 1 and 2, with an intercept of 5 if there is one, without noise."""
    random = generator(seed, world)
    white = random.standard_normal((size, 2))
    regressors = np.column_stack([coloured(white[:, 0], rho), coloured(white[:, 1], rho)])
    coefficients = np.array([1.0, 2.0])
    output = regressors @ coefficients
    if intercept:
        coefficients = np.append(coefficients, 5.0)
        output += 5.0
    return SeveralSignals(output, regressors, coefficients, intercept), random


def several_slow_noise(seed: int, intercept: bool, rho: float) -> SeveralSignals:
    """Return 200 samples of two regressors, AR(1) as the one of `slow_noise`, in the noise of `slow_noise`."""
    signals, random = several(seed, 180, 200, intercept, rho)
    signals.output[:] += 0.4 * coloured(random.standard_normal(200), 0.9)
    return signals


def several_growing_noise(seed: int, intercept: bool) -> SeveralSignals:
    """Return 400 samples of two regressors in white noise of .01, from 200 samples on .05."""
    signals, random = several(seed, 181, 400, intercept)
    noise = 0.01 * random.standard_normal(400)
    noise[GROWS_AT:] *= 5
    signals.output[:] += noise
    return signals


def several_steady(seed: int, size: int) -> SeveralSignals:
    """Return two regressors in white noise of .01."""
    signals, random = several(seed, 182, size, False)
    signals.output[:] += 0.01 * random.standard_normal(size)
    return signals


# A constant ratio: ten regressors x fifteen noises.

CONSTANT = 2.0
CONSTANT_SD = 0.1


def _log_normal(random: Generator, size: int) -> Array:
    return np.exp(0.5 * random.standard_normal(size))


def _random_walk(random: Generator, size: int) -> Array:
    return np.cumsum(random.standard_normal(size)) / math.sqrt(size)


def _square_wave(random: Generator, size: int) -> Array:
    return np.where((np.arange(size) + random.integers(20)) // 10 % 2 == 0, 1.0, -1.0)


def _slow_regressor(random: Generator, size: int) -> Array:
    return math.sqrt(1 - 0.95**2) * coloured(random.standard_normal(size), 0.95)


def _sine(random: Generator, size: int) -> Array:
    return np.sin(2 * np.pi * np.arange(size) / 25 + random.uniform(0, 2 * np.pi))


Make = Callable[[Generator, int], Array]
REGRESSORS: dict[str, Make] = {
    "constant": lambda random, size: np.ones(size),
    "uniform .5-1.5": lambda random, size: random.uniform(0.5, 1.5, size),
    "sine": _sine,
    "normal": lambda random, size: random.standard_normal(size),
    "AR .95": _slow_regressor,
    "random walk": _random_walk,
    "2 % wander": wandering,
    "ramp": lambda random, size: np.linspace(0.5, 1.5, size),
    "square wave": _square_wave,
    "log-normal": _log_normal,
}
"""Regressors of about 1; the sine has a period of 25 samples, the square wave one of 20, the random walk begins near 0."""


def _autoregression(rho: float) -> Make:
    def noise(random: Generator, size: int) -> Array:
        started = coloured(random.standard_normal(size + 100), rho)[100:]
        return math.sqrt(1 - rho**2) * started

    return noise


def _moving_average(random: Generator, size: int) -> Array:
    white = random.standard_normal(size + 1)
    return (white[1:] - 0.8 * white[:-1]) / math.sqrt(1 + 0.8**2)


def _tone(random: Generator, size: int) -> Array:
    phase = random.uniform(0, 2 * np.pi)
    return np.asarray(math.sqrt(2) * np.sin(2 * np.pi * np.arange(size) / 7.3 + phase))


def _quantised(random: Generator, size: int) -> Array:
    """Return white noise in steps of two standard deviations: two of three values are 0."""
    step = 2.0
    return np.asarray(step * np.round(random.standard_normal(size) / step))


def _flicker(random: Generator, size: int) -> Array:
    """Return the first quarter of a record of 1/f noise, whose mean is 0."""
    record = 4 * size
    spectrum = np.fft.rfft(random.standard_normal(record))
    spectrum[1:] /= np.sqrt(np.arange(1, len(spectrum)))
    spectrum[0] = 0
    values = np.fft.irfft(spectrum, record)
    return np.asarray(values[:size] / values.std())


def _clustered(random: Generator, size: int) -> Array:
    """Return white noise whose logarithmic size is AR(.95) with a standard deviation of .7."""
    slow = coloured(random.standard_normal(size + 100), 0.95)[100:]
    log_size = 0.7 * math.sqrt(1 - 0.95**2) * slow
    return np.exp(log_size - 0.7**2) * random.standard_normal(size)


def _outliers(random: Generator, size: int) -> Array:
    return random.standard_normal(size) * np.where(random.uniform(size=size) < 0.05, 10.0, 1.0)


SHARE = "share of x"
NOISES: dict[str, Make] = {
    "white": lambda random, size: random.standard_normal(size),
    "uniform": lambda random, size: random.uniform(-math.sqrt(3), math.sqrt(3), size),
    "Laplace": lambda random, size: random.laplace(scale=math.sqrt(0.5), size=size),
    "t3": lambda random, size: random.standard_t(3, size) / math.sqrt(3),
    "AR .5": _autoregression(0.5),
    "AR .9": _autoregression(0.9),
    "AR .95": _autoregression(0.95),
    "MA -.8": _moving_average,
    "tone": _tone,
    "quantised": _quantised,
    "1/f": _flicker,
    "clusters": _clustered,
    SHARE: lambda random, size: random.standard_normal(size),
    "exponential": lambda random, size: random.exponential(size=size) - 1,
    "5 % outliers": _outliers,
}
"""Noises with a standard deviation of 1: of the other samples where there are outliers, of 1.14 if quantised. A share of x
is multiplied by x."""


def constant(seed: int, size: int, regressor: str, noise: str) -> Signals:
    """Return a ratio of 2 with one of the regressors and one of the noises, sd .1."""
    cell = 100 * list(REGRESSORS).index(regressor) + list(NOISES).index(noise)
    random = np.random.default_rng([seed, 2000 + cell, size])
    x = REGRESSORS[regressor](random, size)
    e = CONSTANT_SD * NOISES[noise](random, size)
    if noise == SHARE:
        e = e * x
    return noisy(x, np.full(size, CONSTANT), e, CONSTANT_SD)
