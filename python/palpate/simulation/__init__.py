"""Simulation of a hand-held probe with one converter and a known true ratio, and named scenarios."""

from palpate.simulation.press import Press
from palpate.simulation.probe import Scenario, Simulation, simulate
from palpate.simulation.scenarios import SCENARIOS, run

__all__ = ["SCENARIOS", "Press", "Scenario", "Simulation", "run", "simulate"]
