"""Stiff and extreme inputs: right, refused or unexcited, never anything else. The cases are bench/accuracy/extremes.py's."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import palpate
import pytest
from numeric import dtype_of, every
from numpy.typing import NDArray
from palpate.simulation import scenarios

from bench.accuracy.extremes import (
    TWINS,
    Case,
    exact_cases,
    long_endings,
    noisy_endings,
    outcome,
    press,
)

CASES = [
    pytest.param(kind, case, id=f"{kind.__name__}-{case.name}")
    for kind in TWINS
    for case in exact_cases(kind)
]


@pytest.mark.parametrize(("kind", "case"), CASES)
def test_every_case_ends_as_it_should(kind: Any, case: Case) -> None:
    found = outcome(kind, TWINS[kind], case)
    assert found.ends == case.ends
    assert found.ratio_eps <= case.ratio_eps
    assert found.covariance_eps <= case.covariance_eps
    assert found.alarms_differ == 0


def test_no_noisy_case_is_silently_wrong() -> None:
    ends = {(name, case): end for name, case, end in noisy_endings()}
    assert "wrong" not in ends.values()
    assert ends["HandoverRls", "a level of 1e6 sd"] == "right"
    assert ends["HandoverRls32", "a level of 1e6 sd"] == "right"
    assert ends["HandoverRls32", "regressors of 1e30"] == "refused"
    assert ends["HandoverRls32", "regressors of 1e-30"] == "unknown"
    assert [end for _, _, end in long_endings(3, 300_000)] == ["right"] * 3


@pytest.mark.parametrize("kind", [palpate.HandoverRls, palpate.HandoverRls32])
@pytest.mark.parametrize("ratio", [0.0, 1e-20, 1e-17, 3.0])
def test_rounding_is_no_change(kind: Any, ratio: float) -> None:
    rows = kind().trace(np.full(20_000, ratio), np.ones(20_000))
    assert rows["ratio"][-1] == pytest.approx(ratio, rel=1e-6, abs=1e-30)
    assert not rows["alarm"].any()


@pytest.mark.parametrize("kind", [palpate.HandoverRls, palpate.HandoverRls32])
def test_data_without_noise_keep_normal_numbers(kind: Any) -> None:
    """Arithmetic with subnormal numbers takes ten times as long; in float32 the noise is what the ratio is off."""
    estimator = kind()
    estimator.process(np.full(300_000, 2.5 * 0.3), np.full(300_000, 0.3))
    numbers = np.abs(
        [number for number in estimator.__getstate__()[1] if isinstance(number, float)]
    )
    assert numbers[numbers > 0].min() >= np.finfo(dtype_of(kind)).tiny


@pytest.mark.parametrize("noise", [0.01, 0.05, 0.2])
def test_a_change_while_the_regressor_is_around_zero(noise: float) -> None:
    """200 samples after it, least squares since the change has an rms error of noise / sqrt(200); 1.96 errors hold 95 %."""
    rng = np.random.default_rng(7)
    off = []
    held = []
    runs = 120
    for _ in range(runs):
        x = rng.standard_normal(600)
        estimator = palpate.HandoverRls()
        estimator.process(
            np.where(np.arange(600) < 400, 1.2, 0.6) * x + noise * rng.standard_normal(600), x
        )
        off.append(estimator.ratio - 0.6)
        held.append(abs(off[-1]) < 1.96 * estimator.standard_error)
    assert np.sqrt(np.mean(np.square(off))) < 1.4 * noise / math.sqrt(200)
    assert np.mean(held) > 0.95 - 3 * math.sqrt(0.95 * 0.05 / runs)


REGRESSORS: dict[str, Callable[[np.random.Generator, int], NDArray[np.float64]]] = {
    "white": lambda random, n: random.standard_normal(n),
    "of one size, either sign": lambda random, n: (
        random.choice([-1.0, 1.0], n) * (1 + 0.1 * random.standard_normal(n))
    ),
    "a sine": lambda random, n: np.sin(0.7 * np.arange(n)),
    "of one sign, any size": lambda random, n: 1 + 0.9 * random.uniform(-1, 1, n),
}


@pytest.mark.parametrize("noise", [1e-2, 1e-3, 1e-5])
@pytest.mark.parametrize("name", REGRESSORS)
def test_a_change_is_found_whatever_the_regressor_does(name: str, noise: float) -> None:
    """Outliers in a row are a change, no burst, if they are as large as their regressors."""
    took = []
    for seed in range(20):
        random = np.random.default_rng(seed)
        x = REGRESSORS[name](random, 400)
        y = np.repeat([1.3, 1.6], 200) * x + noise * random.standard_normal(400)
        wrong = np.abs(palpate.HandoverRls().process(y, x)[200:] / 1.6 - 1) > 0.03
        took.append(wrong.nonzero()[0].max(initial=-1) + 1)
    assert np.median(took) <= 6
    assert max(took) <= 16


@pytest.mark.parametrize("correlation", [0.5, 0.8, 0.9])
def test_correlated_noise_beside_a_regressor_around_zero_is_no_drift(correlation: float) -> None:
    """The error is less than twice that of least squares; no ratio on the way is wrong by 10; 90 % of the intervals hold."""
    off = []
    least = []
    worst = []
    held = []
    for seed in range(40):
        random = np.random.default_rng(seed)
        x = random.standard_normal(500)
        noise = random.standard_normal(500)
        for i in range(1, 500):
            noise[i] += correlation * noise[i - 1]
        rows = palpate.HandoverRls().trace(1.3 * x + 0.1 * noise, x)
        off.append(rows["ratio"][-1] - 1.3)
        least.append(0.1 * noise @ x / (x @ x))
        worst.append(np.abs(rows["ratio"][50:] - 1.3).max())
        held.append(abs(off[-1]) < 1.96 * rows["standard_error"][-1])
    assert np.std(off) < 2 * np.std(least)
    assert max(worst) < 10
    assert np.mean(held) >= 0.9


@every
def test_a_million_idle_samples_leave_the_ratio(kind: Any) -> None:
    estimator = kind(
        **dict.fromkeys({"forgetting", "steady", "alarmed"} & set(kind().settings), 0.9)
    )
    before = estimator.process(*press(100))[-1]
    estimator.process(*np.zeros((2, 1_000_000)))
    assert estimator.ratio == before
    assert estimator.covariance <= estimator.settings.get("max_covariance", np.inf) * 1.000001
    assert estimator.process(*press(40, 4.0))[-1] == pytest.approx(4, rel=0.01)


@pytest.mark.parametrize("scene", ["handheld", "paper"])
def test_clocks_that_stand_jump_or_go_back(scene: Any) -> None:
    """No value is paired with a wrong one; what cannot be aligned is counted."""
    run = scenarios.run("tremor", 3)
    truth = run.true_ratio[np.isfinite(run.true_ratio)][-1]
    n = len(run.hard)
    half = len(run.hard) // 2
    later = np.arange(n) > half
    shifts = {
        "jumps on": 100.0 * later,
        "goes back": -3.0 * later,
        "to zero": -run.t_hard_s[half] * later,
        "late": 1e6,
    }
    clocks = {name: (run.t_hard_s + shift, run.t_soft_s + shift) for name, shift in shifts.items()}
    clocks["stands"] = run.t_hard_s.copy(), run.t_soft_s.copy()
    for t in clocks["stands"]:
        t[151:160] = t[150]
    for name, (t_hard, t_soft) in clocks.items():
        [touch] = palpate.touches(
            palpate.Recording(t_hard, t_soft, run.hard, run.soft), scene=scene
        )[:1]
        assert touch.ratio == pytest.approx(truth, rel=0.02), name


def test_times_at_the_ends_of_the_range_do_not_overflow() -> None:
    ends = np.array([-(2**63), -1, 0, 2**63 - 1], np.int64)
    tracker = palpate.Tracker("handheld")
    for t_hard in ends:
        rows = tracker.process(np.full(4, t_hard), ends, np.ones(4), np.ones(4))
        assert np.isnan(rows["standard_error"]).all()
    assert tracker.readings == 16


def test_a_level_that_overflows_in_the_fall_of_a_touch_ends() -> None:
    readings = np.repeat([-8e307, 7e307, -8e307, 1.7e308], [400, 4, 3, 200])
    times = np.arange(len(readings)) * 10_000_000
    tracker = palpate.Tracker("handheld")
    tracker.process(times, times, readings, readings)
    assert tracker.readings == len(readings)


def test_lambda_1_for_ten_million_samples() -> None:
    """What double does, and what float is known not to do (palpate/policy/policies.hpp): ratio 2, from half-way 3."""

    def ends(estimator: Any, kind: Any) -> list[float]:
        x = np.tile(np.array([0.25, 0.375], kind), 2_500_000)
        return [float(estimator.process(kind(ratio) * x, x)[-1]) for ratio in (2, 3)]

    assert ends(palpate.Rls(forgetting=1.0), np.float64)[1] == pytest.approx(2.5, rel=1e-6)
    assert ends(palpate.Rls32(forgetting=0.995), np.float32)[1] == pytest.approx(3, rel=1e-5)
    half, end = ends(palpate.Rls32(forgetting=1.0), np.float32)
    assert half == pytest.approx(2, rel=1e-5)
    assert 2 < end < 2.5


@pytest.mark.parametrize(
    ("kind", "level", "noise"),
    [
        (palpate.HandoverRls32, 1e5, 1e15),
        (palpate.HandoverRls32, 1e9, 1e6),
        (palpate.HandoverRls32, 1e-15, 1e-22),
        (palpate.HandoverRls, 1e70, 1e139),
        (palpate.HandoverRls, 1e80, 1e77),
        (palpate.HandoverRls, 1e-150, 1e-160),
    ],
)
def test_a_standard_error_is_right_or_unknown(kind: Any, level: float, noise: float) -> None:
    """At the ends of the range as elsewhere: never 0, which would be certainty, and never a loop without end.

    Regressors below 1e-139 count as 0: no sample says anything of the ratio. 1.87 times the expected error is right where the newest
    half of the samples is 1.7 errors off, and half an eps of the ratio is the least one.
    """
    rng = np.random.default_rng(0)
    estimator = kind()
    rows = estimator.trace(2 * level + noise * rng.standard_normal(300), np.full(300, level))
    error = rows["standard_error"][-1]
    expected = noise / level / np.sqrt(200)
    if level < 1e-139:
        assert math.isnan(error)
        assert rows["ratio"][-1] == estimator.settings["initial_ratio"]
    else:
        assert math.isnan(error) or error == pytest.approx(expected, rel=1.0, abs=1e-6)
