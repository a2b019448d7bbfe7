"""Reference of what is between two touches: the baselines of both channels, the gate, and what a reading begins or ends.

Of a baseline the core keeps sums; this keeps the values, and the weight of each.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

# values of the first level: the most, and the fewest of a second
FIRST = 32
FEWEST = 5
CLIP = 3.0  # standard deviations
LONGEST = 2  # memory of the running mean, first values
PROVEN = 5  # the same: until a drift may be found
MEMORY = 64  # of the noise, values
MOST_COUNTED = 160  # values
LEAST_NOISE = 1e-6
SECOND_NS = 1_000_000_000
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
    first : int
        How many values the first level has.

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
    first: int = FIRST

    @property
    def share(self) -> float:
        """Share of a new value in the exponential means."""
        return 1 / self.first

    @property
    def drifts(self) -> bool:
        """Whether fast - slow is more than 4 of its standard deviations, which are sqrt(share) / 2 of the noise."""
        limit = 2 * np.sqrt(self.share) * self.noise
        return self.count >= PROVEN * self.first and abs(self.fast - self.slow) > limit

    @property
    def disturbed(self) -> bool:
        """Whether the first values were none of a rest: as many later ones hardly differ."""
        return self.quiet >= self.first

    @property
    def level(self) -> float:
        """Capacitance without contact: the mean; with a drift the expected next value."""
        return self.expected if self.drifts else float(self.weights @ self.values)

    @property
    def expected(self) -> float:
        """The next value: the means lag by n - 1 slopes, and twice that; 2 fast - slow does not (Brown 1963)."""
        return 2 * self.fast - self.slow

    @property
    def slope(self) -> float:
        """Change from value to value."""
        return (self.fast - self.slow) / (self.first - 1)

    @property
    def recovery(self) -> float:
        """Change between the halves of the first values; of fewer than 32 less, as their medians are not so well known."""
        return float(self.first / 2 * self.slope * np.sqrt(self.first / FIRST))

    @property
    def variance(self) -> float:
        """Variance of the level: of a value, times the sum of the squared weights; 5 / 4 share for 2 fast - slow."""
        weight = 1.25 * self.share if self.drifts else self.weights @ self.weights
        return float(self.noise**2 * weight)

    @property
    def age(self) -> float:
        """Mean age of the values of the level; the first level counts with its middle."""
        return 0.0 if self.drifts else float(self.weights @ self.ages)


def first_level(values: ArrayLike) -> Level:
    """Return the baseline of the first values, 5 to 32, pF, in the order of time, of which a few may be outliers."""
    # The mean is over the values within 3 standard deviations of the median. The quartiles, each moved inwards by one
    # value, are 1.25 standard deviations apart, and of few values less; the quartiles of a half, moved by half a value,
    # 1.14. The slope goes from the median of the earlier half to the median of the later half, which are half of all
    # values apart; a difference of 10 standard deviations is no drift.
    v = np.asarray(values, float)
    n = len(v)
    noise = max(_between_quartiles(v) / 1.25 * (1 + (FIRST / n - 1) / 6), noise_floor(v))
    near = v[np.abs(v - np.median(v)) <= CLIP * noise]
    early = v[: n // 2]
    late = v[n // 2 :]
    rise = np.median(late) - np.median(early)
    spread = (_between_quartiles(early) + _between_quartiles(late)) / 2 / 1.14
    slope = rise / (n / 2) if abs(rise) < 10 * max(spread, noise_floor(v)) else 0.0
    last = float(near.mean() + slope * (n - 1) / 2)
    lag = float((n - 1) * slope)
    size = len(near)
    return Level(
        values=near,
        weights=np.full(size, 1 / size),
        ages=np.full(size, (n - 1) / 2),
        fast=last - lag,
        slow=last - 2 * lag,
        noise=float(noise),
        count=size,
        first=n,
    )


def _between_quartiles(values: Array) -> float:
    """Return how far the values are apart of which a quarter is above, or below."""
    ordered = np.sort(values)
    quarter = len(values) // 4
    return float(ordered[len(values) - 1 - quarter] - ordered[quarter])


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
    count = min(before.count + 1, MOST_COUNTED)
    share = before.share
    part = 1 / min(count, LONGEST * before.first)
    fast = before.fast + (taken - before.fast) * share
    more = (PER_MAGNITUDE * abs(off) - before.noise) / min(count, MEMORY)
    noise = max(before.noise + more, floor)
    quiet = 100 * abs(value - before.last) < noise and noise > 4 * floor
    return Level(
        values=np.append(before.values, taken),
        weights=np.append((1 - part) * before.weights, part),
        ages=np.append(before.ages + 1, 0.0),
        fast=fast,
        slow=before.slow + (fast - before.slow) * share,
        noise=noise,
        count=count,
        last=value,
        quiet=before.quiet + 1 if quiet else 0,
        first=before.first,
    )


@dataclass
class Baseline:
    """The baseline of a channel, value by value: reference of the second stage of the scene "handheld".

    Attributes
    ----------
    now : Level
        Valid as soon as `ready`.
    ready : bool
        Whether the first values are known.

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
            self._establish()

    @property
    def empty(self) -> bool:
        """Whether there is none of the first values."""
        return not self.ready and not self._first

    def collected(self, passed_ns: int) -> None:
        """Know that the first values took so long: those of a second are enough, and 5 at least."""
        size = len(self._first)
        if not self.ready and size >= FEWEST and passed_ns >= SECOND_NS - SECOND_NS // size:
            self._establish()

    def _establish(self) -> None:
        self.now = first_level(self._first)
        self.ready = True
        self._floor = noise_floor(np.array(self._first))
        self.mark()

    def mark(self) -> None:
        """Keep the present state for `rewind`."""
        self._marked = self.now

    def rewind(self) -> None:
        """Go back to the last mark: a touch has begun after it."""
        self.now = self._marked

    def measure_again(self) -> None:
        """Collect the first values again; until then the old level stays."""
        self.ready = False
        self._first = []

    def move(self, level: float, count: int) -> None:
        """Take a new level, the mean of the last `count` values."""
        size = min(count, 2 * self.now.first)
        self.now = replace(
            self.now,
            values=np.full(size, level),
            weights=np.full(size, 1 / size),
            ages=np.full(size, (size - 1) / 2),
            fast=level,
            slow=level,
            count=size,
            last=level,
            quiet=0,
        )
        self.mark()

    def keep(self) -> None:
        """Stop collecting; the old level stays."""
        self.ready, self._floor = True, least_noise(float(self.now.weights @ self.now.values))
        self.mark()


