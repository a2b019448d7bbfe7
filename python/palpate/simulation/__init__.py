"""Simulation of a hand-held probe with one converter and a known ratio; named scenarios."""

from palpate.simulation.mechanics import Bumps, Gauge, Substrate
from palpate.simulation.press import Press, Tilt
from palpate.simulation.probe import Scenario, Simulation, simulate
from palpate.simulation.readings import BaselineModel, ConverterModel, Faults, Stamps
from palpate.simulation.scenarios import SCENARIOS, run
from palpate.simulation.signals import Lines, Peaks

__all__ = [
    "SCENARIOS",
    "BaselineModel",
    "Bumps",
    "ConverterModel",
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
