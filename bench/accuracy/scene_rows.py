"""What a scene says of each reading: its rows, each beside the reading that it is about."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from palpate import Tracker
from palpate.simulation import Simulation

if TYPE_CHECKING:
    from palpate._core import _Scene

AHEAD: "dict[_Scene, int]" = {"handheld": 2, "sliding": 2}
"""Readings for which each one waits in the screen of a scene; other scenes have none."""


def scene_rows(
    run: Simulation, scene: "_Scene" = "handheld", tracker: Tracker | None = None
) -> NDArray[np.void]:
    """Return one row for each reading of a simulation.

    The last readings still wait in the screen: their rows have no touch.
    """
    tracker = Tracker(scene) if tracker is None else tracker
    rows = tracker.process(run.t_hard_s, run.t_soft_s, run.hard, run.soft)
    ahead = AHEAD.get(scene, 0)
    return np.concatenate([rows[ahead:], rows[:ahead]])