ENOUGH = 8  # values for the noise of a baseline that is given
PER_BEND = 0.5117  # standard deviation over mean second difference, 1 / (sqrt(6) sqrt(2 / pi))


class GivenLevel(Level):
    """A level that is known: it has no error, and the next value is expected there."""

    @property
    def variance(self) -> float:
        """Variance of the level: none."""
        return 0.0


@dataclass
class GivenBaseline(Baseline):
    """A baseline that is given in place of measured: only its noise is measured, from second differences.

    Attributes
    ----------
    level, noise : float, pF
        Its level, and the standard deviation of a value; 0: it is measured.

    Examples
    --------
    >>> baseline = GivenBaseline(0.5)
    >>> for value in [0.6, 0.4] * 4:
    ...     baseline.add(value)
    >>> baseline.ready, baseline.now.expected, round(baseline.now.noise, 3)
    (True, 0.5, 0.205)
    """

    level: float = 0.0
    noise: float = 0.0
    _values: list[float] = field(default_factory=list)

    def __init__(self, level: float, noise: float = 0.0) -> None:
        super().__init__()
        self.level = level
        self.noise = noise
        self._values = []
        self.now = self._known(noise)
        self.ready = noise > 0

    def add(self, value: float) -> None:
        """Take a value without contact."""
        if self.noise > 0:
            return
        self._values.append(value)
        count = min(len(self._values), MEMORY)
        self.ready = count >= ENOUGH
        if count <= 2:
            return
        before, last, now = self._values[-3:]
        bend = PER_BEND * abs((now - last) - (last - before))
        noise = self.now.noise
        if count > ENOUGH:
            bend = min(bend, CLIP * noise)
        self.now = self._known(max(noise + (bend - noise) / (count - 2), least_noise(value)))

    def _known(self, noise: float) -> Level:
        one = np.ones(1)
        return GivenLevel(
            self.level * one, one, 0 * one, fast=self.level, slow=self.level, noise=noise
        )

    def mark(self) -> None:
        """Do nothing: there is no state to go back to."""

    def rewind(self) -> None:
        """Do nothing."""

    def measure_again(self) -> None:
        """Do nothing: the level stays."""

    def keep(self) -> None:
        """Do nothing."""


# of the CUSUM, standard deviations
SLACK = 1.5
LIMIT = 16.0
MOST = 6.0
QUIET = 1.2  # standard deviations: the touch began after the last value below it
# of the height
RELEASE = 0.5
IDLE_SHARE = 0.1
CONFIRM = 3  # values in a row that end a touch
PATIENCE_S = 30.0


