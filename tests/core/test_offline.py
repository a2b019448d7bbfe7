"""Touches estimated afterwards."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import palpate
import pytest
from palpate.recording import Recording
from palpate.simulation import ConverterModel, Faults, Scenario, Simulation, simulate
from palpate.simulation.scenarios import SCENARIOS

from bench.accuracy.must_hold import ONE_MEMORY, TIMES, beside_spline
from bench.accuracy.presses import held, recordings

PERIOD_S = 0.026
RATIO = 2.8
METHOD = "offline: matched pair of 5 + 6 points"


def exact(*, offsets: tuple[float, float], skew_s: float) -> Recording:
    """Return a press without noise: rise and fall of 0.4 s, and a tremor of two lines."""
    t_hard: Any = PERIOD_S * np.arange(480)
    t_soft = t_hard + skew_s

    def depth(t: Any) -> Any:
        rise = np.clip(np.minimum((t - 2.5) / 0.4, (9.5 - t) / 0.4), 0, 1)
        tremor = 0.04 * np.sin(2 * np.pi * 5.3 * t) + 0.03 * np.sin(2 * np.pi * 9.1 * t + 1)
        return 0.125 * (1 - np.cos(np.pi * rise)) * (1 + tremor)

    return Recording(t_hard, t_soft, offsets[0] + RATIO * depth(t_hard), offsets[1] + depth(t_soft))


@pytest.mark.parametrize("offsets", [(0.0, 0.0), (0.6, -0.4), (-3.9, 3.9)])
@pytest.mark.parametrize("skew_s", [0.0, 0.003, PERIOD_S / 3, PERIOD_S / 2, 0.9 * PERIOD_S])
def test_the_closed_form_on_exact_data(offsets: tuple[float, float], skew_s: float) -> None:
    # What is left: the mismatch of the filters, below 1e-3, of a tremor of 0.035 rms, in the mean over 6 s of it.
    [touch] = palpate.offline(exact(offsets=offsets, skew_s=skew_s))
    assert touch.ratio == pytest.approx(RATIO, rel=3e-6)
    assert touch.method == METHOD
    assert touch.baselines == "before and after"


@pytest.mark.parametrize("name", ONE_MEMORY)
def test_at_most_1_1_times_the_error_of_a_spline(name: str) -> None:
    runs = [simulate(SCENARIOS[name], seed) for seed in range(30)]
    row = beside_spline(name, runs, host_stamps=SCENARIOS[name].stamps.host_s > 0)
    assert row.value <= TIMES, row.beside


@pytest.mark.parametrize(
    "scene",
    [
        held(0.05),
        held(0.0),
        held(0.05, press={"depth_pF": 2e-4}),
        held(0.08, press={"hold_s": 1.5}),
        held(0.05, faults=Faults(lost=0.1)),
        held(0.02, converter=ConverterModel(together=True, bus_s=0.015)),
    ],
    ids=["tremor", "none", "light", "short", "lost", "together"],
)
def test_the_standard_error_covers(scene: Scenario) -> None:
    found = [palpate.offline(run) for run in recordings(scene, range(150))]
    results = [touches[0] for touches in found if touches]
    assert len(results) > 145
    off = np.array([(touch.ratio - RATIO) / touch.standard_error for touch in results])
    # 150 intervals of 95 %: 90 % is 2.8 standard deviations away.
    assert 0.90 <= np.mean(np.abs(off) < 1.96) <= 0.995


def test_lost_readings_and_spikes_are_left_out() -> None:
    clean = held(0.05)
    for faults, most in (
        (Faults(lost=0.3, lost_run=8.0), 3e-4),
        (Faults(spikes_per_s=1.0, spike_pF=4e-3), 1e-4),
    ):
        found = [
            palpate.offline(run)[0] for run in recordings(replace(clean, faults=faults), range(20))
        ]
        assert math.sqrt(np.mean([(touch.ratio / RATIO - 1) ** 2 for touch in found])) < most
    assert found[3].left_out > 0
    assert found[3].samples > 235


def test_a_recovering_channel_uses_the_baseline_before_only() -> None:
    [touch] = palpate.offline(simulate(SCENARIOS["creep"], 0))
    assert "creep" in touch.flags
    assert touch.baselines == "before"


def test_a_recording_that_ends_in_a_touch_has_the_baseline_before() -> None:
    run = simulate(SCENARIOS["tremor"], 0)
    end = int(np.searchsorted(run.t_hard_s, 8.0))
    part = Recording(run.t_hard_s[:end], run.t_soft_s[:end], run.hard[:end], run.soft[:end])
    [touch] = palpate.offline(part)
    assert touch.baselines == "before"
    assert not touch.live.revised
    assert (
        abs(touch.ratio / run.presses[0].ratios[0][1] - 1) < 4 * touch.standard_error / touch.ratio
    )


def test_a_short_touch_has_a_reason_in_place_of_a_result() -> None:
    run = simulate(SCENARIOS["saturating"], 0)
    [touch] = palpate.offline(run)
    assert math.isnan(touch.ratio)
    assert touch.method.startswith("offline: none, too few pairs")
    assert touch.as_dict()["ratio"] is None


def test_what_cannot_be_estimated_is_refused() -> None:
    run: Simulation = simulate(SCENARIOS["tremor"], 0)
    unknown = np.full(run.hard.shape, np.nan)
    with pytest.raises(ValueError, match="got one without times, allowed: one with times"):
        palpate.offline(Recording(unknown, unknown, run.hard, run.soft))
    with pytest.raises(ValueError, match="scene: got 'fixed'"):
        palpate.offline(run, scene="fixed")
    source: Any = palpate.open("sim:tremor")
    with pytest.raises(TypeError, match="a live source has to be recorded first"):
        palpate.offline(source)
