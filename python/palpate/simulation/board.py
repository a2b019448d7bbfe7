"""A simulated scenario as input of the simulated board, read by the real driver."""

from collections.abc import Callable
from dataclasses import replace
from math import sqrt

import numpy as np

from palpate.ad7746.clock import Clock, RealClock, VirtualClock
from palpate.ad7746.configuration import Configuration
from palpate.ad7746.datasheet import NOISE_PF
from palpate.ad7746.driver import LIMIT_NS, Ad7746
from palpate.ad7746.evalkit.board import EvalKit
from palpate.ad7746.twin.chip import ChipTwin
from palpate.ad7746.twin.kit import BUS_KHZ, KitTwin
from palpate.ad7746.twin.usb import TwinBackend
from palpate.ad7746.twin.wiring import WIRINGS, Pins, Wiring
from palpate.simulation.converter import Converter, Stamps
from palpate.simulation.ranges import stream
from palpate.simulation.scenario import Scenario
from palpate.simulation.scenarios import SCENARIOS
from palpate.simulation.sessions import SESSIONS
from palpate.simulation.truth import Truth

PARASITIC_PF = (6.3, 5.1)
"""Parasitic capacitance of the two bumps, hard and soft, pF, which the CAPDACs compensate."""


def foreign(scenario: Scenario) -> str:
    """Return what of a scenario the simulated board, an AD7746 with its driver, cannot have; "": nothing.

    Parameters
    ----------
    scenario : Scenario

    Returns
    -------
    str
    """
    own = replace(scenario.converter, capf=0, bus_s=Converter.bus_s, jitter_s=Converter.jitter_s)
    found = {
        "another converter": own != Converter(),
        "wrong time stamps": scenario.stamps != Stamps(),
        "runs of lost conversions": scenario.faults.lost_run > 0,  # the driver opens the board again, then ends
    }
    return " and ".join(what for what, has in found.items() if has)


def known() -> list[str]:
    """Return the names of the scenarios that the simulated board can follow."""
    return [name for name, scenario in (SCENARIOS | SESSIONS).items() if not foreign(scenario)]


def limit_ns(speed: float | None) -> int:
    """Return the limit of `Ad7746`: in faster time each delay of the computer counts as many times."""
    return round(LIMIT_NS * max(speed or 1.0, 1.0))


def kit_of(
    scenario: Scenario,
    clock: Clock,
    seed: int = 0,
    wiring: Wiring = WIRINGS["guide"],
    *,
    bus_kHz: float = BUS_KHZ,
    idle_s: float = 0.0,
) -> KitTwin:
    """Return a board whose bumps follow a scenario from now on.

    Parameters
    ----------
    scenario : Scenario
        Its bus and jitter are not used: the times of the samples follow from the driver.
    clock : Clock
        The clock of the driver.
    seed : int
        The same seed gives the same readings.
    wiring : Wiring
        One of `palpate.ad7746.twin.wiring.WIRINGS`.
    bus_kHz : float
        I2C clock of the board.
    idle_s : float
        Time at rest before the scenario begins, s.

    Returns
    -------
    KitTwin

    Raises
    ------
    ValueError
        The scenario has another converter than the AD7746, wrong time stamps, or runs of lost conversions.
    """
    if foreign(scenario):
        raise ValueError(f"scenario: got {foreign(scenario)}, allowed on a board: its own; use palpate.simulation.run")
    random = np.random.default_rng(seed)
    start_s = clock.now_ns() / 1e9 + idle_s
    chip = ChipTwin(_pins(Truth(scenario, random, seed), start_s), seed=seed, wiring=wiring)
    faults = scenario.faults
    if faults.lost or faults.spikes_per_s or faults.bursts_per_s:
        chip.disturb = _disturbance(scenario, chip, random, lambda: max(clock.now_ns() / 1e9 - start_s, 0.0), seed)
    return KitTwin(chip, clock, bus_kHz=bus_kHz)


def _disturbance(
    scenario: Scenario, chip: ChipTwin, random: np.random.Generator, since_s: Callable[[], float], seed: int
) -> Callable[[], float]:
    faults, step_s = scenario.faults, scenario.converter.step_s
    noise_factor = faults.burst_noise(scenario.duration_s, stream(seed, "bursts"))
    noise = stream(seed, "burst noise")

    def disturbance() -> float:
        chip.lose += random.random() < faults.lost
        hit = random.random() < faults.spikes_per_s * step_s
        spike = float(hit * faults.spike_pF * random.choice([-1.0, 1.0]))
        factor = float(noise_factor(np.array([since_s()]))[0]) if faults.bursts_per_s else 1.0
        # The chip adds its own noise: the rest of a variance of factor^2.
        rest = sqrt(max(factor**2 - 1, 0)) * NOISE_PF[scenario.converter.capf]
        return spike + (rest * noise.standard_normal() if rest else 0.0)

    return disturbance


def _pins(truth: Truth, start_s: float) -> Pins:
    def mean_pF(bump: int, begin_s: float, end_s: float) -> float:
        middle = np.array([max((begin_s + end_s) / 2 - start_s, 0.0)])
        return PARASITIC_PF[bump - 1] + float(truth.mean_pF(bump - 1, middle, end_s - begin_s)[0])

    return mean_pF


def simulated(
    scenario: str | Scenario,
    *,
    seed: int = 0,
    speed: float | None = None,
    configuration: Configuration | None = None,
    notify: Callable[[str], None] = lambda _: None,
) -> Ad7746:
    """Return the real driver with a simulated board that follows a scenario.

    Parameters
    ----------
    scenario : str or Scenario
        A name from `palpate.simulation.scenarios.SCENARIOS`, or a scenario of your own.
    seed : int
        With the virtual clock the same seed gives the same readings.
    speed : float, optional
        1: real time; 10: ten times as fast; None: as fast as possible, with a virtual clock.
    configuration : Configuration, optional
        Default: with the `capf` of the scenario's converter.
    notify : callable, optional
        As in `Ad7746`.

    Returns
    -------
    Ad7746
        Open, not started. The time of the scenario starts now.

    Raises
    ------
    ValueError
        `scenario` is not a known name, or one that the board cannot follow.

    Examples
    --------
    >>> driver = simulated("four-specimens", seed=1)
    >>> driver.start()
    >>> driver.auto_capdac()
    (41, 27)
    >>> driver.close()
    """
    if isinstance(scenario, str):
        if scenario not in known():
            raise ValueError(f"scenario: got {scenario!r}, allowed: {', '.join(known())}")
        scenario = SCENARIOS[scenario]
    clock: Clock = VirtualClock() if speed is None else RealClock(speed)
    backend = TwinBackend(clock)
    backend.plug(kit_of(scenario, clock, seed))
    kit = EvalKit(backend=backend, clock=clock)
    settings = configuration or Configuration(capf=scenario.converter.capf)
    return Ad7746(kit, settings, clock, notify=notify, limit_ns=limit_ns(speed))