@dataclass
class Contact:
    """The gate, value by value: reference of the third stage of the scene "handheld".

    Attributes
    ----------
    state : str
        "idle", "contact", or "released" (the touch is over, the channels are not yet idle).
    rise, fall : float, standard deviations
        CUSUM (Page's test) of the change, and of the change downwards.
    age : int
        Values since the last quiet one; in contact: this number when the contact was found.
    highest, last : float, pF
        Height of the touch: of two changes one after the other, the smaller one, at most; the last change.
    in_a_row : int
        Values that confirm an end, or a touch between two baselines.
    pressed_again : int
        How often the probe was pressed again while the release was not over.
    release : float
        Share of the height below which a touch ends.
    patience_s : float, s
        Longest contact after a touch; inf: the baseline is given.

    Examples
    --------
    >>> gate = Contact()
    >>> for change in [0.0, 10.0, 10.0, 10.0, 10.0]:
    ...     gate.update(change, 1.0)
    >>> gate.state, gate.age
    ('contact', 4)
    """

    state: str = "idle"
    rise: float = 0.0
    fall: float = 0.0
    age: int = 0
    highest: float = 0.0
    last: float = 0.0
    in_a_row: int = 0
    pressed_again: int = 0
    release: float = RELEASE
    patience_s: float = PATIENCE_S

    @property
    def suspects(self) -> bool:
        """Whether a touch may have begun."""
        return self.rise > 0 or self.age > 0

    @property
    def pressed(self) -> bool:
        """Whether the last change between two baselines may be of a touch."""
        return self.in_a_row > 0

    @property
    def fell(self) -> bool:
        """Whether the idle channels fell far below the baseline, by three times the limit; or a contact did not end."""
        return self.fall >= 3 * LIMIT

    def update(self, change: float, noise: float, waited_s: float = 0.0) -> None:
        """Take one change and its noise, pF, and the time since a touch took samples, s."""
        height = min(change, self.last)
        self.last = change
        if self.state == "idle":
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                deviations = float(np.float64(change) / np.float64(noise))
            self.rise, self.fall = _page(self.rise, deviations), _page(self.fall, -deviations)
            self.age = self.age + 1 if deviations >= QUIET else 0
            if self.rise >= LIMIT:
                self._begin(height)
            return
        touching = self.state == "contact"
        if touching:
            self.highest = max(self.highest, height)
        share = self.release if touching else IDLE_SHARE
        low = change < max(share * self.highest, (SLACK + 1) * noise)
        self.in_a_row = self.in_a_row + 1 if low else 0
        if waited_s >= self.patience_s:  # the baseline jumped, or a press lasts
            self.reset()
            self.fall = 3 * LIMIT
            return
        if not touching:
            self.age = self.age + 1 if change > self.release * self.highest else 0
            self.pressed_again += self.age == CONFIRM
        if self.in_a_row == CONFIRM:
            self.calm_down("released" if touching else "idle")

    def update_between(self, change: float, noise: float) -> None:
        """Take one change from the old baseline, pF, while a new one is measured after a touch.

        The next touch begins with more than 3 values in a row above a fifth of the height of the last touch and above
        6 standard deviations of the noise.
        """
        height = min(change, self.last)
        self.last = change
        high = self.highest > 0 and change > max(2 * IDLE_SHARE * self.highest, MOST * noise)
        self.in_a_row = self.in_a_row + 1 if high else 0
        if self.in_a_row > CONFIRM:
            self.age = self.in_a_row
            self._begin(height)

    def calm_down(self, state: str) -> None:
        """Begin again in a state."""
        self.state = state
        self.rise = 0.0
        self.fall = 0.0
        self.age = 0
        self.in_a_row = 0

    def reset(self) -> None:
        """Begin again, without a last touch."""
        self.calm_down("idle")
        self.highest = 0.0

    def _begin(self, height: float) -> None:
        self.state = "contact"
        self.highest = height
        self.in_a_row = 0


def _page(statistic: float, deviations: float) -> float:
    """Return max(0, g + min(z, 6) - 1.5); 0 where z is not a number."""
    after = statistic + min(deviations, MOST) - SLACK
    return after if after > 0 else 0.0


