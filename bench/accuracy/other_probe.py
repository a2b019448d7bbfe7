"""A second simulator of a hand-held probe, which shares no code and no assumption with `palpate.simulation`.

The hand sets the depth, not the force: minimum jerk, tremor as filtered noise. Two bumps 3 mm apart are springs with an
exponent; a tilt makes one deeper. Angles tremble and settle; lifts peel; gauges bend and creep. All on a grid of 1 ms.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from palpate.recording_protocol import ArrayRecording

Array = NDArray[np.float64]
STEP_s = 0.001
SPACING_mm = 3.0
SOFT_pF_per_mm = 0.3
RIGID = 10.0
CONVERSION_s = 0.011


@dataclass(frozen=True)
class Way:
    """How a touch is made; times in s, angles in degrees, capacitances in pF."""

    ratio: float = 2.8
    total: float = 1.0  # both channels together, during the hold
    before: float = 2.0
    rise: float = 0.3
    hold: float = 4.0
    fall: float = 0.3
    after: float = 2.5
    exponent: float = 1.0
    soft_exponent: float = 0.0  # of the soft bump; 0: the same
    tremor: float = 0.03
    angle: float = 0.0
    trembling: float = 0.0
    settling: float = 0.0  # share of the angle more at contact, gone in 0.5 s
    in_phase: float = 0.0  # degrees for a tremor of 1
    lifted_ratio: float = 1.0  # factor at the end of the fall
    lifted_angle: float = 0.0
    change: tuple[float, float] = (0.0, 1.0)  # s after the contact, factor
    slide: tuple[float, float] = (0.0, 1.0)  # duration before the release, factor at its end
    pulse: float = 0.0  # of the ratio, at 1.2 Hz
    gap: float = 0.0  # the hard bump is reached first, share of the depth
    creep: tuple[float, float] = (0.0, 0.0)  # of the soft bump within 2 s, and within 20 s
    object_creep: float = 0.0  # of the ratio within 2 s, which ends at the lift
    layer: float = 0.0  # share by which the object is stiffer at a depth of 1 mm
    law: float = 2.0  # it grows with the depth to this power
    gain: float = 1.0  # of the hard channel
    bend: float = 0.0  # of both gauges, 1/pF
    period: float = 0.026
    code: float = 1 / 2**24 * 8.192
    noise: float = 40e-6
    pink: float = 0.0  # common to both channels
    stale: float = 0.0  # share of soft readings that repeat the one before
    swapped: int = 0  # pairs in the last 0.15 s whose readings are exchanged


@dataclass(frozen=True)
class Recorded(ArrayRecording):
    """Readings of both channels; a recording for `palpate.touches`."""

    t_hard_s: Array
    t_soft_s: Array
    hard: Array
    soft: Array
    contacts: tuple[float, ...]  # s
    full_scale_pF: float = 4.096

    def __add__(self, other: "Recorded") -> "Recorded":
        """Join two recordings, one after the other."""
        late = (
            self.t_soft_s[-1]
            + self.t_soft_s[1]
            - self.t_soft_s[0]
            + (self.t_hard_s[0] - other.t_soft_s[0])
        )
        return Recorded(
            np.append(self.t_hard_s, other.t_hard_s + late),
            np.append(self.t_soft_s, other.t_soft_s + late),
            np.append(self.hard, other.hard),
            np.append(self.soft, other.soft),
            (*self.contacts, *(contact + late for contact in other.contacts)),
        )


def minimum_jerk(part: Array) -> Array:
    """Return the way from 0 to 1 (Flash and Hogan, Journal of Neuroscience 5, 1985)."""
    t = np.clip(part, 0, 1)
    return np.asarray(t**3 * (10 - 15 * t + 6 * t**2))


def shaking(random: np.random.Generator, n: int, low: float = 3.0, high: float = 12.0) -> Array:
    """Return noise of a band, Hz, with an rms of 1."""
    spectrum = np.fft.rfft(random.standard_normal(n))
    f = np.fft.rfftfreq(n, STEP_s)
    spectrum[(f < low) | (f > high)] = 0
    values = np.fft.irfft(spectrum, n)
    return np.asarray(values / values.std())


def crept(force: Array, share: float, time_s: float) -> Array:
    """Return the creep that follows a force with a time constant."""
    out = np.empty_like(force)
    level = 0.0
    rate = STEP_s / time_s
    for i, value in enumerate(force):
        level += rate * (value - level)
        out[i] = level
    return share * out


def stiffening(way: Way, depth: Array, bump: float) -> Array:
    """Return the factor of the force on a bump of this stiffness (soft bump: 1) by a layer.

    Bump and object are springs in series: force ~ bump object / (bump + object). The object, which
    gives the ratio r = RIGID (1 + object) / (RIGID + object), is stiffer by layer d^law.
    """
    thick = (way.ratio - 1) / (1 - way.ratio / RIGID)
    stiffer = thick * (1 + way.layer * depth**way.law)
    return stiffer / thick * (bump + thick) / (bump + stiffer)


def _depth(way: Way, stiff: float) -> float:
    """Return the depth of a level press with `way.total`, mm, on an object that stiffens."""
    thick = (way.total / ((1 + way.ratio) * stiff)) ** (1 / way.exponent)
    depth = np.linspace(0, thick, 1000)
    each = way.ratio * stiffening(way, depth, RIGID) + stiffening(way, depth, 1.0)
    return float(np.interp(way.total, each * stiff * depth**way.exponent, depth))


def touch(way: Way, seed: int) -> Recorded:
    """Return the readings of one touch."""
    random = np.random.default_rng((seed, 77))
    release = way.before + way.rise + way.hold
    t = np.arange(0, release + way.fall + way.after, STEP_s)
    lifting = minimum_jerk((t - release) / way.fall)
    shake = shaking(random, len(t))
    r0 = way.ratio
    stiff = SOFT_pF_per_mm * (1 - 1 / r0) / (1 - 1 / RIGID)  # soft bump and object in series
    depth0 = (way.total / ((1 + r0) * stiff)) ** (1 / way.exponent)
    if way.layer:
        depth0 = _depth(way, stiff)
    depth = (
        depth0
        * minimum_jerk((t - way.before) / way.rise)
        * (1 - lifting)
        * (1 + way.tremor * shake)
    )
    ratio = (
        r0 * (1 + way.pulse * np.sin(2 * np.pi * 1.2 * t)) * (1 + (way.lifted_ratio - 1) * lifting)
    )
    if way.change[0]:
        ratio = ratio * np.where(t - way.before > way.change[0], way.change[1], 1)
    if way.slide[0]:
        ratio = ratio * (1 + (way.slide[1] - 1) * np.clip(1 + (t - release) / way.slide[0], 0, 1))
    if way.object_creep:
        held = np.clip(t - way.before, 0, None)
        ratio = ratio * (1 - way.object_creep * (1 - np.exp(-held / 2.0)))
    angle = way.angle * (1 + way.settling * np.exp(-np.clip(t - way.before, 0, None) / 0.5))
    angle = (
        angle
        + way.trembling * shaking(random, len(t))
        + way.in_phase * shake
        + way.lifted_angle * lifting
    )
    half = SPACING_mm * np.tan(np.radians(angle)) / 2
    hard_depth = np.clip(depth + half + way.gap * depth0 * (depth > 0), 0, None)
    soft_depth = np.clip(depth - half, 0, None)
    hard = ratio * stiff * hard_depth**way.exponent
    soft = stiff * soft_depth ** (way.soft_exponent or way.exponent)
    if way.layer:
        hard *= stiffening(way, hard_depth, RIGID)
        soft *= stiffening(way, soft_depth, 1.0)
    off = (t < way.before) | (t > release + way.fall)
    hard[off] = soft[off] = 0
    if any(way.creep):
        soft = soft + crept(soft, way.creep[0], 2.0) + crept(soft, way.creep[1], 20.0)
    channels = [values * (1 + way.bend * values) for values in (hard, soft)]
    channels[0] *= way.gain
    if way.pink:
        common = way.pink * np.cumsum(random.standard_normal(len(t))) * np.sqrt(STEP_s)
    else:
        common = 0.0
    return _converted(
        way, t, [channels[0] + 0.62 + common, channels[1] - 0.41 + common], release, random
    )


def _converted(
    way: Way, t: Array, channels: list[Array], release: float, random: np.random.Generator
) -> Recorded:
    pairs = int((t[-1] - 0.1) / way.period)
    length = min(CONVERSION_s, way.period / 2.2)
    times = []
    values = []
    for number, channel in enumerate(channels):
        middle = 0.05 + way.period * (np.arange(pairs) + number / 2)
        sums = np.concatenate([[0.0], np.cumsum(channel)])
        ends = [
            np.interp((middle + side * length / 2) / STEP_s, np.arange(len(sums)), sums)
            for side in (-1, 1)
        ]
        read = (ends[1] - ends[0]) / (length / STEP_s) + way.noise * random.standard_normal(pairs)
        values.append(np.rint(read / way.code) * way.code)
        times.append(np.asarray(middle, float))
    stale = np.flatnonzero(random.random(pairs) < way.stale)
    values[1][stale[stale > 0]] = values[1][stale[stale > 0] - 1]
    if way.swapped:
        last = np.flatnonzero(times[0] < release)[-int(0.15 / way.period) :]
        which = random.choice(last, way.swapped, replace=False)
        values[0][which], values[1][which] = values[1][which].copy(), values[0][which].copy()
    return Recorded(times[0], times[1], values[0], values[1], (way.before,))
