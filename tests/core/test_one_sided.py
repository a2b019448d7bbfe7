"""A wrong wire: one channel that does not follow the press, or falls."""

import numpy as np
import palpate
import pytest
from numpy.typing import NDArray
from palpate.simulation import scenarios

WIRES = ["hard is flat", "hard is constant", "soft is flat", "soft falls"]


def wired(wire: str, hard: NDArray[np.float64], soft: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """Return both channels with a wrong wire."""
    noise = 40e-6 * np.random.default_rng(0).standard_normal(len(hard))
    if wire == "soft falls":
        return hard, -soft
    flat = np.full(len(hard), 0.62) + (0 if wire == "hard is constant" else noise)
    return (flat, soft) if wire.startswith("hard") else (hard, flat)


@pytest.mark.parametrize("wire", WIRES)
@pytest.mark.parametrize("scene", ["handheld", "sliding"])
def test_a_wrong_wire_is_told(wire: str, scene: str) -> None:
    run = scenarios.run("tremor", 1)
    tracker = palpate.Tracker(scene)  # type: ignore[call-overload]
    tracker.process(run.t_hard_s, run.t_soft_s, *wired(wire, run.hard, run.soft))
    tracker.finish()
    for touch in tracker.touches:
        assert "one-sided" in touch.flags, touch
        [sentence] = [said for said in palpate.advice(touch) if said.startswith("one-sided: ")]
        assert ("fell" in sentence) == (wire == "soft falls")
    assert len(tracker.touches) == 1


@pytest.mark.parametrize("ratio", [1.0, 2.8, 10.0, 0.17])
def test_the_ratios_of_a_probe_and_of_a_cord_are_not_one_sided(ratio: float) -> None:
    run = scenarios.run("tremor", 1)
    tracker = palpate.Tracker()
    tracker.process(run.t_hard_s, run.t_soft_s, 0.62 + (run.hard - 0.62) * ratio / 2.843, run.soft)
    tracker.finish()
    [touch] = tracker.touches
    assert touch.ratio == pytest.approx(ratio, rel=1e-3)
    assert "one-sided" not in touch.flags
