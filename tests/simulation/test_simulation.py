"""The simulation: its truth, its converter with baselines, times, stamps and faults, and what a scenario promises."""

import re
from collections.abc import Callable
from dataclasses import replace
from math import nan
from typing import Any

import numpy as np
import palpate
import pytest
from numeric import HARD_PF, QUIET, SOFT_PF, STEP_PF, held, quiet
from palpate import Status
from palpate.ad7746.bus import VirtualClock
from palpate.samples import Block
from palpate.simulation import (
    SCENARIOS,
    Gauge,
    Press,
    Scenario,
    Simulation,
    Substrate,
    scenarios,
    simulate,
)
from palpate.simulation.board_input import board_scenarios, simulated_board, unsupported
from palpate.simulation.readings import BaselineModel, ConverterModel, Faults, Stamps
from palpate.simulation.scenarios import EFFECTS
from project import ROOT


def test_the_same_seed_gives_the_same_recording() -> None:
    for name in scenarios.SCENARIOS:
        first = scenarios.run(name, 4)
        again = scenarios.run(name, 4)
        other = scenarios.run(name, 5)
        assert np.array_equal(first.hard_raw, again.hard_raw)
        assert not np.array_equal(first.hard_raw, other.hard_raw)


def test_every_scenario_is_on_its_page() -> None:
    page = (ROOT / "docs" / "simulation.md").read_text(encoding="utf-8")
    table = "".join(line.split("|")[1] for line in page.splitlines() if line.startswith("| `"))
    assert sorted(re.findall("`(.*?)`", table)) == sorted(scenarios.SCENARIOS)


