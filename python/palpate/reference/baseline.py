"""Reference of the baseline of a channel: its first values, a clipped running mean, and a test for a drift.

The core keeps sums; this keeps the values, and the weight of each.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

FIRST = 32  # values of the first level, and of the exponential means
CLIP = 3.0  # standard deviations
LONGEST = 64  # memory of the running mean, values
PROVEN = 160  # values until a drift may be found
LEAST_NOISE = 1e-6
PER_MAGNITUDE = 1.2533141  # standard deviation over mean magnitude, sqrt(pi / 2)


@dataclass(frozen=True)
class Level:
    """A baseline between two values.

    Attributes
    ----------
    values, weights, ages : numpy.ndarray, shape (n,), pF, 1, values
        Of the running mean: clipped values without contact, the weight of each, and how many values ago it was.
    fast, slow : float, pF
        Two exponential means in series.
    noise : float, pF
        Standard deviation of one value.
    last, quiet : float, int
        The last value, and how many in a row differ from the one before them by less than a hundredth of the noise.
    count : float
        How many values there were, at most 160.

    Examples
    --------
    >>> first_level(np.arange(32.0)).level
    15.5
    """

    values: Array = field(default_factory=lambda: np.zeros(1))
    weights: Array = field(default_factory=lambda: np.zeros(1))
    ages: Array = field(default_factory=lambda: np.zeros(1))
    fast: float = 0.0
    slow: float = 0.0
    noise: float = 0.0
    count: float = 0.0
    last: float = 0.0
    quiet: int = 0

    @property
    def drifts(self) -> bool:
        """Whether fast - slow is more than 4 of its standard deviations, which are sqrt(1 / 32) / 2 of the noise."""
        return self.count >= PROVEN and abs(self.fast - self.slow) > 2 * np.sqrt(1 / FIRST) * self.noise

    @property
    def level(self) -> float:
        """Capacitance without contact: the mean; with a drift the expected next value."""
        return self.expected if self.drifts else float(self.weights @ self.values)

    @property
    def expected(self) -> float:
        """The next value: the means lag by 31 and 62 slopes, so 2 fast - slow does not (Brown 1963)."""
        return 2 * self.fast - self.slow

    @property
    def slope(self) -> float:
        """Change from value to value."""
        return (self.fast - self.slow) / (FIRST - 1)

    @property
    def variance(self) -> float:
        """Variance of the level: of a value, times the sum of the squared weights; 5 / 4 / 32 for 2 fast - slow."""
        return float(self.noise**2 * (1.25 / FIRST if self.drifts else self.weights @ self.weights))

    @property
    def age(self) -> float:
        """Mean age of the values of the level; the first level counts with its middle."""
        return 0.0 if self.drifts else float(self.weights @ self.ages)


def first_level(values: ArrayLike) -> Level:
    """Return the baseline of the first 32 values, pF, in the order of time, of which a few may be outliers."""
    # The mean is over the values within 3 standard deviations of the median. The quartiles, each moved inwards by one
    # value, are 1.25 standard deviations apart; the quartiles of a half, moved by half a value, 1.14. The slope goes from
    # the median of the earlier half to the median of the later half; a difference of 10 standard deviations is no drift.
    v = np.asarray(values, float)
    noise = max((np.sort(v)[23] - np.sort(v)[8]) / 1.25, noise_floor(v))
    near = v[np.abs(v - np.median(v)) <= CLIP * noise]
    halves = np.sort(v.reshape(2, FIRST // 2), axis=1)
    rise = np.median(halves[1]) - np.median(halves[0])
    spread = (halves[:, 11] - halves[:, 4]).mean() / 1.14
    slope = rise / (FIRST // 2) if abs(rise) < 10 * max(spread, noise_floor(v)) else 0.0
    last = float(near.mean() + slope * (FIRST - 1) / 2)
    lag = float((FIRST - 1) * slope)
    size = len(near)
    ages = np.full(size, (FIRST - 1) / 2)
    return Level(near, np.full(size, 1 / size), ages, last - lag, last - 2 * lag, float(noise), size)


def noise_floor(values: Array) -> float:
    """Return the lower limit of the noise, pF: half the smallest step of the values (a code), or `least_noise`."""
    steps = np.diff(np.unique(values))
    least = least_noise(float(np.median(values)))
    return float(steps.min() / 2) if len(steps) and steps.min() > 2 * least else least


def least_noise(level: float) -> float:
    """Return the lower limit of the noise of values without visible noise: 2^-20 of the level, at most 1e-6 pF."""
    return min(LEAST_NOISE, abs(level) / 2**20 + 1e-18)


def next_level(before: Level, value: float, floor: float) -> Level:
    """Return the baseline after one more value without contact; `floor`: lower limit of the noise, pF."""
    # A deviation from the expected value is limited to 3 standard deviations.
    off = float(np.clip(value - before.expected, -CLIP * before.noise, CLIP * before.noise))
    taken = before.expected + off
    count = min(before.count + 1, PROVEN)
    part = 1 / min(count, LONGEST)
    fast = before.fast + (taken - before.fast) / FIRST
    noise = max(before.noise + part * (PER_MAGNITUDE * abs(off) - before.noise), floor)
    quiet = 100 * abs(value - before.last) < noise and noise > 4 * floor
    return Level(
        values=np.append(before.values, taken),
        weights=np.append((1 - part) * before.weights, part),
        ages=np.append(before.ages + 1, 0.0),
        fast=fast,
        slow=before.slow + (fast - before.slow) / FIRST,
        noise=noise,
        count=count,
        last=value,
        quiet=before.quiet + 1 if quiet else 0,
    )


@dataclass
class Baseline:
    """The baseline of a channel, value by value: reference of the second stage of the scene "handheld".

    Attributes
    ----------
    now : Level
        Valid as soon as `ready`.
    ready : bool
        Whether the first 32 values are known.

    Examples
    --------
    >>> baseline = Baseline()
    >>> for value in [0.5] * 40:
    ...     baseline.add(value)
    >>> baseline.ready, round(baseline.now.level, 12)
    (True, 0.5)
    """

    now: Level = field(default_factory=Level)
    ready: bool = False
    _first: list[float] = field(default_factory=list)
    _marked: Level = field(default_factory=Level)
    _floor: float = LEAST_NOISE

    def add(self, value: float) -> None:
        """Take a value without contact."""
        if self.ready:
            self.now = next_level(self.now, value, self._floor)
            return
        self._first.append(value)
        if len(self._first) == FIRST:
            self.now, self.ready = first_level(self._first), True
            self._floor = noise_floor(np.array(self._first))
            self.mark()

    def mark(self) -> None:
        """Keep the present state for `rewind`."""
        self._marked = self.now

    def rewind(self) -> None:
        """Go back to the last mark: a touch has begun after it."""
        self.now = self._marked

    def measure_again(self) -> None:
        """Collect 32 new values; until then the old level stays."""
        self.ready, self._first = False, []

    def keep(self) -> None:
        """Stop collecting; the old level stays."""
        self.ready, self._floor = True, least_noise(float(self.now.weights @ self.now.values))
        self.mark()
