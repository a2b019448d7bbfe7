"""A simulated scenario as input of the simulated board, read by the real driver."""

from collections.abc import Callable

import numpy as np

from palpate.ad7746.clock import Clock, RealClock, VirtualClock
from palpate.ad7746.configuration import Configuration
from palpate.ad7746.datasheet import CONVERSION_S
from palpate.ad7746.driver import Ad7746
from palpate.ad7746.evalkit.board import EvalKit
from palpate.ad7746.twin.chip import ChipTwin, Pins
from palpate.ad7746.twin.kit import KitTwin
from palpate.ad7746.twin.usb import TwinBackend
from palpate.simulation.probe import Scenario, Truth
from palpate.simulation.scenarios import SCENARIOS

PARASITIC_PF = (6.3, 5.1)
"""Parasitic capacitance of the two inputs, hard and soft, pF, which the CAPDACs compensate."""


def kit_of(scenario: Scenario, clock: Clock, seed: int = 0) -> KitTwin:
    """Return a board whose inputs follow a scenario from now on.

    Parameters
    ----------
    scenario : Scenario
        Its presses, drift, lost conversions and spikes are used; the times of the samples follow from the driver.
    clock : Clock
        The clock of the driver.
    seed : int
        The same seed gives the same readings.

    Returns
    -------
    KitTwin
    """
    random = np.random.default_rng(seed)
    chip = ChipTwin(_pins(Truth(scenario, random), clock.now_ns() / 1e9), seed=seed)

    step_s = CONVERSION_S[scenario.capf] + scenario.bus_s

    def disturbance() -> float:
        chip.lose += random.random() < scenario.lost
        hit = random.random() < scenario.spikes_per_s * step_s
        return float(hit * scenario.spike_pF * random.choice([-1.0, 1.0]))

    if scenario.lost or scenario.spikes_per_s:
        chip.disturb = disturbance
    return KitTwin(chip, clock)


def _pins(truth: Truth, start_s: float) -> Pins:
    def mean_pF(pin: int, begin_s: float, end_s: float) -> float:
        middle = np.array([(begin_s + end_s) / 2 - start_s])
        return PARASITIC_PF[pin - 1] + float(truth.mean_pF(pin - 1, middle, end_s - begin_s)[0])

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
        Default: the `capf` of the scenario.
    notify : callable, optional
        As in `Ad7746`.

    Returns
    -------
    Ad7746
        Open, not started. The time of the scenario starts now.

    Raises
    ------
    ValueError
        `scenario` is not a known name.

    Examples
    --------
    >>> driver = simulated("four-specimens", seed=1)
    >>> driver.start()
    >>> driver.auto_capdac()
    (41, 27)
    >>> driver.close()
    """
    if isinstance(scenario, str):
        if scenario not in SCENARIOS:
            raise ValueError(f"scenario: got {scenario!r}, allowed: {', '.join(SCENARIOS)}")
        scenario = SCENARIOS[scenario]
    clock: Clock = VirtualClock() if speed is None else RealClock(speed)
    backend = TwinBackend(clock)
    backend.plug(kit_of(scenario, clock, seed))
    kit = EvalKit(backend=backend, clock=clock)
    return Ad7746(kit, configuration or Configuration(capf=scenario.capf), clock, notify=notify)