def test_faults_are_marked_as_in_samples() -> None:
    lost = scenarios.run("dropouts", 1)
    missing = np.isnan(lost.hard) | np.isnan(lost.soft)
    assert np.array_equal(missing, lost.status == Status.LOST)
    assert np.array_equal(lost.hard_raw == -1, np.isnan(lost.hard))
    assert 0.05 < missing.mean() < 0.15  # two conversions a pair, 5 % each
    saturated = scenarios.run("saturating", 1)
    for values, flag in (
        (saturated.hard, Status.HARD_SATURATED),
        (saturated.soft, Status.SOFT_SATURATED),
    ):
        marked = (saturated.status & int(flag)) != 0
        assert np.array_equal(marked, np.abs(values) >= saturated.full_scale_pF)
    assert (saturated.status == Status.HARD_SATURATED).any()


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (lambda: ConverterModel(capf=8), "capf: got 8, allowed: 0 to 7"),
        (
            lambda: ConverterModel(conversion_s=0),
            "conversion_s: got 0, allowed: a finite number above 0",
        ),
        (lambda: Faults(lost=-1.0), "lost: got -1.0, allowed: 0 to 1"),
        (
            lambda: Faults(lost=0.9, lost_run=8.0),
            "lost: got 0.9, allowed: at most 0.889 with lost_run 8.0",
        ),
        (
            lambda: Gauge(exponent=0.9),
            "reference_pF: got 0 with exponent 0.9, allowed: above 0, or exponent 1",
        ),
        (lambda: Substrate(rigid_ratio=1), "rigid_ratio: got 1, allowed: above 1"),
        (
            lambda: Substrate(layout="soft-soft"),
            'layout: got "soft-soft", allowed: "hard-soft", "soft-hard-soft"',
        ),
        (lambda: Substrate(unequal=0.1), "unequal: got 0.1, allowed: 0 to 0"),
        (
            lambda: Press(0.0, [(0.0, 1.0)], tilt_deg=(60.0, 0.0)),
            "tilt_deg: got (60.0, 0.0), allowed: -45 to 45",
        ),
        (lambda: replace(QUIET, tremor=nan), "tremor: got nan, allowed: 0 or more"),
        (lambda: scenarios.run("moon"), "scenario: got 'moon', allowed: soft-steady"),
    ],
)
def test_what_is_out_of_range_is_refused(made: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        made()


SPAN_S = QUIET.converter.span_s


def soft_baseline(seed: int = 0, duration_s: float = 10.0, **settings: Any) -> Simulation:
    baseline = BaselineModel(SOFT_PF, **settings)
    return quiet(
        seed, presses=[], duration_s=duration_s, baselines=(BaselineModel(HARD_PF), baseline)
    )


def test_a_drift_has_its_slope_from_its_begin_on() -> None:
    run = soft_baseline(drift_pF_per_s=3e-4, drift_from_s=4.0)
    expected = SOFT_PF + 3e-4 * np.maximum(run.t_soft_s - 4.0, 0)
    # in one conversion the corner is averaged
    assert run.soft == pytest.approx(expected, abs=2 * STEP_PF)
    later = run.t_soft_s > 4.1
    assert np.polyfit(run.t_soft_s[later], run.soft[later], 1)[0] == pytest.approx(3e-4, rel=1e-3)
    assert run.hard == pytest.approx(HARD_PF, abs=STEP_PF)


def test_a_jump_is_in_its_conversion_in_part() -> None:
    quiet_times = soft_baseline().t_soft_s
    jump_s = quiet_times[100] + SPAN_S / 4  # three quarters of this conversion are before it
    run = soft_baseline(jump_pF=2e-3, jump_s=float(jump_s))
    assert run.soft[:100] == pytest.approx(SOFT_PF, abs=STEP_PF)
    assert run.soft[100] == pytest.approx(SOFT_PF + 0.25 * 2e-3, abs=STEP_PF)
    assert run.soft[101:] == pytest.approx(SOFT_PF + 2e-3, abs=STEP_PF)


def test_a_thermal_change_begins_at_contact() -> None:
    warm = (replace(QUIET.baselines[0], thermal_pF=1e-2, thermal_s=3.0), QUIET.baselines[1])
    run = quiet(baselines=warm)
    cold = quiet()
    since = np.maximum(run.t_hard_s - 2.0, 0)
    assert run.hard - cold.hard == pytest.approx(1e-2 * (1 - np.exp(-since / 3.0)), abs=2 * STEP_PF)
    assert (run.soft == cold.soft).all()
    assert (quiet(presses=[], baselines=warm).hard == quiet(presses=[]).hard).all()


IDLE = Scenario(duration_s=60.0, tremor=0.0)


def test_the_steps_of_another_converter() -> None:
    coarse = simulate(replace(IDLE, converter=ConverterModel(code_pF=1e-3)))
    steps = coarse.hard / 1e-3
    assert np.abs(steps - np.rint(steps)).max() < STEP_PF / 1e-3
    assert len(np.unique(coarse.hard)) <= 2


def test_host_stamps_are_wrong_and_the_readings_are_not() -> None:
    base = replace(IDLE, presses=QUIET.presses, converter=ConverterModel(jitter_s=0.0))
    true = simulate(base)
    run = simulate(replace(base, stamps=Stamps(host_s=0.003)))
    assert np.diff(true.t_hard_s) == pytest.approx(0.026)
    assert true.t_soft_s - true.t_hard_s == pytest.approx(0.013)
    for name in ("t_hard_s", "t_soft_s"):
        wrong = getattr(run, name) - getattr(true, name)
        assert np.abs(wrong).max() < 0.003
        # A uniform error of +-a has an s.d. of a / sqrt(3); from n = 2300 values it is known to 1 %.
        assert wrong.std() == pytest.approx(0.003 / np.sqrt(3), rel=0.05)
        # they do not add up
        assert abs(np.corrcoef(wrong[1:], wrong[:-1])[0, 1]) < 5 / np.sqrt(wrong.size)
    assert (run.hard == true.hard).all()
    assert np.array_equal(run.true_ratio, true.true_ratio, equal_nan=True)
    skewed = simulate(replace(base, stamps=Stamps(skew_s=0.003)))
    assert (skewed.t_hard_s == true.t_hard_s).all()
    assert skewed.t_soft_s - true.t_soft_s == pytest.approx(0.003)
    together = simulate(
        replace(base, converter=ConverterModel(together=True), stamps=Stamps(host_s=0.003))
    )
    assert (together.t_hard_s == together.t_soft_s).all()


def lengths(lost: np.ndarray) -> np.ndarray:
    """Return the lengths of the runs that are lost."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], lost.astype(int), [0]))))
    return edges[1::2] - edges[0::2]


@pytest.mark.parametrize(("share", "run"), [(0.3, 8.0), (0.1, 2.0), (0.5, 1.0), (0.02, 30.0)])
def test_runs_have_their_share_and_their_length(share: float, run: float) -> None:
    lost = Faults(lost=share, lost_run=run).lost_in_runs(400_000, np.random.default_rng(1))
    runs = lengths(lost)
    # Geometric lengths have an s.d. below their mean; the share follows from some thousand runs; 5 s.d.
    assert runs.mean() == pytest.approx(run, rel=5 / np.sqrt(runs.size))
    assert lost.mean() == pytest.approx(share, rel=10 / np.sqrt(runs.size))


def test_pickup_is_a_sine_averaged_by_each_conversion() -> None:
    """Amplitude times |sin(pi f T) / (pi f T)|, at the real times: aliased, the same sine in both channels."""
    for hertz in (50.0, 60.0, 13.0, 90.9091):
        faults = Faults(pickup_pF=1e-2, pickup_Hz=hertz)
        run, calm = (simulate(replace(IDLE, faults=f), 3) for f in (faults, Faults()))
        t = np.concatenate((run.t_hard_s, run.t_soft_s))
        added = np.concatenate((run.hard - calm.hard, run.soft - calm.soft))
        sines = np.stack((np.sin(2 * np.pi * hertz * t), np.cos(2 * np.pi * hertz * t)), axis=1)
        weights, *_ = np.linalg.lstsq(sines, added, rcond=None)
        turn = np.pi * hertz * 0.011
        assert np.hypot(*weights) == pytest.approx(1e-2 * abs(np.sin(turn)) / turn, abs=2 * STEP_PF)
        assert added == pytest.approx(sines @ weights, abs=2 * STEP_PF)


def test_an_effect_changes_no_other_random_number() -> None:
    """The readings before the contact are those of a plain touch, unless noise or baseline differ there."""
    moved = {"drift-both", "wander", "bursts", "pickup"}
    same = {n: s for n, s in EFFECTS.items() if n not in moved and s.converter == ConverterModel()}
    assert len(same) > 20
    for name, scenario in same.items():
        plain = Scenario(presses=[Press(2.0, [(0.0, 2.0)])], duration_s=scenario.duration_s)
        run = simulate(scenario, 6)
        other = simulate(plain, 6)
        idle = (other.t_hard_s < 1.5) & (run.hard_raw >= 0)
        assert np.array_equal(run.hard_raw[idle], other.hard_raw[idle]), name


def on_board(name: str, seed: int = 1) -> Block:
    with palpate.open(f"sim:{name}", seed=seed) as source:
        return np.concatenate([item for item in source if isinstance(item, np.ndarray)])


@pytest.mark.parametrize(
    "name", ["not-level", "power-gauge", "creep", "lag", "cross-talk", "thermal", "relaxing"]
)
def test_the_board_has_the_effect(name: str) -> None:
    run = simulate(SCENARIOS[name], 1)
    block = on_board(name)
    t = block["t_hard_ns"] / 1e9
    idle = t < 1.5
    pressed = (t > 7.0) & (t < 8.5)
    hard, soft = (
        block[channel][pressed].mean() - block[channel][idle].mean() for channel in ("hard", "soft")
    )
    inside = held(run) & (run.t_hard_s > 7.0) & (run.t_hard_s < 8.5)
    expected = (run.hard[inside].mean() - 0.62) / (run.soft[inside].mean() + 0.41)
    # the driver begins up to 0.1 s after the scenario
    assert hard / soft == pytest.approx(expected, rel=2e-3)


def test_what_a_board_cannot_be_is_refused() -> None:
    left_out = set(SCENARIOS) - set(board_scenarios())
    assert left_out == {
        "coarse-codes",
        "fast-converter",
        "host-stamps",
        "lost-runs",
        "skew",
        "together",
    }
    assert unsupported(SCENARIOS["jitter"]) == unsupported(SCENARIOS["slow-converter"]) == ""
    with pytest.raises(
        ValueError, match="scenario: got wrong time stamps, allowed on a board: its own"
    ):
        simulated_board(SCENARIOS["skew"], VirtualClock())
    with pytest.raises(ValueError, match="sim: got scenario 'together', allowed: soft-steady"):
        palpate.open("sim:together")
