"""Simulation of a hand-held probe with one converter, together with the true ratio.

A force profile (presses, tremor) acts on both bumps. The capacitance change of each channel follows its force; the
ratio of the forces follows from the object under the probe, eq. (2). The AD7746 converts the two channels one after
the other. A conversion is an average over its duration, with the noise of the data sheet, and is rounded to a 24-bit
code. All random numbers come from one seed.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from palpate.ad7746.registers import CODES_PER_PF, SATURATED_CODES, SATURATED_PF, ZERO_CODE
from palpate.samples import Block, Status, blank
from palpate.simulation.press import Array, Press, stream
from palpate.simulation.scenario import Scenario, Truth


@dataclass(frozen=True)
class Simulation:
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
        Ratio of the forces on level bumps at the real time of the hard conversion, with tilt and relaxation; nan
        without contact. It is the result that an ideal probe gives: bumps that are not level or bottom out, gauges,
        creep, lag, cross-talk, baselines and converter add errors to it.
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
    hard_raw: NDArray[np.int64]
    soft_raw: NDArray[np.int64]
    status: NDArray[np.int64]
    true_ratio: Array
    presses: tuple[Press, ...] = field(default=())
    host_stamps: bool = False

    @property
    def full_scale_pF(self) -> float:
        """Smallest absolute reading that counts as saturated, pF."""
        return SATURATED_PF

    def block(self) -> Block:
        """Return the pairs as samples; if one channel was lost, the other keeps its value, with status LOST."""
        block = blank(len(self.hard))
        block["status"] = self.status
        for name, seconds in (("hard", self.t_hard_s), ("soft", self.t_soft_s)):
            block[f"t_{name}_ns"] = np.rint(seconds * 1e9)
            block[f"{name}_raw"] = getattr(self, f"{name}_raw")
            block[name] = getattr(self, name)
        return block


def simulate(scenario: Scenario, seed: int = 0) -> Simulation:
    """Simulate the readings of a scenario.

    Parameters
    ----------
    scenario : Scenario
        See `palpate.simulation.scenarios` for named ones.
    seed : int, 0 or more
        The same seed gives the same recording. Noise and times stay the same when an effect is switched on, so that
        two simulations differ by the effect alone.

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
    converter, faults = scenario.converter, scenario.faults
    times = converter.middles(scenario.duration_s, random)
    pairs = len(times[0])
    truth = Truth(scenario, random, seed)
    noise_factor = faults.burst_noise(scenario.duration_s, stream(seed, "bursts"))
    values, alone = [], []
    for channel, middles in enumerate(times):
        noise = converter.rms_pF * random.standard_normal(pairs) * noise_factor(middles)
        hits = random.random(pairs) < faults.spikes_per_s * converter.step_s
        spikes = hits * faults.spike_pF * random.choice([-1.0, 1.0], pairs)
        values.append(truth.mean_pF(channel, middles, converter.span_s) + noise + spikes)
        alone.append(random.random(pairs) < faults.lost)
    lost = tuple(alone)
    if faults.lost_run:
        both = faults.lost_in_runs(2 * pairs, stream(seed, "lost"))
        lost = (both[0::2], both[1::2])
    t_hard, t_soft = scenario.stamps.reported(*times, stream(seed, "stamps"))
    raws = tuple(map(converter.codes, values))
    return Simulation(
        t_hard,
        t_soft,
        hard=_reading(raws[0], lost[0]),
        soft=_reading(raws[1], lost[1]),
        hard_raw=np.where(lost[0], -1, raws[0]),
        soft_raw=np.where(lost[1], -1, raws[1]),
        status=_status(raws, lost),
        true_ratio=_true_ratio(truth, times[0]),
        presses=truth.presses,
        host_stamps=scenario.stamps.host_s > 0,
    )


def _reading(raw: NDArray[np.int64], lost: NDArray[np.bool_]) -> Array:
    return np.where(lost, np.nan, (raw - ZERO_CODE) / CODES_PER_PF)


def _status(
    raws: tuple[NDArray[np.int64], ...], lost: tuple[NDArray[np.bool_], ...]
) -> NDArray[np.int64]:
    status = np.zeros(len(raws[0]), int)
    for raw, flag in zip(raws, (Status.HARD_SATURATED, Status.SOFT_SATURATED), strict=True):
        status[(raw < SATURATED_CODES) | (raw >= 2**24 - SATURATED_CODES)] |= int(flag)
    status[lost[0] | lost[1]] = int(Status.LOST)
    return status


def _true_ratio(truth: Truth, times: Array) -> Array:
    ratio = np.full(len(times), np.nan)
    for press in truth.presses:
        inside = (times >= press.start_s) & (times <= press.stop_s)
        ratio[inside] = truth.ratio(press, times[inside])
    return ratio
