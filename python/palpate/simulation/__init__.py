"""Simulation of a hand-held probe with one converter and a known true ratio, and named scenarios."""

from palpate.simulation.baseline import Baseline
from palpate.simulation.bumps import Bumps, Gauge
from palpate.simulation.converter import Converter, Stamps
from palpate.simulation.faults import Faults
from palpate.simulation.press import Press
from palpate.simulation.probe import Simulation, simulate
from palpate.simulation.scenario import Scenario
from palpate.simulation.scenarios import SCENARIOS, run
from palpate.simulation.substrate import Substrate
from palpate.simulation.tilt import Tilt
from palpate.simulation.tremor import Lines, Peaks, Record

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
    "Record",
    "Scenario",
    "Simulation",
    "Stamps",
    "Substrate",
    "Tilt",
    "run",
    "simulate",
]
