"""The design of the CUSUM, against Siegmund's formula and simulation; published run lengths are in test_published_numbers.py."""

import numpy as np
import pytest
from numpy.typing import NDArray
from palpate.design import cusum, run_length, siegmund


def simulated(drift: float, threshold: float, shift: float, clip: float, runs: int) -> float:
    random = np.random.default_rng(7)
    statistic, lengths, alive = np.zeros(runs), np.zeros(runs), np.ones(runs, bool)
    while alive.any():
        z = np.clip(shift + random.standard_normal(alive.sum()), -clip, clip)
        statistic[alive] = np.maximum(0, statistic[alive] + z - drift)
        lengths[alive] += 1
        alive &= statistic <= threshold
    return float(lengths.mean())


@pytest.mark.parametrize(("drift", "threshold"), [(0.25, 8.0), (0.5, 5.0), (0.75, 5.0), (1.0, 4.0)])
def test_siegmund(drift: float, threshold: float) -> None:
    # The formula is itself an approximation, 6 % off at a drift of 1.
    assert run_length(drift, threshold, clip=50.0) == pytest.approx(siegmund(drift, threshold), rel=0.07)


@pytest.mark.parametrize(
    ("drift", "threshold", "shift", "clip"), [(0.5, 3.0, 0.0, 3.0), (0.75, 4.0, 1.5, 3.0), (0.5, 3.0, 0.0, 1.5)]
)
def test_simulation(drift: float, threshold: float, shift: float, clip: float) -> None:
    # Run lengths are nearly exponential: the mean of 4,000 is off by 1.6 %; 4 of these.
    expected = run_length(drift, threshold, shift=shift, clip=clip)
    assert simulated(drift, threshold, shift, clip, 4000) == pytest.approx(expected, rel=0.064)


def test_a_design_keeps_its_promise() -> None:
    for interval, shift in [(1e3, 1.0), (1e5, 1.5), (1e6, 2.5)]:
        design = cusum(false_alarm_interval=interval, smallest_shift=shift)
        assert design.drift == shift / 2
        assert design.false_alarm_interval == pytest.approx(interval, rel=1e-3)
        assert run_length(design.drift, design.threshold) / 2 == pytest.approx(interval, rel=1e-3)
        assert 1 < design.delay < 40


@pytest.mark.parametrize(("interval", "shift"), [(1e3, 1.0), (1e5, 1.5), (1e5, 0.2), (1e12, 4.5)])
def test_a_design_solves_its_chain_a_few_times_only(
    interval: float, shift: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    solve, work = np.linalg.solve, 0.0

    def counted(matrix: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.float64]:
        nonlocal work
        work += (len(matrix) / 400) ** 3
        return np.asarray(solve(matrix, right), float)

    monkeypatch.setattr(np.linalg, "solve", counted)
    cusum(false_alarm_interval=interval, smallest_shift=shift)
    assert work < 9  # solutions of 400 equations; by bisection of the threshold alone 52 to 60


@pytest.mark.parametrize("clip", [1.0, 3.0, 100.0])
@pytest.mark.parametrize("share", [0.1, 1.0, 1.5])
def test_any_clip_has_a_design(clip: float, share: float) -> None:
    design = cusum(false_alarm_interval=1e4, smallest_shift=share * min(clip, 3.0), clip=clip)
    assert 0.99e4 < design.false_alarm_interval < 3e4  # at a clip of 1 the run length jumps: most steps are as long
    assert design.delay < 0.1 * design.false_alarm_interval


@pytest.mark.parametrize(("drift", "threshold"), [(0.75, 7.0), (0.25, 30.0), (0.1, 100.0)])
def test_finer_states_say_the_same(drift: float, threshold: float, monkeypatch: pytest.MonkeyPatch) -> None:
    found = run_length(drift, threshold)
    monkeypatch.setattr("palpate.design.STATES", 2000)
    assert found == pytest.approx(run_length(drift, threshold), rel=0.02)


@pytest.mark.parametrize("shift", [1.5, 2.5, 3.0, 4.5])
def test_the_rarest_false_alarms(shift: float) -> None:
    assert cusum(false_alarm_interval=1e12, smallest_shift=shift).false_alarm_interval == pytest.approx(1e12, rel=0.1)
    assert run_length(shift / 2, 64.0) == float("inf")  # more samples than double can tell


def test_bad_wishes() -> None:
    for wish, message in [
        ({"false_alarm_interval": 5.0, "smallest_shift": 1.0}, "false_alarm_interval: got 5.0, allowed: 10 to 1e12"),
        ({"false_alarm_interval": float("inf"), "smallest_shift": 1.0}, "false_alarm_interval: got inf"),
        ({"false_alarm_interval": 1e3, "smallest_shift": 0.0}, "smallest_shift: got 0.0"),
        ({"false_alarm_interval": 1e3, "smallest_shift": 7.0}, r"smallest_shift: got 7.0, allowed: .* \(4.5\)"),
        (
            {"false_alarm_interval": 1e9, "smallest_shift": 1e-3},
            "smallest_shift: got 0.001, allowed: a larger shift",
        ),
        ({"false_alarm_interval": 1e3, "smallest_shift": 1.0, "clip": 0.0}, "clip: got 0.0, allowed: 1 to 100"),
        ({"false_alarm_interval": 1e3, "smallest_shift": 1.0, "clip": float("nan")}, "clip: got nan"),
    ]:
        with pytest.raises(ValueError, match=message):
            cusum(**wish)
    assert run_length(3.0, 1.0, clip=3.0) == float("inf")
