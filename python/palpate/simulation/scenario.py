"""A simulated measurement with its settings, and the true capacitances as functions of time."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import inf

import numpy as np

from palpate.simulation.mechanics import Bumps, Gauge, Substrate, gauged
from palpate.simulation.press import Array, Peaks, Press, Spectrum, Tilt, stream, tilting, within
from palpate.simulation.readings import Baseline, Converter, Faults, Stamps


@dataclass(frozen=True)
class Scenario:
    """Settings of a simulation. Each part has its own class; pairs are (hard, soft).

    Attributes
    ----------
    presses : sequence of Press
    duration_s : float
        Length of the simulation.
    tremor : float
        Hand tremor, rms, relative to the force of the press.
    spectrum : Peaks or Lines
        Of the tremor.
    tilt : Tilt
        Changes of the ratio.
    substrate : Substrate
        Distance of the bumps, tremor of the angle; what `Press.tilt_deg` does.
    bumps : Bumps
        Bumps that are not level, bottom out, have cross-talk.
    gauges : (Gauge, Gauge)
        Curves, creep and lag.
    baselines : (Baseline, Baseline)
        Level, drift, wander, jump, thermal change.
    converter : Converter
        Speed, noise, resolution.
    stamps : Stamps
        Errors of the reported times.
    faults : Faults
        Lost conversions, spikes, noise bursts, pickup.

    Raises
    ------
    ValueError
        A value is outside its range.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from palpate.simulation import simulate
    >>> light = Scenario(presses=[Press(1.0, [(0.0, 2.5)], depth_pF=0.02)], duration_s=9.0)
    >>> simulate(replace(light, faults=Faults(lost=0.01))).hard.shape
    (346,)
    """

    presses: Sequence[Press] = ()
    duration_s: float = 10.0
    tremor: float = 0.01
    spectrum: Spectrum = field(default_factory=Peaks)
    tilt: Tilt = field(default_factory=Tilt)
    substrate: Substrate = field(default_factory=Substrate)
    bumps: Bumps = field(default_factory=Bumps)
    gauges: tuple[Gauge, Gauge] = field(default_factory=lambda: (Gauge(), Gauge()))
    baselines: tuple[Baseline, Baseline] = field(
        default_factory=lambda: (Baseline(0.62), Baseline(-0.41))
    )
    converter: Converter = field(default_factory=Converter)
    stamps: Stamps = field(default_factory=Stamps)
    faults: Faults = field(default_factory=Faults)

    def __post_init__(self) -> None:
        """Check the ranges."""
        within(self, 0, inf, "tremor")
        within(self, 0, 1e7, "duration_s")

    @property
    def contact_s(self) -> float:
        """Time of the first contact, s; inf: none."""
        return min((press.start_s for press in self.presses), default=inf)


# Gauss-Legendre points in units of half a conversion time: exact to 1e-8 for the press and the tremor.
_MANY, _FEW = np.polynomial.legendre.leggauss(4), np.polynomial.legendre.leggauss(2)
_SHORT_S = 0.001


class Truth:
    """True capacitances of the two bumps as functions of time, without converter and noise."""

    # presses: The presses, with the factor of oblique contact in their ratios.

    def __init__(self, scenario: Scenario, random: np.random.Generator, seed: int = 0) -> None:
        self.presses: tuple[Press, ...] = tuple(
            _oblique(press, 1 + scenario.tilt.oblique * random.standard_normal())
            for press in scenario.presses
        )
        self._scenario = scenario
        peaks = Peaks().course(random)  # always: the numbers after them stay the same
        own = scenario.spectrum != Peaks()
        self._tremor = scenario.spectrum.course(stream(seed, "tremor")) if own else peaks
        self._nod = scenario.spectrum.course(stream(seed, "angle"))
        self._tilting = tilting(scenario.tilt, scenario.duration_s, stream(seed, "walk"))
        self._baselines = [
            baseline.course(
                scenario.contact_s, scenario.duration_s, stream(seed, f"wander {channel}")
            )
            for channel, baseline in enumerate(scenario.baselines)
        ]
        self._phase = stream(seed, "pickup").uniform(0, 2 * np.pi)
        self._gauged = [
            gauged(gauge, partial(self._force, hard=hard), scenario.duration_s)
            for gauge, hard in zip(scenario.gauges, (True, False), strict=True)
        ]

    def ratio(self, press: Press, t: Array) -> Array:
        """Return the true ratio of one press at times t, s: for level, linear bumps without cross-talk."""
        return press.ratio(t) * self._tilting(press.start_s, t)

    def mean_pF(self, channel: int, middles: Array, span_s: float) -> Array:
        """Return the mean capacitance during each conversion."""
        points, weights = _FEW if span_s <= _SHORT_S else _MANY
        change = self._change(channel, middles[:, None] + span_s / 2 * points) @ weights / 2
        mean = self._baselines[channel](middles, span_s) + change
        if self._scenario.faults.pickup_pF:
            mean += self._scenario.faults.pickup(self._phase, middles, span_s)
        return np.asarray(mean)

    def _change(self, channel: int, t: Array) -> Array:
        change = self._gauged[channel](t)
        if self._scenario.bumps.cross_talk:
            change = change + self._scenario.bumps.cross_talk * self._gauged[1 - channel](t)
        return change

    def _force(self, t: Array, *, hard: bool) -> Array:
        total = np.zeros_like(t)
        shaken = 1 + self._scenario.tremor * self._tremor(t) if self._scenario.tremor else 1.0
        first, last = t.min(initial=inf), t.max(initial=-inf)
        for press in self.presses:
            if last <= press.start_s or press.stop_s <= first:
                continue
            pressed = press.depth_pF * press.profile(t) * shaken
            ratio = self.ratio(press, t)
            substrate, (along, across) = self._scenario.substrate, np.radians(press.tilt_deg)
            if substrate.tremor_deg or along or across:
                angle = substrate.angle_deg(press.tilt_deg[0], t - press.start_s)
                if substrate.tremor_deg:
                    angle = angle + substrate.tremor_deg * self._nod(t)
                # The gauges see the part of the force normal to the substrate.
                pressed = substrate.pressed(
                    pressed * (np.cos(along) * np.cos(across)), ratio, angle, hard=hard
                )
            total += self._scenario.bumps.force(pressed, press.depth_pF, ratio, hard=hard)
        return total


def _oblique(press: Press, factor: float) -> Press:
    return replace(press, ratios=tuple((after, ratio * factor) for after, ratio in press.ratios))
