"""Touches with known truth: what a hand-held probe with one converter delivers, and named scenarios of it."""

from palpate.simulation.probe import Press, Scenario, Simulation, simulate
from palpate.simulation.scenarios import SCENARIOS, run

__all__ = ["SCENARIOS", "Press", "Scenario", "Simulation", "run", "simulate"]
