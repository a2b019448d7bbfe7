"""Presses of a hand or of a stage, with the faults of a lab: readings made without the simulation of the package."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
NOISE = 4e-5  # pF
# levels without contact, pF
HARD = 9.0
SOFT = 8.0


@dataclass(frozen=True)
class Press:
    """One press: begin, rise, hold and fall in s, and the depth of the soft bump in pF."""

    begin: float
    depth: float = 0.25
    rise: float = 0.3
    hold: float = 2.5
    fall: float = 0.3

    @property
    def end(self) -> float:
        """When both channels are at rest again, s."""
        return self.begin + self.rise + self.hold + self.fall

    def shape(self, t: Array) -> Array:
        """Return the share of the depth at these times."""
        up = np.clip((t - self.begin) / self.rise, 0, 1)
        down = np.clip((t - self.begin - self.rise - self.hold) / self.fall, 0, 1)
        both: Array = 0.25 * (1 - np.cos(np.pi * up)) * (1 + np.cos(np.pi * down))
        return both


@dataclass
class Session:
    """Readings of both channels; the soft one is read half a period later."""

    presses: list[Press]
    ratio: float
    t_hard: Array
    t_soft: Array
    hard: Array
    soft: Array = field(default_factory=lambda: np.zeros(0))

    def step(self, channel: str, at_s: float, size: float, until_s: float = np.inf) -> None:
        """Add a constant to a channel from one time to another one."""
        t = self.t_hard if channel == "hard" else self.t_soft
        values = self.values_of(channel)
        values += size * ((t >= at_s) & (t < until_s))

    def values_of(self, channel: str) -> Array:
        """Return the readings of "hard" or "soft"."""
        return self.hard if channel == "hard" else self.soft

    def print(self, decimals: int) -> None:
        """Round the readings."""
        self.hard, self.soft = np.round(self.hard, decimals), np.round(self.soft, decimals)

    @property
    def columns(self) -> tuple[Array, Array, Array, Array]:
        """Times and readings, as `Tracker.process` takes them."""
        return self.t_hard, self.t_soft, self.hard, self.soft


def session(
    seed: int,
    presses: list[Press] | None = None,
    *,
    pairs_per_s: float = 38.0,
    tremor: float = 0.01,
    noise: float = NOISE,
    count: int = 10,
    depth: float = 0.25,
) -> Session:
    """Return presses each 7 s; `tremor`: rms share of the depth, four tones of 3 to 12 Hz; 0: a stage."""
    rng = np.random.default_rng(seed)
    made = presses or [
        Press(
            3 + 7 * k + rng.uniform(0, 1),
            depth * rng.uniform(0.7, 1.3),
            rise=rng.uniform(0.15, 0.4),
            hold=rng.uniform(2, 3),
            fall=rng.uniform(0.15, 0.4),
        )
        for k in range(count)
    ]
    ratio = rng.uniform(1.6, 8.0)
    t = np.arange(0.3, made[-1].end + 3, 1 / pairs_per_s)
    later = t + 0.5 / pairs_per_s
    tones = rng.uniform(3, 12, 4), rng.uniform(0, 2 * np.pi, 4)
    sway = rng.uniform(0.1, 0.4)

    def depth_at(times: Array) -> Array:
        trembles = sum(np.sin(2 * np.pi * f * times + p) for f, p in zip(*tones, strict=True))
        slow = 3 * np.sin(2 * np.pi * sway * times) if tremor else 0.0
        motion = 1 + tremor * (trembles / np.sqrt(2) + slow)
        return np.asarray(sum(press.depth * press.shape(times) for press in made) * motion)

    hard = HARD + ratio * depth_at(t) + rng.normal(0, noise, t.size)
    soft = SOFT + depth_at(later) + rng.normal(0, noise, t.size)
    return Session(made, ratio, t, later, hard, soft)
