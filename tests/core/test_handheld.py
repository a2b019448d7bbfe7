"""What the handheld scene has to reach on simulated touches; the whole list, with its numbers, is in bench/."""

import numpy as np
import palpate
import pytest
from numeric import process
from numpy.typing import NDArray
from palpate.simulation import Baseline, Scenario, scenarios, simulate

Array = NDArray[np.float64]


def test_every_touch_is_found_and_none_invented() -> None:
    """Scenarios with one difficulty each, and idle noise."""
    for name, scenario in scenarios.FOLLOWING.items():
        scene = "sliding" if name == "sliding" else "handheld"
        for seed in range(10):
            run = scenarios.run(name, seed)
            tracker, _ = process(scene, run)
            assert len(tracker.touches) == len(scenario.presses), (name, seed)
            for touch, press in zip(tracker.touches, scenario.presses, strict=True):
                # Of a light touch the first pairs are below the noise.
                assert -6 <= touch.start - np.searchsorted(run.t_hard_s, press.start_s) <= 4
                assert touch.start_s == pytest.approx(run.t_hard_s[touch.start], abs=1e-9)


def test_a_hand_does_not_hold_the_alarm_on() -> None:
    """What the project is for: on skewed channels the paper's alarm stays on, and its error is many times larger."""
    for name in ("stiff-steady", "near-rigid", "tremor", "strong-tremor"):
        errors: dict[str, float] = {}
        alarms: dict[str, list[float]] = {}
        for scene in ("paper", "handheld"):
            found = [process(scene, scenarios.run(name, seed)) for seed in range(30)]
            relative = []
            for seed, (_, rows) in enumerate(found):
                run = scenarios.run(name, seed)
                steady = (rows["touch"] == 1) & (run.t_hard_s > 3)
                relative.append(np.sqrt(np.mean((rows["ratio"][steady] / run.true_ratio[steady] - 1) ** 2)))
                alarms.setdefault(scene, []).append(rows["alarm"][steady].mean())
            errors[scene] = float(np.median(relative))
        assert errors["handheld"] < errors["paper"] / 10
        assert np.mean(alarms["paper"]) > 0.9
        assert np.mean(alarms["handheld"]) < 0.001


@pytest.mark.parametrize(
    ("name", "seeds", "most"),
    [("tremor", 100, 1.0), ("strong-tremor", 100, 1.0), ("soft-steady", 200, 0.98), ("stiff-steady", 200, 0.98)],
)
def test_the_standard_error_knows_of_tones_and_baselines(name: str, seeds: int, most: float) -> None:
    """A tone cancels itself: as ordinary correlated noise it would give an error five times too large.

    Nearly all of the error of a quiet, steady touch is the baselines'; without them the interval covers half.
    """
    ends = []
    for seed in range(seeds):
        run = scenarios.run(name, seed)
        _, rows = process("handheld", run)
        last = np.flatnonzero(rows["touch"] == 1)[-1]
        ends.append(
            (rows["ratio"][last] / run.true_ratio[last] - 1, rows["standard_error"][last] / run.true_ratio[last])
        )
    errors, believed = np.transpose(ends)
    assert 0.9 <= np.mean(np.abs(errors) < 1.96 * believed) <= most
    assert np.median(believed) < 2 * np.sqrt(np.mean(errors**2))


def test_a_drift_without_contact_is_no_touch() -> None:
    """The limit in docs/untried.md: 3e-5 pF/s in both channels."""
    baselines = (Baseline(0.62, drift_pF_per_s=3e-5), Baseline(-0.41, drift_pF_per_s=3e-5))
    drifting = Scenario(duration_s=60.0, baselines=baselines)
    assert [palpate.touches(simulate(drifting, seed)) for seed in range(20)] == [[]] * 20
