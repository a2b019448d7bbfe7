"""Sessions of a probe in a hand, with baselines that step, drift, or wander; independent of `palpate.simulation`."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from palpate import Touch, Tracker

Array = NDArray[np.float64]

Scene = Literal["handheld", "sliding"]

NOISE_PF = 4e-5
TREMBLES = 0.04  # share of a press


@dataclass(frozen=True)
class Press:
    """When a press begins and ends, s, how long rise and fall take, s, and its depth in the soft channel, pF."""

    begin_s: float
    end_s: float
    rise_s: float
    fall_s: float
    depth_pF: float

    def shape(self, time_s: Array) -> Array:
        """Return the depth of the probe without tremor, pF."""
        rise = np.clip((time_s - self.begin_s) / self.rise_s, 0, 1)
        fall = np.clip((self.end_s - time_s) / self.fall_s, 0, 1)
        return self.depth_pF * rise**2 * (3 - 2 * rise) * fall**2 * (3 - 2 * fall)


@dataclass
class Session:
    """Readings of some presses on one object; the soft channel is read half a period after the hard one."""

    seed: int
    rate_hz: float = 38.0
    depth_pF: float = 0.25
    seconds: float = 30.0
    rest_s: float = 2.0  # before the first press
    ratio: float = field(init=False)
    presses: list[Press] = field(init=False)
    hard: Array = field(init=False)
    soft: Array = field(init=False)

    def __post_init__(self) -> None:
        """Simulate the presses with white noise."""
        self._random = np.random.default_rng(self.seed)
        self.t_hard = np.arange(0, self.seconds, 1 / self.rate_hz)
        self.t_soft = self.t_hard + 0.5 / self.rate_hz
        self.ratio = float(np.exp(self._random.uniform(np.log(1.6), np.log(8))))
        self.presses = self._presses()
        waves = [(self._random.uniform(3, 12), self._random.uniform(0, 6.28)) for _ in range(6)]
        noises = NOISE_PF * self._random.standard_normal((2, len(self.t_hard)))
        self.hard = 9.3 + self.ratio * self._depth(self.t_hard, waves) + noises[0]
        self.soft = 7.1 + self._depth(self.t_soft, waves) + noises[1]

    def _presses(self) -> list[Press]:
        found = []
        begin_s = self.rest_s
        while begin_s < self.seconds - 5.5:
            hold_s, rise_s, fall_s, share = self._random.uniform(
                [2, 0.15, 0.15, 0.8], [3, 0.4, 0.4, 1.25]
            )
            end_s = begin_s + rise_s + hold_s + fall_s
            found.append(Press(begin_s, end_s, rise_s, fall_s, share * self.depth_pF))
            begin_s = end_s + self._random.uniform(1.5, 4)
        return found

    def _depth(self, time_s: Array, waves: list[tuple[float, float]]) -> Array:
        tremor = np.sum([np.sin(2 * np.pi * f * time_s + phase) for f, phase in waves], axis=0)
        depth = np.sum([press.shape(time_s) for press in self.presses], axis=0)
        moved: Array = depth * (1 + TREMBLES * tremor / np.sqrt(len(waves) / 2))
        return moved

    def sign(self) -> float:
        """Return 1 or -1 by chance."""
        return float(self._random.choice([-1.0, 1.0]))

    def add(self, hard: Array, soft: Array) -> "Session":
        """Add values to the readings, pF."""
        self.hard = self.hard + hard
        self.soft = self.soft + soft
        return self

    def breathe(self, size_pF: float) -> "Session":
        """Add a sine of about .3 Hz to each channel."""
        waves = self._random.uniform([0.25, 0], [0.35, 6.28], (2, 2))
        times_s = (self.t_hard, self.t_soft)
        added = [
            size_pF * np.sin(2 * np.pi * frequency * time_s + phase)
            for (frequency, phase), time_s in zip(waves, times_s, strict=True)
        ]
        return self.add(*added)

    def walk(self, size_pF: float) -> "Session":
        """Add a random walk to each channel, pF per square root of a second."""
        step_pF = size_pF / np.sqrt(self.rate_hz)
        return self.add(
            *step_pF * self._random.standard_normal((2, len(self.t_hard))).cumsum(axis=1)
        )

    def flicker(self, size_pF: float) -> "Session":
        """Add noise to each channel, whose power is inverse to the frequency; standard deviation over four sessions."""
        size = 4 * len(self.t_hard)
        weight = np.maximum(np.arange(size // 2 + 1), 1) ** -0.5
        real, imaginary = self._random.standard_normal((2, 2, len(weight)))
        noise = np.fft.irfft(weight * (real + 1j * imaginary), size)
        return self.add(*size_pF * noise[:, : len(self.t_hard)] / noise.std())

    def autoregress(self, size_pF: float, correlation: float = 0.9) -> "Session":
        """Add an autoregression to each channel, with this correlation from reading to reading."""
        new = np.sqrt(1 - correlation**2) * self._random.standard_normal((2, len(self.t_hard)))
        added = np.zeros_like(new)
        for k in range(1, new.shape[1]):
            added[:, k] = correlation * added[:, k - 1] + size_pF * new[:, k]
        return self.add(*added)

    def touches(self, scene: Scene = "handheld") -> list[tuple[Press, Touch]]:
        """Return the touch of each press that was found; a touch begins within .4 s of its press."""
        tracker = Tracker(scene)
        tracker.process(self.t_hard, self.t_soft, self.hard, self.soft)
        tracker.finish()
        starts_s = [touch.start / self.rate_hz for touch in tracker.touches]
        return [
            (press, touch)
            for press in self.presses
            for start_s, touch in zip(starts_s, tracker.touches, strict=True)
            if abs(start_s - press.begin_s) < 0.4
        ]


@dataclass
class Errors:
    """Errors of touches, and the half-widths of their 95 % intervals, both as shares of the ratio."""

    errors: Array
    halves: Array

    @property
    def coverage(self) -> float:
        """How many intervals contain the ratio, share."""
        return float(np.mean(np.abs(self.errors) < self.halves))

    @property
    def rms(self) -> float:
        """Root of the mean square of the errors."""
        return float(np.sqrt(np.mean(self.errors**2)))


def errors_of(sessions: list[Session], scene: Scene = "handheld", after_s: float = 0.0) -> Errors:
    """Return the errors of the touches that begin later than `after_s`."""
    rows = [
        (touch.ratio / session.ratio - 1, 1.96 * touch.standard_error / session.ratio)
        for session in sessions
        for press, touch in session.touches(scene)
        if press.begin_s >= after_s
    ]
    errors, halves = np.array(rows).T
    return Errors(errors, halves)
