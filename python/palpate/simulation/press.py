"""Motion of the hand: presses on an object, and tilt of the probe during them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from palpate.simulation.signals import Array, require_positive, require_within


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
        The object relaxes: from contact on the ratio falls by this share (rises if below 0), with
        this time constant, s.
    tilt_deg : (float, float), degrees
        Tilt of the substrate in the plane through both bumps (above 0: the hard bump is deeper),
        and at right angles to it. `palpate.simulation.mechanics.Substrate` has its effect.
    name : str
        Name of the object; "": it has none.

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
    name: str = ""

    def __post_init__(self) -> None:
        """Check the ranges."""
        require_within(-np.inf, 1, relaxes=self.relaxes)
        require_within(-45, 45, tilt_deg=self.tilt_deg)
        require_positive(
            rise_s=self.rise_s,
            hold_s=self.hold_s,
            fall_s=self.fall_s,
            relaxation_s=self.relaxation_s,
        )

    @property
    def stop_s(self) -> float:
        """Time of the end of the fall, s."""
        return self.start_s + self.rise_s + self.hold_s + self.fall_s

    def profile(self, t: Array) -> Array:
        """Return the press without tremor at times t, s: 0 to 1, times 1 + creep."""
        since = t - self.start_s
        rise = np.clip(since / self.rise_s, 0, 1)
        fall = np.clip((self.stop_s - t) / self.fall_s, 0, 1)
        held = np.clip((since - self.rise_s) / self.hold_s, 0, 1)
        creep = 1 + self.creep * held
        angle = np.pi * np.minimum(rise, fall)
        return np.asarray(0.5 * (1 - np.cos(angle)) * creep)

    def ratio(self, t: Array) -> Array:
        """Return the ratio of this press at times t, s."""
        after, values = np.array(self.ratios, float).T
        starts = self.start_s + after
        latest = np.searchsorted(starts, t, "right") - 1
        ratio = values[np.maximum(latest, 0)]
        if self.relaxes:
            since = np.maximum(t - self.start_s, 0)
            relaxed = np.expm1(-since / self.relaxation_s)
            ratio = ratio * (1 + self.relaxes * relaxed)
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
        Random walk: standard deviation of the relative change of the ratio after one second of a
        touch.

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
        require_within(0, np.inf, oblique=self.oblique, rock=self.rock, walk=self.walk)
        require_positive(rock_Hz=self.rock_Hz)


def tilting(tilt: Tilt, duration_s: float, random: Generator) -> Callable[[float, Array], Array]:
    """Return the factor on the ratio, as a function of the start of a press, s, and of times, s."""
    steps = np.zeros(1)
    if tilt.walk:
        count = int(duration_s / _STEP_S) + 1
        steps = random.standard_normal(count)
    times = _STEP_S * np.arange(len(steps) + 1)
    walked = np.cumsum(np.append(0.0, steps))
    walk = tilt.walk * np.sqrt(_STEP_S) * walked

    def factor(start_s: float, t: Array) -> Array:
        since = np.maximum(t - start_s, 0)
        ramped = 1 + tilt.ramp_per_s * since
        rocking = np.sin(2 * np.pi * tilt.rock_Hz * since)
        rocked = ramped * (1 + tilt.rock * rocking)
        now = np.interp(start_s + since, times, walk)
        at_start = np.interp(start_s, times, walk)
        return np.asarray(rocked * (1 + now - at_start))

    return factor
