"""Long scenarios for the simulated board: a hand that touches one specimen after the other."""

from dataclasses import replace

import numpy as np

from palpate.elasticity import SORBOTHANE_MPA
from palpate.simulation.hand import EVERY_S, Hand
from palpate.simulation.scenario import Scenario
from palpate.simulation.scenarios import PROBE

TOUCHES = 4
"""Touches of each specimen."""
FREE_S = 8.0
"""Time before the first touch: to measure the baseline on a busy computer too, and to enter the specimens."""


def ten_specimens() -> Scenario:
    """Return four touches on each specimen of Table I of the paper, in its order, 6.1 minutes in all.

    Examples
    --------
    >>> scenario = ten_specimens()
    >>> len(scenario.presses), round(scenario.duration_s)
    (40, 364)
    """
    random = np.random.default_rng(0)
    hand = Hand()
    parts = [hand.touches(PROBE.ratio(modulus), TOUCHES, random) for modulus in SORBOTHANE_MPA.values()]
    presses = [
        replace(press, start_s=press.start_s + FREE_S + TOUCHES * EVERY_S * number)
        for number, part in enumerate(parts)
        for press in part.presses
    ]
    duration_s = FREE_S + parts[-1].duration_s + TOUCHES * EVERY_S * (len(parts) - 1)
    return replace(parts[0], presses=presses, duration_s=duration_s)


SESSIONS: dict[str, Scenario] = {"ten-specimens": ten_specimens()}
"""Beside `palpate.simulation.SCENARIOS`: for a rehearsal of a whole session, not for comparisons of estimators."""
