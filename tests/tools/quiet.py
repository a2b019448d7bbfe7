"""Simulations without tremor, jitter and noise, both channels at once: what is left is the effect."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palpate.simulation import Converter, Press, Scenario, Simulation, simulate

HARD_PF, SOFT_PF = (baseline.level_pF for baseline in Scenario().baselines)
STEP_PF = 8.192 / 2**24
"""Step of the codes."""
EXACT = Converter(jitter_s=0.0, noise_pF=0.0, together=True)
QUIET = Scenario(presses=[Press(2.0, [(0.0, 2.5)])], tremor=0.0, converter=EXACT)


def changes(run: Simulation) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the changes of the hard and of the soft channel from their levels, pF."""
    return run.hard - HARD_PF, run.soft - SOFT_PF


def quiet(seed: int = 0, **parts: Any) -> Simulation:
    """Return a simulation of QUIET with other parts."""
    return simulate(replace(QUIET, **parts), seed)


def held(run: Simulation) -> NDArray[np.bool_]:
    """Return which pairs are in the hold of the first press."""
    press = run.presses[0]
    begin = press.start_s + press.rise_s + 0.05
    return np.asarray((run.t_hard_s > begin) & (run.t_hard_s < press.stop_s - press.fall_s - 0.05))
