"""Scenarios on the simulated board: the same effects, read by the real driver."""

import numpy as np
import palpate
import pytest
from palpate.ad7746.clock import VirtualClock
from palpate.ad7746.datasheet import NOISE_PF
from palpate.samples import Block, block_of
from palpate.simulation import SCENARIOS, Faults, Scenario, simulate
from palpate.simulation.board import foreign, kit_of, known
from quiet import held


def on_board(name: str, seed: int = 1) -> Block:
    with palpate.open(f"sim:{name}", seed=seed) as source:
        return block_of(source)


@pytest.mark.parametrize("name", ["not-level", "power-gauge", "creep", "lag", "cross-talk", "thermal", "relaxing"])
def test_the_board_has_the_effect(name: str) -> None:
    run, block = simulate(SCENARIOS[name], 1), on_board(name)
    t = block["t_hard_ns"] / 1e9
    idle, pressed = t < 1.5, (t > 7.0) & (t < 8.5)
    hard, soft = (block[channel][pressed].mean() - block[channel][idle].mean() for channel in ("hard", "soft"))
    inside = held(run) & (run.t_hard_s > 7.0) & (run.t_hard_s < 8.5)
    expected = (run.hard[inside].mean() - 0.62) / (run.soft[inside].mean() + 0.41)
    assert hard / soft == pytest.approx(expected, rel=2e-3)  # the driver begins up to 0.1 s after the scenario


def test_the_board_has_noise_bursts() -> None:
    faults = Faults(bursts_per_s=1e3, burst_s=60.0, burst_factor=2.0)  # all the time
    clock = VirtualClock()
    chip = kit_of(Scenario(duration_s=60.0, faults=faults), clock, 1).chip
    clock.sleep(1.0)
    noise = [chip.disturb() for _ in range(4000)]
    expected = np.sqrt(2.0**2 - 1) * NOISE_PF[0]  # the chip adds its own
    assert np.std(noise) == pytest.approx(expected, rel=5 / np.sqrt(8000))


def test_what_a_board_cannot_be_is_refused() -> None:
    left_out = set(SCENARIOS) - set(known())
    assert left_out == {"coarse-codes", "fast-converter", "host-stamps", "lost-runs", "skew", "together"}
    assert foreign(SCENARIOS["jitter"]) == foreign(SCENARIOS["slow-converter"]) == ""
    with pytest.raises(ValueError, match="scenario: got wrong time stamps, allowed on a board: its own"):
        kit_of(SCENARIOS["skew"], VirtualClock())
    with pytest.raises(ValueError, match="sim: got scenario 'together', allowed: soft-steady"):
        palpate.open("sim:together")
