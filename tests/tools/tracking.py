"""Simulated touches, processed by a tracker."""

from typing import Any

import numpy as np
import palpate
from palpate.simulation import Simulation

SCENES = ["fixed", "paper", "handheld", "sliding"]


def process(scene: Any, run: Simulation, **settings: Any) -> tuple[palpate.Tracker, np.ndarray[Any, Any]]:
    tracker = palpate.Tracker(scene, **settings)
    rows = tracker.process(run.t_hard_s, run.t_soft_s, run.hard, run.soft)
    tracker.finish()
    return tracker, rows
