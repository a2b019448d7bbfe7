"""Baselines: drift, wander, jump and thermal change against their formulas."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from palpate.simulation import Baseline, Simulation
from quiet import HARD_PF, QUIET, SOFT_PF, STEP_PF, quiet

SPAN_S = QUIET.converter.span_s


def soft_baseline(seed: int = 0, duration_s: float = 10.0, **settings: Any) -> Simulation:
    baseline = Baseline(SOFT_PF, **settings)
    return quiet(seed, presses=[], duration_s=duration_s, baselines=(Baseline(HARD_PF), baseline))


def test_a_drift_has_its_slope_from_its_begin_on() -> None:
    run = soft_baseline(drift_pF_per_s=3e-4, drift_from_s=4.0)
    expected = SOFT_PF + 3e-4 * np.maximum(run.t_soft_s - 4.0, 0)
    assert run.soft == pytest.approx(expected, abs=2 * STEP_PF)  # in one conversion the corner is averaged
    later = run.t_soft_s > 4.1
    assert np.polyfit(run.t_soft_s[later], run.soft[later], 1)[0] == pytest.approx(3e-4, rel=1e-3)
    assert run.hard == pytest.approx(HARD_PF, abs=STEP_PF)


def test_a_wander_has_its_rms_and_its_time_constant() -> None:
    """An autoregression: correlation exp(-t / tau). 2000 s are 1000 times 2 tau: rms within 1 / sqrt(2000), 5 of it."""
    run = soft_baseline(5, 2000.0, wander_pF=1e-3, wander_s=1.0)
    values = (run.soft - SOFT_PF)[: run.soft.size // 100 * 100]
    assert values.std() == pytest.approx(1e-3, rel=0.11)
    for seconds in (0.52, 1.04, 2.08):
        lag = round(seconds / QUIET.converter.period_s)
        correlation = np.corrcoef(values[:-lag], values[lag:])[0, 1]
        assert correlation == pytest.approx(np.exp(-lag * QUIET.converter.period_s), abs=0.1)


def test_a_slow_wander_is_a_random_walk() -> None:
    """Standard deviation of the change in 1 s: rms sqrt(2 / tau)."""
    steps = []
    for seed in range(300):
        course = Baseline(wander_pF=1.0, wander_s=200.0).course(np.inf, 3.0, np.random.default_rng(seed))
        begin, end = course(np.array([1.0, 2.0]), SPAN_S)
        steps.append(end - begin)
    # An s.d. from 300 values is known to 4 %; 4 of it.
    assert np.std(steps) == pytest.approx(np.sqrt(2 / 200.0), rel=0.16)


def test_the_two_channels_wander_apart() -> None:
    both = tuple(replace(baseline, wander_pF=1e-3, wander_s=0.1) for baseline in QUIET.baselines)
    run = quiet(2, presses=[], duration_s=400.0, baselines=both)
    assert abs(np.corrcoef(run.hard, run.soft)[0, 1]) < 5 / np.sqrt(2000)  # 400 s are 2000 times 2 tau


def test_a_jump_is_in_its_conversion_in_part() -> None:
    quiet_times = soft_baseline().t_soft_s
    jump_s = quiet_times[100] + SPAN_S / 4  # three quarters of this conversion are before it
    run = soft_baseline(jump_pF=2e-3, jump_s=float(jump_s))
    assert run.soft[:100] == pytest.approx(SOFT_PF, abs=STEP_PF)
    assert run.soft[100] == pytest.approx(SOFT_PF + 0.25 * 2e-3, abs=STEP_PF)
    assert run.soft[101:] == pytest.approx(SOFT_PF + 2e-3, abs=STEP_PF)


def test_a_thermal_change_begins_at_contact() -> None:
    warm = (replace(QUIET.baselines[0], thermal_pF=1e-2, thermal_s=3.0), QUIET.baselines[1])
    run, cold = quiet(baselines=warm), quiet()
    since = np.maximum(run.t_hard_s - 2.0, 0)
    assert run.hard - cold.hard == pytest.approx(1e-2 * (1 - np.exp(-since / 3.0)), abs=2 * STEP_PF)
    assert (run.soft == cold.soft).all()
    assert (quiet(presses=[], baselines=warm).hard == quiet(presses=[]).hard).all()


def test_settings_out_of_range() -> None:
    with pytest.raises(ValueError, match=r"thermal_s: got inf, allowed: a finite number above 0"):
        Baseline(thermal_s=np.inf)
    with pytest.raises(ValueError, match=r"wander_pF: got -1\.0, allowed: 0 or more"):
        Baseline(wander_pF=-1.0)
