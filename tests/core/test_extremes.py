"""Stiff and extreme inputs: right, refused or unexcited, never anything else. The cases are bench/accuracy/extremes.py's."""

import json
import math
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from palpate.simulation import scenarios
from project import ROOT, need

from bench.accuracy.extremes import Case, exact_cases, long_idle, outcome, press

TWINS: dict[Any, Any] = {np.float64: palpate.AdaptiveRls, np.float32: palpate.AdaptiveRls32}
CASES = [pytest.param(kind, case, id=f"{kind.__name__}-{case.name}") for kind in TWINS for case in exact_cases(kind)]
EVERY = [
    palpate.Rls,
    palpate.AdaptiveRls,
    palpate.HandoverRls,
    palpate.Rls32,
    palpate.AdaptiveRls32,
    palpate.HandoverRls32,
]


@pytest.mark.parametrize(("kind", "case"), CASES)
def test_every_case_ends_as_it_should(kind: Any, case: Case) -> None:
    found = outcome(kind, TWINS[kind], case)
    assert found.ends == case.ends
    assert found.ratio_eps <= case.ratio_eps
    assert found.covariance_eps <= case.covariance_eps
    assert found.alarms_differ == 0


@pytest.mark.parametrize("kind", EVERY)
def test_ratios_of_every_size_are_found(kind: Any) -> None:
    for ratio in (-3.0, 0.0, 1e-3, 1 + 1e-6, 11.06, 1e6):
        output, regressor = press(400, ratio, noise=1e-5 * max(abs(ratio), 1e-3))
        assert kind().process(output, regressor)[-1] == pytest.approx(ratio, rel=2e-4, abs=1e-3)


@pytest.mark.parametrize("kind", [palpate.HandoverRls, palpate.HandoverRls32])
@pytest.mark.parametrize("ratio", [0.0, 1e-20, 1e-17, 3.0])
def test_rounding_is_no_change(kind: Any, ratio: float) -> None:
    rows = kind().trace(np.full(20_000, ratio), np.ones(20_000))
    assert rows["ratio"][-1] == pytest.approx(ratio, rel=1e-6, abs=1e-30)
    assert not rows["alarm"].any()


@pytest.mark.parametrize("kind", EVERY)
def test_a_million_idle_samples_leave_the_ratio(kind: Any) -> None:
    case = long_idle()
    estimator = kind(**dict.fromkeys({"forgetting", "steady", "alarmed"} & set(kind().settings), 0.9))
    before = estimator.process(case.output[:100], case.regressor[:100])[-1]
    estimator.process(case.output[100:], case.regressor[100:])
    assert estimator.ratio == before
    assert estimator.covariance <= estimator.settings["max_covariance"] * 1.000001
    assert estimator.process(*press(40, 4.0))[-1] == pytest.approx(4, rel=0.01)


@pytest.mark.parametrize("kind", EVERY)
@pytest.mark.parametrize("level", [4e-5, 1e-9])
def test_noise_alone_lets_nothing_run_away(kind: Any, level: float) -> None:
    estimator = kind()
    rows = estimator.trace(*(level * np.random.default_rng(5).standard_normal((2, 300_000))))
    assert estimator.rejected == 0
    assert np.abs(rows["ratio"]).max() < 1e4
    assert rows["alarm"].mean() < 0.05
    assert estimator.process(*press(200))[-1] == pytest.approx(2.5, rel=0.01)


@pytest.mark.parametrize("kind", EVERY)
def test_a_regressor_that_changes_its_sign(kind: Any) -> None:
    """Not what a probe gives: the instrument of HandoverRls is then weak, but nothing runs away."""
    rng = np.random.default_rng(6)
    regressor = 0.25 * np.sin(0.9 * np.arange(20_000)) + 0.001 * rng.standard_normal(20_000)
    ratios = kind().process(2.5 * regressor + 1e-4 * rng.standard_normal(20_000), regressor)
    assert np.isfinite(ratios).all()
    assert np.abs(ratios).max() < 1e3


@pytest.mark.parametrize("kind", EVERY)
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("channel", [0, 1])
def test_one_bad_value_at_any_position_is_as_if_it_were_not_there(kind: Any, bad: float, channel: int) -> None:
    samples = np.array(press(60))
    for position in range(60):
        hurt = np.insert(samples, position, samples[:, 0], axis=1)
        hurt[channel, position] = bad
        one, other = kind(), kind()
        rows = one.process(*hurt)
        assert np.array_equal(np.delete(rows, position), other.process(*samples))
        assert one.rejected == 1


