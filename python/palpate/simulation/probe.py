"""Simulation of a hand-held probe with one converter, together with the true ratio.

A force profile (presses, tremor) acts on both bumps. The capacitance change of each channel is proportional to
its force; the ratio of the two follows from the object under the probe, eq. (2). The AD7746 converts the two
channels one after the other. A conversion is an average over its duration, with the noise of the data sheet, and
is rounded to a 24-bit code. All random numbers come from one seed.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate.ad7746.datasheet import CODES_PER_PF, CONVERSION_S, NOISE_PF, SATURATED_CODES, SATURATED_PF, ZERO_CODE
from palpate.samples import DTYPE, Block, Status
from palpate.simulation.press import Press
from palpate.simulation.tremor import Tremor

# Gauss-Legendre points in units of half a conversion time: exact to 1e-9 for the press and the tremor.
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(4)


@dataclass(frozen=True)
class Scenario:
    """Settings of a simulation: presses, tremor, noise, drift, faults.

    Attributes
    ----------
    presses : sequence of Press
    duration_s : float
        Length of the simulation.
    tremor : float
        Hand tremor, rms, relative to the force of the press.
    tremor_record : sequence of (time s, value), optional
        A measured accelerometer record instead of the random spectrum; scaled to `tremor`.
    ratio_drift : float
        Relative change of the ratio per second of a touch.
    oblique : float
        Standard deviation of a random factor on the ratio, one for each press (oblique contact).
    nonlinearity : float, 1/pF
        c = f (1 + nonlinearity f), where f is the capacitance change of a linear gauge, pF.
    capf : int
        Speed of the converter, 0 to 7.
    bus_s, jitter_s : float
        Time between two conversions, and its random part.
    baseline_pF, drift_pF_per_s : (float, float)
        Capacitance of the hard and the soft channel without contact, and its drift.
    spikes_per_s, spike_pF : float
        Electromagnetic interference: number of disturbed conversions per second, and the size (of either sign).
    lost : float
        Fraction of lost conversions, 0 to 1.

    Raises
    ------
    ValueError
        A value is outside its range.

    Examples
    --------
    >>> light = Scenario(presses=[Press(1.0, [(0.0, 2.5)], depth_pF=0.02)], duration_s=9.0, lost=0.01)
    >>> simulate(light).hard.shape
    (346,)
    """

    presses: Sequence[Press] = ()
    duration_s: float = 10.0
    tremor: float = 0.01
    tremor_record: tuple[ArrayLike, ArrayLike] | None = None
    ratio_drift: float = 0.0
    oblique: float = 0.0
    nonlinearity: float = 0.0
    capf: int = 0
    bus_s: float = 0.002
    jitter_s: float = 0.0002
    baseline_pF: tuple[float, float] = (0.62, -0.41)
    drift_pF_per_s: tuple[float, float] = (0.0, 0.0)
    spikes_per_s: float = 0.0
    spike_pF: float = 0.0
    lost: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        if not 0 <= self.capf < len(CONVERSION_S):
            raise ValueError(f"capf: got {self.capf}, allowed: 0 to {len(CONVERSION_S) - 1}")
        for name in ("tremor", "oblique", "spikes_per_s", "spike_pF", "lost", "jitter_s", "bus_s", "duration_s"):
            if not getattr(self, name) >= 0:
                raise ValueError(f"{name}: got {getattr(self, name)}, allowed: 0 or more")


@dataclass(frozen=True)
class Simulation:
    """Simulated readings of both channels, with the true ratio.

    Attributes
    ----------
    t_hard_s, t_soft_s : numpy.ndarray, shape (n,)
        Middle of each conversion.
    hard, soft : numpy.ndarray, shape (n,), pF
        Readings; nan if the conversion was lost.
    hard_raw, soft_raw : numpy.ndarray of int, shape (n,)
        24-bit codes; -1 if lost.
    status : numpy.ndarray of int, shape (n,)
        `palpate.Status` of each pair.
    true_ratio : numpy.ndarray, shape (n,)
        Ratio of the forces at t_hard_s; nan without contact. With a nonlinearity the ratio of the capacitances
        is different.
    presses : tuple of Press
        The presses, with the factor of oblique contact in their ratios.

    Examples
    --------
    >>> run = simulate(Scenario(presses=[Press(2.0, [(0.0, 2.5)])]), seed=1)
    >>> run.t_hard_s.shape, len(run.block()), float(run.true_ratio[200])
    ((384,), 384, 2.5)
    """

    t_hard_s: NDArray[np.float64]
    t_soft_s: NDArray[np.float64]
    hard: NDArray[np.float64]
    soft: NDArray[np.float64]
    hard_raw: NDArray[np.int64]
    soft_raw: NDArray[np.int64]
    status: NDArray[np.int64]
    true_ratio: NDArray[np.float64]
    presses: tuple[Press, ...] = field(default=())

    @property
    def full_scale_pF(self) -> float:
        """Smallest absolute reading that counts as saturated, pF."""
        return SATURATED_PF

    def block(self) -> Block:
        """Return the pairs as samples; if one channel was lost, neither has a value."""
        block = np.zeros(len(self.hard), DTYPE)
        block["seq"] = np.arange(len(block))
        block["status"] = self.status
        lost = self.status == int(Status.LOST)
        for name, seconds in (("hard", self.t_hard_s), ("soft", self.t_soft_s)):
            block[f"t_{name}_ns"] = np.rint(seconds * 1e9)
            block[f"{name}_raw"] = np.where(lost, -1, getattr(self, f"{name}_raw"))
            block[name] = np.where(lost, np.nan, getattr(self, name))
        return block


class Truth:
    """True capacitances of the two bumps as functions of time, without converter and noise.

    Parameters
    ----------
    scenario : Scenario
    random : numpy.random.Generator
        For the factors of oblique contact and the phases of the tremor.

    Attributes
    ----------
    presses : tuple of Press
        The presses, with the factor of oblique contact in their ratios.
    """

    def __init__(self, scenario: Scenario, random: np.random.Generator) -> None:
        self.presses: tuple[Press, ...] = tuple(
            _oblique(press, 1 + scenario.oblique * random.standard_normal()) for press in scenario.presses
        )
        self._scenario = scenario
        self._tremor = Tremor(scenario.tremor, scenario.tremor_record, random)

    def mean_pF(self, channel: int, middles: NDArray[np.float64], span_s: float) -> NDArray[np.float64]:
        """Return the mean capacitance during each conversion.

        Parameters
        ----------
        channel : int
            0 hard, 1 soft.
        middles : numpy.ndarray, shape (n,)
            Middles of the conversions, s.
        span_s : float
            Duration of a conversion, s.

        Returns
        -------
        numpy.ndarray, shape (n,), pF
        """
        points = middles[:, None] + span_s / 2 * _POINTS
        change = _change(self._scenario, self.presses, points, self._tremor, hard=channel == 0) @ _WEIGHTS / 2
        base = self._scenario.baseline_pF[channel] + self._scenario.drift_pF_per_s[channel] * middles
        return np.asarray(base + change)


def simulate(scenario: Scenario, seed: int = 0) -> Simulation:
    """Simulate the readings of a scenario.

    Parameters
    ----------
    scenario : Scenario
        See `palpate.simulation.scenarios` for named ones.
    seed : int
        The same seed gives the same recording.

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
    step = CONVERSION_S[scenario.capf] + scenario.bus_s
    pairs = int(scenario.duration_s / (2 * step))
    steps = step + scenario.jitter_s * random.uniform(-1, 1, 2 * pairs)
    middles = np.cumsum(steps) - CONVERSION_S[scenario.capf] / 2
    truth = Truth(scenario, random)
    channels = []
    for channel, times in enumerate((middles[0::2], middles[1::2])):
        mean = truth.mean_pF(channel, times, CONVERSION_S[scenario.capf])
        noise = NOISE_PF[scenario.capf] * random.standard_normal(pairs)
        hits = random.random(pairs) < scenario.spikes_per_s * step
        spikes = hits * scenario.spike_pF * random.choice([-1.0, 1.0], pairs)
        channels.append((times, mean + noise + spikes, random.random(pairs) < scenario.lost))
    return _converted(channels, truth.presses, scenario)


