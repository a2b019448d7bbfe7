"""Input of the simulated board: the bumps of a scenario, read by the real driver."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np
from numpy.random import Generator

from palpate.ad7746.bus import Clock
from palpate.ad7746.driver import LIMIT_NS
from palpate.ad7746.registers import NOISE_PF
from palpate.ad7746.simulator.chip import WIRINGS, BumpCapacitance, SimulatedChip, SimulatedWiring
from palpate.ad7746.simulator.evalboard import BUS_KHZ, SimulatedBoard
from palpate.simulation.hand import SESSIONS
from palpate.simulation.probe import Scenario, TrueCapacitance
from palpate.simulation.readings import ConverterModel, Stamps
from palpate.simulation.scenarios import SCENARIOS
from palpate.simulation.signals import random_of

PAUSED_PF_PER_S = (2e-5, 1e-5)
"""Drift of the hard and the soft bump while the computer pauses: a probe that warms up."""
PARASITIC_PF = (6.3, 5.1)  # of the hard and the soft bump; the CAPDACs compensate it


def unsupported(scenario: Scenario) -> str:
    """Return the parts of a scenario that a simulated AD7746 with its driver cannot have.

    Parameters
    ----------
    scenario : Scenario

    Returns
    -------
    str
        Empty: there are none.
    """
    parts = []
    own = ConverterModel()
    converter = replace(scenario.converter, capf=0, bus_s=own.bus_s, jitter_s=own.jitter_s)
    if converter != own:
        parts.append("another converter")
    if scenario.stamps != Stamps():
        parts.append("wrong time stamps")
    if scenario.faults.lost_run > 0:  # the driver opens the board again, then ends
        parts.append("runs of lost conversions")
    return " and ".join(parts)


def board_scenarios() -> dict[str, Scenario]:
    """Return the scenarios that the simulated board can follow, by name."""
    every = SCENARIOS | SESSIONS
    return {name: scenario for name, scenario in every.items() if not unsupported(scenario)}


def limit_ns(speed: float | None) -> int:
    """Return the limit of `Ad7746`: delays of the computer count more in faster time."""
    return round(LIMIT_NS * max(speed or 1.0, 1.0))


@dataclass(frozen=True)
class SimulatedInput:
    """A simulated board, and what its bumps measure.

    Attributes
    ----------
    board : SimulatedBoard
    truth : TrueCapacitance
        Its presses may be exchanged during the measurement.
    start_s : float
        Begin of the scenario on the clock of the board, s.
    """

    board: SimulatedBoard
    truth: TrueCapacitance
    start_s: float


def simulated_input(
    scenario: Scenario,
    clock: Clock,
    seed: int = 0,
    wiring: SimulatedWiring = WIRINGS["guide"],
    *,
    bus_kHz: float = BUS_KHZ,
    idle_s: float = 0.0,
    paused_s: Callable[[], float] = lambda: 0.0,
) -> SimulatedInput:
    """Return a board whose bumps follow a scenario from now on, and its presses.

    `paused_s` returns how long the computer has paused, s: the hand waits meanwhile, and the
    baselines drift.
    """
    if parts := unsupported(scenario):
        allowed = "allowed on a board: its own; use palpate.simulation.run"
        raise ValueError(f"scenario: got {parts}, {allowed}")
    random = np.random.default_rng(seed)
    start_s = clock.now_ns() / 1e9 + idle_s
    truth = TrueCapacitance(scenario, random, seed)
    chip = SimulatedChip(_bumps(truth, start_s, paused_s), seed=seed, wiring=wiring)
    faults = scenario.faults
    if faults.lost or faults.spikes_per_s or faults.bursts_per_s:

        def since_s() -> float:
            return max(clock.now_ns() / 1e9 - start_s - paused_s(), 0.0)

        chip.disturbance = _disturbance(scenario, chip, random, since_s, seed)
    board = SimulatedBoard(chip, clock, bus_kHz=bus_kHz)
    return SimulatedInput(board, truth, start_s)


def simulated_board(scenario: Scenario, clock: Clock, seed: int = 0) -> SimulatedBoard:
    """Return a board whose bumps follow a scenario from now on."""
    return simulated_input(scenario, clock, seed).board


def _disturbance(
    scenario: Scenario,
    chip: SimulatedChip,
    random: Generator,
    since_s: Callable[[], float],
    seed: int,
) -> Callable[[], float]:
    faults = scenario.faults
    spike_rate = faults.spikes_per_s * scenario.converter.step_s
    chip_noise_pF = NOISE_PF[scenario.converter.capf]
    noise_factor = faults.burst_noise(scenario.duration_s, random_of(seed, "bursts"))
    noise = random_of(seed, "burst noise")

    def disturbance() -> float:
        chip.lose += random.random() < faults.lost
        hit = random.random() < spike_rate
        sign = random.choice([-1.0, 1.0])
        total_pF = float(hit * faults.spike_pF * sign)
        if not faults.bursts_per_s:
            return total_pF
        now = np.array([since_s()])
        factor = float(noise_factor(now)[0])
        if factor > 1:
            # The chip adds its own noise: this is the rest of a variance of factor^2.
            rest = sqrt(factor**2 - 1)
            total_pF += rest * chip_noise_pF * noise.standard_normal()
        return total_pF

    return disturbance


def _bumps(
    truth: TrueCapacitance, start_s: float, paused_s: Callable[[], float]
) -> BumpCapacitance:
    def mean_pF(bump: int, begin_s: float, end_s: float) -> float:
        channel = bump - 1
        pause_s = paused_s()
        middle_s = (begin_s + end_s) / 2 - start_s - pause_s
        middles = np.array([max(middle_s, 0.0)])
        changes = truth.mean_pF(channel, middles, end_s - begin_s)
        drift_pF = PAUSED_PF_PER_S[channel] * pause_s
        return PARASITIC_PF[channel] + float(changes[0]) + drift_pF

    return mean_pF
