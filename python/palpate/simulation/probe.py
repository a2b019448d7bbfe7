"""Simulation of a hand-held probe with one converter, together with the true ratio.

A force profile (presses, tremor) acts on both bumps. The capacitance change of each channel follows
its force; the ratio of the forces follows from the object under the probe, eq. (2). The AD7746
converts the two channels one after the other. A conversion is an average over its duration, with
the noise of the data sheet, and is rounded to a 24-bit code. All random numbers come from one seed.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import inf

import numpy as np
from numpy.random import Generator

from palpate.ad7746.configuration import SATURATION
from palpate.ad7746.registers import (
    CODES_PER_PF,
    LAST_CODE,
    SATURATED_CODES,
    SATURATED_PF,
    ZERO_CODE,
)
from palpate.recording_protocol import ArrayRecording
from palpate.samples import Block, Status, blank
from palpate.simulation.mechanics import Bumps, Gauge, Substrate, gauged
from palpate.simulation.press import Press, Tilt, tilting
from palpate.simulation.readings import BaselineModel, ConverterModel, Faults, Stamps
from palpate.simulation.signals import (
    Array,
    Codes,
    Course,
    Mask,
    Peaks,
    Spectrum,
    random_of,
    require_within,
)


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
        Distance of the bumps, tremor of the angle, effect of `Press.tilt_deg`.
    bumps : Bumps
        Bumps that are not level, bottom out, have cross-talk.
    gauges : (Gauge, Gauge)
        Curves, creep and lag.
    baselines : (BaselineModel, BaselineModel)
        Level, drift, wander, jump, thermal change.
    converter : ConverterModel
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
    gauges: tuple[Gauge, Gauge] = (Gauge(), Gauge())
    baselines: tuple[BaselineModel, BaselineModel] = (BaselineModel(0.62), BaselineModel(-0.41))
    converter: ConverterModel = field(default_factory=ConverterModel)
    stamps: Stamps = field(default_factory=Stamps)
    faults: Faults = field(default_factory=Faults)

    def __post_init__(self) -> None:
        """Check the ranges."""
        require_within(0, inf, tremor=self.tremor)
        require_within(0, 1e7, duration_s=self.duration_s)

    @property
    def contact_s(self) -> float:
        """Time of the first contact, s; inf: none."""
        return min((press.start_s for press in self.presses), default=inf)


# Gauss-Legendre points in units of half a conversion time: exact to 1e-8 for press and tremor.
_MANY = np.polynomial.legendre.leggauss(4)
_FEW = np.polynomial.legendre.leggauss(2)
_SHORT_S = 0.001


class TrueCapacitance:
    """True capacitances of the two bumps as functions of time, without converter and noise."""

    # presses: The presses, with the factor of oblique contact in their ratios.

    def __init__(self, scenario: Scenario, random: Generator, seed: int = 0) -> None:
        duration_s = scenario.duration_s
        self.presses: list[Press] = []
        for press in scenario.presses:
            factor = 1 + scenario.tilt.oblique * random.standard_normal()
            self.presses.append(_oblique(press, factor))
        self._scenario = scenario
        self._tremor = Peaks().course(random)  # always: the numbers after them stay the same
        if scenario.spectrum != Peaks():
            self._tremor = scenario.spectrum.course(random_of(seed, "tremor"))
        self._nod = scenario.spectrum.course(random_of(seed, "angle"))
        self._tilting = tilting(scenario.tilt, duration_s, random_of(seed, "walk"))
        self._baselines = []
        for channel, baseline in enumerate(scenario.baselines):
            wander = random_of(seed, f"wander {channel}")
            self._baselines.append(baseline.course(scenario.contact_s, duration_s, wander))
        self._phase = random_of(seed, "pickup").uniform(0, 2 * np.pi)
        self._gauged: list[Course] = []
        for gauge, is_hard in zip(scenario.gauges, (True, False), strict=True):
            force = partial(self._force, hard=is_hard)
            self._gauged.append(gauged(gauge, force, duration_s))

    def ratio(self, press: Press, t: Array) -> Array:
        """Return the true ratio at times t, s: of level, linear bumps without cross-talk."""
        return press.ratio(t) * self._tilting(press.start_s, t)

    def mean_pF(self, channel: int, middles: Array, span_s: float) -> Array:
        """Return the mean capacitance during each conversion."""
        points, weights = _MANY
        if span_s <= _SHORT_S:
            points, weights = _FEW
        times = middles[:, None] + span_s / 2 * points
        change = self._change(channel, times) @ weights / 2
        baseline = self._baselines[channel]
        mean = baseline(middles, span_s) + change
        faults = self._scenario.faults
        if faults.pickup_pF:
            mean += faults.pickup(self._phase, middles, span_s)
        return mean

    def _change(self, channel: int, t: Array) -> Array:
        change = self._gauged[channel](t)
        cross_talk = self._scenario.bumps.cross_talk
        if cross_talk:
            other = self._gauged[1 - channel](t)
            change = change + cross_talk * other
        return change

    def _force(self, t: Array, *, hard: bool) -> Array:
        total = np.zeros_like(t)
        bumps = self._scenario.bumps
        tremor = self._scenario.tremor
        shaken: Array | float = 1.0
        if tremor:
            shaken = 1 + tremor * self._tremor(t)
        first = t.min(initial=inf)
        last = t.max(initial=-inf)
        for press in self.presses:
            if last <= press.start_s or press.stop_s <= first:
                continue
            level = press.depth_pF * press.profile(t) * shaken
            ratio = self.ratio(press, t)
            pressed = self._tilted(press, level, ratio, t, hard=hard)
            total += bumps.force(pressed, press.depth_pF, ratio, hard=hard)
        return total

    def _tilted(self, press: Press, level: Array, ratio: Array, t: Array, *, hard: bool) -> Array:
        """Return the force on one bump of the tilted substrate, as `Substrate.pressed`."""
        substrate = self._scenario.substrate
        along, across = np.radians(press.tilt_deg)
        if not (substrate.tremor_deg or along or across):
            return level
        since_s = t - press.start_s
        angle = substrate.angle_deg(press.tilt_deg[0], since_s)
        if substrate.tremor_deg:
            angle = angle + substrate.tremor_deg * self._nod(t)
        # The gauges see the part of the force normal to the substrate.
        share = np.cos(along) * np.cos(across)
        return substrate.pressed(level * share, ratio, angle, hard=hard)


def _oblique(press: Press, factor: float) -> Press:
    ratios = tuple((after, ratio * factor) for after, ratio in press.ratios)
    return replace(press, ratios=ratios)


@dataclass(frozen=True)
class Simulation(ArrayRecording):
    """Simulated readings of both channels, with the true ratio.

    Attributes
    ----------
    t_hard_s, t_soft_s : numpy.ndarray, shape (n,)
        Reported middle of each conversion: with the errors of `Scenario.stamps`.
    hard, soft : numpy.ndarray, shape (n,), pF
        Readings; nan if the conversion of this channel was lost.
    hard_raw, soft_raw : numpy.ndarray of int, shape (n,)
        24-bit codes; -1 if lost.
    status : numpy.ndarray of int, shape (n,)
        `palpate.Status` of each pair; LOST if one channel or both were lost.
    true_ratio : numpy.ndarray, shape (n,)
        Ratio of the forces on level bumps at the real time of the hard conversion, with tilt and
        relaxation; nan without contact. It is the result that an ideal probe gives: bumps that are
        not level or bottom out, gauges, creep, lag, cross-talk, baselines and converter add errors
        to it.
    presses : tuple of Press
        The presses, with the factor of oblique contact in their ratios.
    host_stamps : bool
        Whether the times have the errors of a host: `palpate.touches` smooths them.

    Examples
    --------
    >>> run = simulate(Scenario(presses=[Press(2.0, [(0.0, 2.5)])]), seed=1)
    >>> run.t_hard_s.shape, len(run.block()), float(run.true_ratio[200])
    ((384,), 384, 2.5)
    """

    t_hard_s: Array
    t_soft_s: Array
    hard: Array
    soft: Array
    hard_raw: Codes
    soft_raw: Codes
    status: Codes
    true_ratio: Array
    presses: tuple[Press, ...] = ()
    host_stamps: bool = False

    @property
    def full_scale_pF(self) -> float:
        """Smallest absolute reading that counts as saturated, pF."""
        return SATURATED_PF

    def block(self) -> Block:
        """Return the pairs as samples.

        If one channel was lost, the other keeps its value, with status LOST.
        """
        block = blank(len(self.hard))
        block["status"] = self.status
        block["t_hard_ns"] = np.rint(self.t_hard_s * 1e9)
        block["t_soft_ns"] = np.rint(self.t_soft_s * 1e9)
        block["hard_raw"] = self.hard_raw
        block["soft_raw"] = self.soft_raw
        block["hard"] = self.hard
        block["soft"] = self.soft
        return block


def simulate(scenario: Scenario, seed: int = 0) -> Simulation:
    """Simulate the readings of a scenario.

    Parameters
    ----------
    scenario : Scenario
        See `palpate.simulation.scenarios` for named ones.
    seed : int, 0 or more
        The same seed gives the same recording. Noise and times stay the same when an effect is
        switched on, so that two simulations differ by the effect alone.

    Returns
    -------
    Simulation

    Examples
    --------
    >>> run = simulate(Scenario(presses=[Press(2.0, [(0.0, 2.5)])]), seed=1)
    >>> held = (run.t_hard_s > 3) & (run.t_hard_s < 8)
    >>> float(np.median((run.hard[held] - 0.62) / (run.soft[held] + 0.41)).round(2))
    2.5
    """
    random = np.random.default_rng(seed)
    converter = scenario.converter
    faults = scenario.faults
    times = converter.middles(scenario.duration_s, random)
    pairs = len(times[0])
    truth = TrueCapacitance(scenario, random, seed)
    noise_factor = faults.burst_noise(scenario.duration_s, random_of(seed, "bursts"))
    codes = []
    lost = []
    for channel, middles in enumerate(times):
        white = random.standard_normal(pairs)
        noise = converter.rms_pF * white * noise_factor(middles)
        hits = random.random(pairs) < faults.spikes_per_s * converter.step_s
        signs = random.choice([-1.0, 1.0], pairs)
        spikes = hits * faults.spike_pF * signs
        mean = truth.mean_pF(channel, middles, converter.span_s)
        codes.append(converter.codes(mean + noise + spikes))
        lost.append(random.random(pairs) < faults.lost)
    if faults.lost_run:
        both = faults.lost_in_runs(2 * pairs, random_of(seed, "lost"))
        lost = [both[0::2], both[1::2]]
    t_hard, t_soft = scenario.stamps.reported(*times, random_of(seed, "stamps"))
    return Simulation(
        t_hard,
        t_soft,
        hard=_readings(codes[0], lost[0]),
        soft=_readings(codes[1], lost[1]),
        hard_raw=np.where(lost[0], -1, codes[0]),
        soft_raw=np.where(lost[1], -1, codes[1]),
        status=_status(codes, lost),
        true_ratio=_true_ratio(truth, times[0]),
        presses=tuple(truth.presses),
        host_stamps=scenario.stamps.host_s > 0,
    )


def _readings(codes: Codes, lost: Mask) -> Array:
    values = (codes - ZERO_CODE) / CODES_PER_PF
    return np.where(lost, np.nan, values)


def _status(codes: list[Codes], lost: list[Mask]) -> Codes:
    status = np.zeros(len(codes[0]), int)
    for channel, flag in enumerate(SATURATION):
        low = codes[channel] < SATURATED_CODES
        high = codes[channel] > LAST_CODE - SATURATED_CODES
        status[low | high] |= int(flag)
    status[lost[0] | lost[1]] = int(Status.LOST)
    return status


def _true_ratio(truth: TrueCapacitance, times: Array) -> Array:
    ratio = np.full(len(times), np.nan)
    for press in truth.presses:
        inside = (times >= press.start_s) & (times <= press.stop_s)
        ratio[inside] = truth.ratio(press, times[inside])
    return ratio