def _converted(
    channels: list[tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]],
    presses: tuple[Press, ...],
    scenario: Scenario,
) -> Simulation:
    raws, values = [], []
    status = np.zeros(len(channels[0][0]), int)
    for (_, capacitance, lost), flag in zip(channels, (Status.HARD_SATURATED, Status.SOFT_SATURATED), strict=True):
        raw = np.clip(np.rint(capacitance * CODES_PER_PF).astype(int) + ZERO_CODE, 0, 2**24 - 1)
        status[(raw < SATURATED_CODES) | (raw >= 2**24 - SATURATED_CODES)] |= int(flag)
        raws.append(np.where(lost, -1, raw))
        values.append(np.where(lost, np.nan, (raw - ZERO_CODE) / CODES_PER_PF))
    status[channels[0][2] | channels[1][2]] = int(Status.LOST)
    times = channels[0][0]
    truth = np.full(len(times), np.nan)
    for press in presses:
        inside = (times >= press.start_s) & (times <= press.stop_s)
        truth[inside] = _ratio(scenario, press, times[inside])
    return Simulation(times, channels[1][0], values[0], values[1], raws[0], raws[1], status, truth, presses)


def _oblique(press: Press, factor: float) -> Press:
    return Press(**{**press.__dict__, "ratios": tuple((after, ratio * factor) for after, ratio in press.ratios)})


def _ratio(scenario: Scenario, press: Press, t: NDArray[np.float64]) -> NDArray[np.float64]:
    return press.ratio(t) * (1 + scenario.ratio_drift * np.clip(t - press.start_s, 0, None))


def _change(
    scenario: Scenario, presses: tuple[Press, ...], t: NDArray[np.float64], tremor: Tremor, *, hard: bool
) -> NDArray[np.float64]:
    total = np.zeros_like(t)
    shaken = 1 + tremor(t)
    for press in presses:
        force = press.depth_pF * press.profile(t) * shaken
        force *= _ratio(scenario, press, t) if hard else 1.0
        total += force * (1 + scenario.nonlinearity * force)
    return total
