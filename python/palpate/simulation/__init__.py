"""Simulation of a hand-held probe with one converter and a known true ratio, and named scenarios."""

from palpate.simulation.mechanics import Bumps, Gauge, Substrate
from palpate.simulation.press import Lines, Peaks, Press, Tilt
from palpate.simulation.probe import Scenario, Simulation, simulate
from palpate.simulation.readings import Baseline, Converter, Faults, Stamps
from palpate.simulation.scenarios import SCENARIOS, run

__all__ = [
    "SCENARIOS",
    "Baseline",
    "Bumps",
    "Converter",
    "Faults",
    "Gauge",
    "Lines",
    "Peaks",
    "Press",
    "Scenario",
    "Simulation",
    "Stamps",
    "Substrate",
    "Tilt",
    "run",
    "simulate",
]
