"""The session of the simulated board: ten specimens, four touches each."""

import numpy as np
import palpate
from palpate.elasticity import SORBOTHANE_MPA
from palpate.simulation import simulate
from palpate.simulation.board import known
from palpate.simulation.scenarios import PROBE
from palpate.simulation.sessions import SESSIONS


def test_ten_specimens() -> None:
    scenario = SESSIONS["ten-specimens"]
    assert "ten-specimens" in known()
    begins = [press.start_s for press in scenario.presses]
    assert np.allclose(np.diff(begins), 8.9)
    assert begins[0] > 5  # s: a list of specimens is entered, and a busy computer has its baseline
    found = palpate.touches(simulate(scenario, seed=1))
    assert len(found) == 40
    assert sum(bool(touch.flags) for touch in found) <= 4  # the gauges bend a little: the firmest presses are flagged
    means = np.array([touch.ratio for touch in found]).reshape(10, 4).mean(axis=1)
    truth = [PROBE.ratio(modulus) for modulus in SORBOTHANE_MPA.values()]
    assert np.abs(means / truth - 1).max() < 0.05
