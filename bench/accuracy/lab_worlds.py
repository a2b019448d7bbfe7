"""Sessions of a probe in a lab, for the bench lab: a simulator of its own.

It shares no code with `palpate.simulation`. A probe comes from above the object, so it is open
before the contact. A hand follows a smooth path, and adds a tremor of many frequencies and
a slow sway; a stage is still. Each bump is a spring with the force depth^p. A tilt makes the hard bump
deeper. One converter reads hard, then soft, each as a mean over its conversion. Faults change the
signal before the white noise is added, or the readings after that.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
OneChannel = Literal["hard", "soft"]
Channel = Literal["hard", "soft", "both"]
Presser = Literal["hand", "stage", "relaxing"]
Part = Literal["rise", "hold", "fall"]
Moment = Literal["contact", "release", "evenly"]
HARD = 0
SOFT = 1
APPROACH = 0.2  # of the depth: the height of the open probe above the object
TREMOR_LINES = 24
SWAY_LINES = 6
GAUSS = {count: np.polynomial.legendre.leggauss(count) for count in (1, 3, 6)}


def rows_of(channel: Channel) -> list[int]:
    """Return the rows of `Session.values` of a channel."""
    return {"hard": [HARD], "soft": [SOFT], "both": [HARD, SOFT]}[channel]


@dataclass(frozen=True)
class Press:
    """When a press begins, reaches its depth, leaves it, and ends, s; its soft signal, pF."""

    contact_s: float
    held_s: float
    release_s: float
    end_s: float
    depth_pF: float


@dataclass
class Session:
    """Readings of both channels, as faults change them.

    Attributes
    ----------
    times_s, values : Array
        Times and values in pF; the rows are the hard and the soft channel.
    levels : Array
        The baselines before any fault, pF.
    ratio : float
        The true ratio of all presses.
    presses : list of Press
    pair_s : float
    """

    times_s: Array
    values: Array
    levels: Array
    ratio: float
    presses: list[Press]
    pair_s: float

    @property
    def changes(self) -> Array:
        """Changes of both channels in the shallowest press, pF."""
        depth = min(press.depth_pF for press in self.presses)
        return np.array([self.ratio * depth, depth])


class Fault(Protocol):
    """Something that a lab does to a probe."""

    @property
    def channel(self) -> Channel:
        """The channel that has it."""

    def __call__(self, session: Session, random: np.random.Generator) -> None:
        """Change the values of the session."""


@dataclass(frozen=True)
class World:
    """How sessions are made; a seed makes one of them. Times in s, capacitances in pF.

    A relaxing object is pressed by a stage. The tilt is the share of the depth by which the hard
    bump is deeper. `faults` change the signal, `reading_faults` the readings.
    """

    pair_s: float = 0.026
    pair_s_spread: float = 0.0
    presses: int = 3
    rest_s: float = 2.5
    every_s: float = 7.0
    rise_s: tuple[float, float] = (0.15, 0.4)
    hold_s: tuple[float, float] = (1.5, 3.0)
    ratio: tuple[float, float] = (1.2, 5.0)
    depth_pF: float = 0.25
    by: Presser = "hand"
    tremor: float = 0.05
    tremor_hz: tuple[float, float] = (3.0, 12.0)
    sway: float = 0.05
    exponent: float = 1.0
    tilt: float = 0.0
    noise_pF: float = 4e-5
    decimals: int | None = None
    faults: tuple[Fault, ...] = ()
    reading_faults: tuple[Fault, ...] = ()

    @property
    def faulty(self) -> frozenset[str]:
        """The channels with faults: "hard", "soft", or both of them."""
        names: set[str] = set()
        for fault in (*self.faults, *self.reading_faults):
            names |= {"hard", "soft"} if fault.channel == "both" else {fault.channel}
        return frozenset(names)


@dataclass(frozen=True)
class Lines:
    """A sum of lines with random frequencies and phases and an rms of 1: a function of time."""

    frequencies: Array
    amplitudes: Array
    phases: Array

    def __call__(self, t: Array) -> Array:
        """Return the values at times, s."""
        total = np.zeros_like(t)
        for frequency, amplitude, phase in zip(
            self.frequencies, self.amplitudes, self.phases, strict=True
        ):
            total += amplitude * np.sin(2 * np.pi * frequency * t + phase)
        return total


def lines(random: np.random.Generator, low: float, high: float, count: int) -> Lines:
    """Return lines of a band, Hz; their amplitudes are as random as those of noise."""
    amplitudes = random.rayleigh(1.0, count)
    amplitudes *= np.sqrt(2 / np.sum(amplitudes**2))
    return Lines(random.uniform(low, high, count), amplitudes, random.uniform(0, 2 * np.pi, count))


def smooth(part: Array) -> Array:
    """Return a smooth path from 0 to 1."""
    x = np.clip(part, 0, 1)
    return np.asarray(x * x * (3 - 2 * x))


def press_times(world: World, random: np.random.Generator) -> list[Press]:
    """Return the presses of a session."""
    presses = []
    for number in range(world.presses):
        contact = world.rest_s + number * world.every_s + random.uniform(0, world.pair_s)
        held = contact + random.uniform(*world.rise_s)
        release = held + random.uniform(*world.hold_s)
        end = release + random.uniform(*world.rise_s)
        depth = world.depth_pF * random.uniform(0.8, 1.25)
        presses.append(Press(contact, held, release, end, depth))
    return presses


class Hand:
    """The forces of one press on both bumps, at any time."""

    def __init__(
        self, world: World, press: Press, ratio: float, random: np.random.Generator
    ) -> None:
        self._world = world
        self._press = press
        self._ratio = ratio
        self._tremor = lines(random, *world.tremor_hz, TREMOR_LINES)
        self._sway = lines(random, 0.2, 1.5, SWAY_LINES)
        self._share = random.uniform(0.1, 0.2)
        self._time_s = random.uniform(0.3, 1.2)

    def forces(self, t: Array, channel: int) -> Array:
        """Return the signal of one channel, pF, at times within the press."""
        press = self._press
        world = self._world
        way = smooth((t - press.contact_s) / (press.held_s - press.contact_s))
        way *= 1 - smooth((t - press.release_s) / (press.end_s - press.release_s))
        shake = np.zeros_like(t)
        if world.by == "hand":
            shake = world.tremor * self._tremor(t) + world.sway * self._sway(t)
        depth = (1 + APPROACH + shake) * way - APPROACH
        side = 0.5 if channel == HARD else -0.5
        force = press.depth_pF * np.clip(depth + side * world.tilt, 0, None) ** world.exponent
        if world.by == "relaxing":
            held_for = np.clip(t - press.contact_s, 0, None)
            force *= 1 - self._share * (1 - np.exp(-held_for / self._time_s))
        return np.asarray(force * (self._ratio if channel == HARD else 1.0))


def nodes_of(conversion_s: float) -> int:
    """Return how many points a mean over a conversion needs: a tremor of 12 Hz turns in it."""
    if conversion_s < 0.004:
        return 1
    return 3 if conversion_s < 0.03 else 6


def converted(
    hands: Sequence[Hand],
    presses: Sequence[Press],
    times: Array,
    channel: int,
    conversion_s: float,
) -> Array:
    """Return the means of one channel over conversions around `times`."""
    values = np.zeros_like(times)
    places, weights = GAUSS[nodes_of(conversion_s)]
    for hand, press in zip(hands, presses, strict=True):
        first, last = np.searchsorted(
            times, (press.contact_s - conversion_s, press.end_s + conversion_s)
        )
        for place, weight in zip(places, weights, strict=True):
            t = times[first:last] + place * conversion_s / 2
            values[first:last] += weight / 2 * hand.forces(t, channel)
    return values


def make(world: World, seed: int) -> Session:
    """Make the session of a seed: the same hand in each world, whatever its faults."""
    hand, noise, faults = (np.random.default_rng([seed, stream]) for stream in (481, 482, 483))
    ratio = float(np.exp(hand.uniform(*np.log(world.ratio))))
    levels = hand.uniform(-1.0, 1.0, 2)
    pair_s = world.pair_s * (1 + world.pair_s_spread * hand.uniform(-1, 1))
    presses = press_times(world, hand)
    hands = [Hand(world, press, ratio, hand) for press in presses]
    count = int((presses[-1].end_s + 3.0) / pair_s)
    start = np.arange(count) * pair_s
    times = np.stack([start, start + pair_s / 2]) + 0.1
    values = np.stack(
        [
            levels[channel] + converted(hands, presses, times[channel], channel, 0.42 * pair_s)
            for channel in (HARD, SOFT)
        ]
    )
    session = Session(times, values, levels, ratio, presses, pair_s)
    for fault in world.faults:
        fault(session, faults)
    session.values += world.noise_pF * noise.standard_normal(values.shape)
    for fault in world.reading_faults:
        fault(session, faults)
    if world.decimals is not None:
        session.values = np.round(session.values, world.decimals)
    return session


# Readings


@dataclass(frozen=True)
class LooseWire:
    """A share of the readings of a channel is at its baseline, up to `longest` in a row."""

    channel: Channel
    share: float
    longest: int = 1

    def __call__(self, session: Session, random: np.random.Generator) -> None:
        """Put idle readings in their place."""
        count = session.values.shape[1]
        starts = random.random(count) < self.share / ((1 + self.longest) / 2)
        lengths = np.asarray(random.integers(1, self.longest + 1, count))
        for row in rows_of(self.channel):
            before = session.times_s[row] < session.presses[0].contact_s
            idle = session.values[row, before]
            for start in np.flatnonzero(starts):
                part = slice(start, start + lengths[start])
                fallen = session.values[row, part]
                fallen[:] = random.choice(idle, len(fallen))


@dataclass(frozen=True)
class Outliers:
    """A share of the readings of a channel is off by a size, pF, to either side."""

    channel: Channel
    share: float
    size: float

    def __call__(self, session: Session, random: np.random.Generator) -> None:
        """Move readings."""
        count = session.values.shape[1]
        hit = np.flatnonzero(random.random(count) < self.share)
        for row in rows_of(self.channel):
            session.values[row, hit] += self.size * random.choice((-1.0, 1.0), len(hit))


@dataclass(frozen=True)
class Rail:
    """A channel ends at 20 to 80 % of its press.

    `at` is this end, pF. Beyond the end the readings toggle between it and `toggles` above it.
    """

    channel: OneChannel
    at: float | None = None
    toggles: float = 0.0

    def __call__(self, session: Session, random: np.random.Generator) -> None:
        """Cut the channel."""
        row = rows_of(self.channel)[0]
        end = session.levels[row] + random.uniform(0.2, 0.8) * session.changes[row]
        if self.at is not None:
            session.values[row] += self.at - end
            end = self.at
        beyond = session.values[row] > end
        session.values[row, beyond] = end
        session.values[row, beyond] += self.toggles * random.integers(0, 2, int(beyond.sum()))


@dataclass(frozen=True)
class Frozen:
    """A channel stays at one reading from a time, s, on; at its own one, or at `value`, pF."""

    channel: Channel
    from_s: float
    value: float | None = None

    def __call__(self, session: Session, random: np.random.Generator) -> None:
        """Freeze the channel."""
        for row in rows_of(self.channel):
            first = int(np.searchsorted(session.times_s[row], self.from_s))
            last = session.values[row, first] if self.value is None else self.value
            session.values[row, first:] = last


@dataclass(frozen=True)
class Falling:
    """Both channels fall when pressed."""

    channel: Channel = "both"

    def __call__(self, session: Session, random: np.random.Generator) -> None:
        """Turn the sign of the changes."""
        session.values = 2 * session.levels[:, np.newaxis] - session.values


# Steps of a level


def add_step(session: Session, row: int, at_s: float, size: float, length_s: float = 0.0) -> None:
    """Add a step, pF, that takes some time."""
    t = session.times_s[row]
    share = smooth((t - at_s) / length_s) if length_s else np.asarray(t >= at_s, float)
    session.values[row] += size * share


@dataclass(frozen=True)
class Jump:
    """A level jumps, pF, at rest after the third press; with `both` by less in the soft channel."""

    channel: Channel
    size: float
    after: int = 2

    def __call__(self, session: Session, random: np.random.Generator) -> None:
        """Jump, at once or within 0.1 s."""
        before, following = session.presses[self.after : self.after + 2]
        at_s = random.uniform(before.end_s + 0.3, following.contact_s - 0.3)
        length_s = random.choice((0.0, 0.1))
        for row in rows_of(self.channel):
            size = self.size * (0.7 if self.channel == "both" and row == SOFT else 1.0)
            add_step(session, row, at_s, size, length_s)


@dataclass(frozen=True)
class StepInPress:
    """A level steps, pF, within a part of the second press, and stays."""

    channel: OneChannel
    size: float
    part: Part

    def __call__(self, session: Session, random: np.random.Generator) -> None:
        """Step between two readings."""
        press = session.presses[1]
        places = {
            "rise": (press.contact_s + 0.3 * (press.held_s - press.contact_s), press.held_s),
            "hold": (press.held_s + 0.3, press.release_s - 0.3),
            "fall": (press.release_s, press.end_s - 0.3 * (press.end_s - press.release_s)),
        }
        add_step(session, rows_of(self.channel)[0], random.uniform(*places[self.part]), self.size)


@dataclass(frozen=True)
class BaselineStep:
    """The level of a channel moves by a size, pF, up or down, in each press."""

    channel: OneChannel
    size: float
    when: Moment

    def __call__(self, session: Session, random: np.random.Generator) -> None:
        """Move the level."""
        row = rows_of(self.channel)[0]
        for press in session.presses:
            size = self.size * random.choice((-1.0, 1.0))
            if self.when == "evenly":
                t = session.times_s[row]
                length_s = press.end_s - press.contact_s
                session.values[row] += size * np.clip((t - press.contact_s) / length_s, 0, 1)
                continue
            at = (press.contact_s, press.held_s)
            if self.when == "release":
                at = (press.release_s, press.end_s)
            add_step(session, row, at[0], size, at[1] - at[0])


@dataclass(frozen=True)
class Drift:
    """The levels move evenly all the time, up to this rate, pF/s."""

    rate: float
    channel: Channel = "both"

    def __call__(self, session: Session, random: np.random.Generator) -> None:
        """Add it."""
        rates = self.rate * random.uniform(-1, 1, 2)
        session.values += rates[:, np.newaxis] * session.times_s


# Slow noise


@dataclass(frozen=True)
class Breathing:
    """A line of 0.3 Hz in both channels, with this amplitude in one, pF, and less in the other."""

    amplitude: float = 1e-3
    channel: Channel = "both"

    def __call__(self, session: Session, random: np.random.Generator) -> None:
        """Add it."""
        sizes = np.array([1.0, random.uniform(0.3, 1.0)])
        phase = random.uniform(0, 2 * np.pi)
        frequency = random.uniform(0.25, 0.35)
        line = np.sin(2 * np.pi * frequency * session.times_s + phase)
        session.values += self.amplitude * random.permutation(sizes)[:, np.newaxis] * line


@dataclass(frozen=True)
class Walk:
    """A random walk of each channel, pF / sqrt(s)."""

    size: float = 2e-4
    channel: Channel = "both"

    def __call__(self, session: Session, random: np.random.Generator) -> None:
        """Add it."""
        moves = random.standard_normal(session.values.shape)
        session.values += self.size * np.sqrt(session.pair_s) * np.cumsum(moves, axis=1)


@dataclass(frozen=True)
class Flicker:
    """Noise with a density of 1/f from 0.01 Hz on, as lines; its size in pF of a factor e."""

    size: float = 1.15e-4
    count: int = 60
    channel: Channel = "both"

    def __call__(self, session: Session, random: np.random.Generator) -> None:
        """Add it, up to half of the rate of pairs."""
        span = np.log(0.5 / session.pair_s / 0.01)
        for row in (HARD, SOFT):
            frequencies = 0.01 * np.exp(span * random.random(self.count))
            amplitudes = random.rayleigh(self.size * np.sqrt(span / self.count), self.count)
            phases = random.uniform(0, 2 * np.pi, self.count)
            session.values[row] += Lines(frequencies, amplitudes, phases)(session.times_s[row])


@dataclass(frozen=True)
class Autoregressive:
    """Noise of each channel in which a reading keeps a share of the one before it."""

    kept: float = 0.9
    size: float = 4e-5
    length: int = 120
    channel: Channel = "both"

    def __call__(self, session: Session, random: np.random.Generator) -> None:
        """Add it."""
        response = self.kept ** np.arange(self.length)
        for row in (HARD, SOFT):
            count = session.values.shape[1]
            white = self.size * random.standard_normal(count + self.length - 1)
            session.values[row] += np.convolve(white, response, "valid")