@dataclass
class Idle:
    """Both baselines and the gate, reading by reading.

    Attributes
    ----------
    hard, soft : Baseline
    gate : Contact
    retaken : int
        How often the baseline was measured again: its first values were disturbed, or the channels fell far below it.

    Examples
    --------
    >>> idle = Idle()
    >>> [idle.take(26_000_000 * k, 9.0, 8.0, 0.0, running=False) for k in (1, 2)]
    ['', '']
    """

    hard: Baseline = field(default_factory=Baseline)
    soft: Baseline = field(default_factory=Baseline)
    gate: Contact = field(default_factory=Contact)
    retaken: int = 0
    # when a touch last took samples, or the release; while the baselines are measured: its end, then the first value
    _since_ns: int = 0
    _settles: bool = False

    @property
    def ready(self) -> bool:
        """Whether both baselines are known."""
        return self.hard.ready and self.soft.ready

    def take(self, time_ns: int, hard: float, soft: float, least: float, *, running: bool) -> str:
        """Take a reading of both channels, pF, whose noise is at least `least`; return what begins or ends."""
        # "begun": a touch; "released": the probe; "idle": the release is over, the baselines will be measured again;
        # "measured": the baselines are known; "": nothing of these.
        change = (hard - self.hard.now.expected) + (soft - self.soft.now.expected)
        small, large = sorted((self.hard.now.noise, self.soft.now.noise))
        noise = max(large + 0.42 * small, least)  # the square root of the sum of the squares, about
        if not self.ready:
            return self._measure(time_ns, (hard, soft), change, noise)
        before = self.gate.state
        if running or before == "idle":
            self._since_ns = time_ns
        self.gate.update(change, noise, (time_ns - self._since_ns) / 1e9)
        now = self.gate.state
        if now == "contact" and before != "contact":
            self.hard.rewind()
            self.soft.rewind()
            return "begun"
        if now == "idle" and before != "idle" and not self.gate.fell:
            self._measure_again()
            # The last tenth of a release takes half as long again as the fall to it, for a force of depth^1.5.
            fall = time_ns - self._since_ns
            rest = SECOND_NS if fall > SECOND_NS else max(fall + fall // 2, SECOND_NS // 10)
            self._since_ns = time_ns + rest
            self._settles = True
            return "idle"
        disturbed = self.hard.now.disturbed or self.soft.now.disturbed
        if self.gate.fell or (now == "idle" and disturbed):
            self.retaken += 1
            self.gate.reset()
            self._measure_again()
        elif now == "idle":
            self._follow(hard, soft)
        if before == "contact" and now != "contact":
            self._since_ns = time_ns
            return "released"
        return ""

    def take_one(self, time_ns: int, hard: float | None, soft: float | None) -> str:
        """Take a reading of which one channel or both have no value; return "measured" or ""."""
        before = self.ready
        if self.gate.state == "idle" and not self.gate.suspects and not self._settles:
            self._note_first(time_ns)
            for baseline, value in ((self.hard, hard), (self.soft, soft)):
                if value is not None:
                    baseline.add(value)
            self._judge_first(time_ns)
        return "measured" if self.ready and not before else ""

    def _measure(
        self, time_ns: int, values: tuple[float, float], change: float, noise: float
    ) -> str:
        """Take a reading while the baselines are measured; a touch that begins meanwhile has the old ones."""
        self.gate.update_between(change, noise)
        if self.gate.state == "contact":
            self.hard.keep()
            self.soft.keep()
            return "begun"
        self._settles = self._settles and 0 < self._since_ns - time_ns <= 2 * SECOND_NS
        if self._settles:
            return ""
        self._note_first(time_ns)
        for baseline, value in zip((self.hard, self.soft), values, strict=True):
            if not baseline.ready:
                baseline.add(value)
        self._judge_first(time_ns)
        return "measured" if self.ready else ""

    def _note_first(self, time_ns: int) -> None:
        if self.hard.empty and self.soft.empty:
            self._since_ns = time_ns

    def _judge_first(self, time_ns: int) -> None:
        if not self.ready and not self.gate.pressed:
            self.hard.collected(time_ns - self._since_ns)
            self.soft.collected(time_ns - self._since_ns)

    def move(self, hard: float, soft: float, count: int) -> None:
        """Take new levels, which are the means of the last `count` readings; nothing is touched."""
        self.gate.reset()
        self.hard.move(hard, count)
        self.soft.move(soft, count)

    def _measure_again(self) -> None:
        self.hard.measure_again()
        self.soft.measure_again()

    def _follow(self, hard: float, soft: float) -> None:
        self.hard.add(hard)
        self.soft.add(soft)
        if not self.gate.suspects:
            self.hard.mark()
            self.soft.mark()
