"""A simulated scenario as input of the simulated board, read by the real driver."""

from collections.abc import Callable
from dataclasses import replace
from math import sqrt

import numpy as np

from palpate.ad7746.bus import Clock
from palpate.ad7746.driver import LIMIT_NS
from palpate.ad7746.registers import NOISE_PF
from palpate.ad7746.simulator.chip import WIRINGS, ChipTwin, Pins, Wiring
from palpate.ad7746.simulator.evalboard import BUS_KHZ, KitTwin
from palpate.simulation.hand import SESSIONS
from palpate.simulation.press import stream
from palpate.simulation.probe import Scenario, Truth
from palpate.simulation.readings import Converter, Stamps
from palpate.simulation.scenarios import SCENARIOS

PARASITIC_PF = (6.3, 5.1)  # of the hard and the soft bump; the CAPDACs compensate it


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
        "runs of lost conversions": scenario.faults.lost_run
        > 0,  # the driver opens the board again, then ends
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
    """Return a board whose bumps follow a scenario from now on."""
    if foreign(scenario):
        raise ValueError(
            f"scenario: got {foreign(scenario)}, allowed on a board: its own; use palpate.simulation.run"
        )
    random = np.random.default_rng(seed)
    start_s = clock.now_ns() / 1e9 + idle_s
    chip = ChipTwin(_pins(Truth(scenario, random, seed), start_s), seed=seed, wiring=wiring)
    faults = scenario.faults
    if faults.lost or faults.spikes_per_s or faults.bursts_per_s:
        chip.disturb = _disturbance(
            scenario, chip, random, lambda: max(clock.now_ns() / 1e9 - start_s, 0.0), seed
        )
    return KitTwin(chip, clock, bus_kHz=bus_kHz)


def _disturbance(
    scenario: Scenario,
    chip: ChipTwin,
    random: np.random.Generator,
    since_s: Callable[[], float],
    seed: int,
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