@pytest.mark.parametrize("scene", ["handheld", "sliding", "paper", "fixed"])
@pytest.mark.parametrize("channel", ["hard", "soft"])
def test_a_lost_reading_at_any_position_costs_nothing_else(scene: Any, channel: str) -> None:
    run = scenarios.run("tremor", 3)
    values: dict[str, Any] = {"hard": run.hard, "soft": run.soft}
    settings: dict[str, Any] = {} if scene == "sliding" else {"samples": 200}
    whole, *_ = palpate.touches(
        palpate.Recording(run.t_hard_s, run.t_soft_s, run.hard, run.soft), scene=scene, **settings
    )
    for position in range(0, len(run.hard), 7):
        hurt: dict[str, Any] = {**values, channel: values[channel].copy()}
        hurt[channel][position] = [math.nan, math.inf, -math.inf][position % 3]
        touches = palpate.touches(palpate.Recording(run.t_hard_s, run.t_soft_s, **hurt), scene=scene, **settings)
        assert touches, position
        assert touches[0].ratio == pytest.approx(whole.ratio, rel=0.02), position


@pytest.mark.parametrize("scene", ["handheld", "paper"])
def test_clocks_that_stand_jump_or_go_back(scene: Any) -> None:
    """Values are never taken for others; what cannot be aligned is counted."""
    run = scenarios.run("tremor", 3)
    truth = run.true_ratio[np.isfinite(run.true_ratio)][-1]
    n = len(run.hard)
    shifts = {
        "jumps on": np.where(np.arange(n) > n // 2, 100.0, 0.0),
        "goes back": np.where(np.arange(n) > n // 2, -3.0, 0.0),
        "goes back to zero": np.where(np.arange(n) > n // 2, -run.t_hard_s[n // 2], 0.0),
        "stands for ten": np.where((np.arange(n) > 150) & (np.arange(n) < 160), 150, 0) * 0.0,
        "starts late": np.full(n, 1e6),
    }
    for name, shift in shifts.items():
        t_hard, t_soft = run.t_hard_s + shift, run.t_soft_s + shift
        if name == "stands for ten":
            t_hard[151:160], t_soft[151:160] = t_hard[150], t_soft[150]
        [touch] = palpate.touches(palpate.Recording(t_hard, t_soft, run.hard, run.soft), scene=scene)[:1]
        assert touch.ratio == pytest.approx(truth, rel=0.02), name


def test_times_at_the_ends_of_the_range_do_not_overflow() -> None:
    ends = np.array([-(2**63), -1, 0, 2**63 - 1], np.int64)
    tracker = palpate.Tracker("handheld")
    for t_hard in ends:
        rows = tracker.process(np.full(4, t_hard), ends, np.ones(4), np.ones(4))
        assert np.isnan(rows["standard_error"]).all()
    assert tracker.readings == 16


def test_lambda_1_for_ten_million_samples(tmp_path: Path) -> None:
    """What double does, and what float is known not to do (palpate/policy/forgetting.hpp)."""
    program = tmp_path / "long_run"
    flags = ["-O2", "-std=c++17", "-ffp-contract=off", f"-I{palpate.get_include()}"]
    subprocess.run(
        [need("c++"), *flags, str(ROOT / "bench" / "accuracy" / "long_run.cpp"), "-o", str(program)], check=True
    )
    found = json.loads(subprocess.run([program, "10000000"], check=True, capture_output=True).stdout)
    assert found["Rls<double>"]["ratio"] == pytest.approx(2.5, rel=1e-9)
    assert found["float with compensated sums"]["ratio"] == pytest.approx(2.5, rel=1e-6)
    assert found["Rls<float>, lambda 0.995"]["ratio"] == pytest.approx(3, rel=1e-5)
    assert found["Rls<float>"]["half"] == pytest.approx(2, rel=1e-5)
    assert 2 < found["Rls<float>"]["ratio"] < 2.5


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
    """At the ends of the range as elsewhere: never 0, which would be certainty, and never a loop without end."""
    rng = np.random.default_rng(0)
    estimator = kind()
    rows = estimator.trace(2 * level + noise * rng.standard_normal(300), np.full(300, level))
    error = rows["standard_error"][-1]
    expected = noise / level / np.sqrt(200)
    assert math.isnan(error) or error == pytest.approx(expected, rel=0.5)
