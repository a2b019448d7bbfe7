"""Touches estimated afterwards."""

import math
import subprocess
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import palpate
import pytest
from palpate.afterwards.times import smooth
from palpate.afterwards.windows import windows
from palpate.recording import Recording
from palpate.simulation import Converter, Faults, Press, Scenario, Simulation, Stamps, simulate
from palpate.simulation.scenarios import SCENARIOS

from bench.accuracy.must_hold.offline import ONE_MEMORY, TIMES, compared
from bench.accuracy.must_hold.presses import held, recordings

PERIOD_S, RATIO = 0.026, 2.8
METHOD = "offline: matched pair of 5 + 6 points"


def exact(
    *,
    offsets: tuple[float, float] = (0.6, -0.4),
    drifts: tuple[float, float] = (0.0, 0.0),
    skew_s: float = PERIOD_S / 2,
    shape: float = 0.25,
    noise: float = 0.0,
) -> Recording:
    """Return a press without noise: rise and fall of 0.4 s, and a tremor of two lines."""
    t_hard: Any = PERIOD_S * np.arange(480)
    t_soft = t_hard + skew_s
    random = np.random.default_rng(1)

    def depth(t: Any) -> Any:
        rise = np.clip(np.minimum((t - 2.5) / 0.4, (9.5 - t) / 0.4), 0, 1)
        tremor = 0.04 * np.sin(2 * np.pi * 5.3 * t) + 0.03 * np.sin(2 * np.pi * 9.1 * t + 1)
        return shape * 0.5 * (1 - np.cos(np.pi * rise)) * (1 + tremor)

    changes = (RATIO * depth(t_hard), depth(t_soft))
    channels = [
        offset + drift * t + change + noise * random.normal(size=t.size)
        for offset, drift, t, change in zip(offsets, drifts, (t_hard, t_soft), changes, strict=True)
    ]
    return Recording(t_hard, t_soft, channels[0], channels[1])


@pytest.mark.parametrize("offsets", [(0.0, 0.0), (0.6, -0.4), (-3.9, 3.9)])
def test_the_closed_form_on_exact_data(offsets: tuple[float, float]) -> None:
    # What is left: the mismatch of the filters, below 1e-3, of a tremor of 0.035 rms, in the mean over 6 s of it.
    [touch] = palpate.offline(exact(offsets=offsets))
    assert touch.ratio == pytest.approx(RATIO, rel=3e-6)
    assert touch.method == METHOD
    assert touch.baselines == "before and after"


def test_an_even_drift_of_the_baselines_is_removed() -> None:
    [touch] = palpate.offline(exact(drifts=(2e-4, -3e-4), noise=2e-6))
    # 1.2 and 1.8 fF in 6 s, of 700 and 250 fF.
    assert touch.ratio == pytest.approx(RATIO, rel=2e-5)
    assert abs(palpate.touches(exact(drifts=(2e-4, -3e-4), noise=2e-6))[0].first_ratio / RATIO - 1) > 1e-3


@pytest.mark.parametrize("skew_s", [0.0, 0.003, PERIOD_S / 3, PERIOD_S / 2, 0.9 * PERIOD_S])
def test_the_filters_are_made_for_the_skew_of_the_recording(skew_s: float) -> None:
    t: Any = PERIOD_S * np.arange(40)
    found = windows(t, t + skew_s)
    assert found.mismatch.max() < 2e-3
    np.testing.assert_allclose(found.hard_weight.sum(axis=1), 1, atol=1e-12)
    np.testing.assert_allclose(found.soft_weight.sum(axis=1), 1, atol=1e-12)
    for f in (0.5, 4.0, 8.0, 12.0):
        responses = [
            (weight * np.exp(2j * np.pi * f * times[at])).sum(axis=1)
            for weight, at, times in (
                (found.hard_weight, found.hard_at, t),
                (found.soft_weight, found.soft_at, t + skew_s),
            )
        ]
        assert np.abs(responses[0] - responses[1]).max() < 6e-3


def test_at_18_pairs_a_second_both_channels_are_low_passed() -> None:
    t: Any = np.linspace(0, 39 / 18, 40)
    found = windows(t, t + 1 / 36)
    passed = [abs((found.hard_weight[5] * np.exp(2j * np.pi * f * t[found.hard_at[5]])).sum()) for f in (1.0, 9.0)]
    assert passed[0] > 0.9
    assert passed[1] < 0.1


@pytest.mark.parametrize("name", ONE_MEMORY)
def test_at_most_1_1_times_the_error_of_a_spline(name: str) -> None:
    runs = [simulate(SCENARIOS[name], seed) for seed in range(30)]
    row = compared(name, runs, host_stamps=SCENARIOS[name].stamps.host_s > 0)
    assert row.value <= TIMES, row.beside


@pytest.mark.parametrize("tremor", [0.0, 0.05, 0.12])
def test_the_same_for_presses_with_lines(tremor: float) -> None:
    row = compared("lines", list(recordings(held(tremor), range(30))))
    assert row.value <= TIMES, row.beside


def test_a_light_touch_is_not_biased() -> None:
    # 5 standard deviations deep: least squares would be 2 % low. The standard error of the mean of 100 is 0.25 %.
    light = Scenario(presses=[Press(2.0, [(0.0, RATIO)], depth_pF=2e-4)], duration_s=11.0)
    found = [palpate.offline(simulate(light, seed)) for seed in range(100)]
    ratios = np.array([touches[0].ratio for touches in found if touches]) / RATIO - 1
    assert len(ratios) > 95
    assert abs(ratios.mean()) < 0.008
    assert ratios.std() < 0.04


@pytest.mark.parametrize(
    "scene",
    [
        held(0.05),
        held(0.0),
        held(0.05, press={"depth_pF": 2e-4}),
        held(0.08, press={"hold_s": 1.5}),
        held(0.05, faults=Faults(lost=0.1)),
        held(0.02, converter=Converter(together=True, bus_s=0.015)),
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
        (Faults(lost=0.1), 1e-4),
        (Faults(lost=0.3, lost_run=8.0), 3e-4),
        (Faults(spikes_per_s=1.0, spike_pF=4e-3), 1e-4),
    ):
        errors = [
            palpate.offline(run)[0].ratio / RATIO - 1 for run in recordings(replace(clean, faults=faults), range(20))
        ]
        assert math.sqrt(np.mean(np.square(errors))) < most
    [touch] = palpate.offline(next(recordings(replace(clean, faults=Faults(spikes_per_s=1.0, spike_pF=4e-3)), [3])))
    assert touch.left_out > 0
    assert touch.samples > 235


def test_one_wrong_reading_is_found() -> None:
    recording = exact(noise=4e-5)
    recording.soft[200] += 4e-3
    [touch] = palpate.offline(recording)
    assert touch.left_out == 1
    assert touch.ratio == pytest.approx(RATIO, rel=1e-4)


def test_only_the_part_since_the_last_change_of_the_ratio() -> None:
    [run] = recordings(held(0.05, press={"ratios": [(0.0, RATIO), (4.0, 1.01 * RATIO)]}), [5])
    [touch] = palpate.offline(run)
    assert touch.live.alarm_share > 0
    assert touch.start_s > run.presses[0].start_s + 4
    assert touch.ratio == pytest.approx(1.01 * RATIO, abs=4 * touch.standard_error)
    assert touch.samples < 110


def test_an_alarm_of_a_noise_burst_is_no_change() -> None:
    errors, begun = [], []
    for seed in range(20):
        touch = max(palpate.offline(simulate(SCENARIOS["bursts"], seed)), key=lambda touch: touch.samples)
        errors.append(touch.ratio / SCENARIOS["bursts"].presses[0].ratios[0][1] - 1)
        begun.append(touch.start_s < 2.5 and touch.samples > 150)
    assert math.sqrt(np.mean(np.square(errors))) < 1e-4
    assert np.mean(begun) > 0.85


def test_a_wrong_constant_time_of_one_channel_is_removed() -> None:
    [touch] = palpate.offline(simulate(replace(SCENARIOS["tremor"], stamps=Stamps(skew_s=0.003)), 1))
    assert touch.lag_s == pytest.approx(0.003, abs=1e-4)
    assert touch.flags == touch.live.flags == ("lag",)


def test_a_misfit_keeps_the_standard_error_large() -> None:
    for name in ("not-level", "power-gauge", "quadratic-gauge"):
        [touch] = palpate.offline(simulate(SCENARIOS[name], 0))
        assert touch.flags
        assert touch.standard_error >= touch.live.standard_error
    for touch in palpate.offline(simulate(SCENARIOS["four-specimens"], 1))[2:]:  # gauges that bend a little
        truth = palpate.simulation.scenarios.PROBE.ratio
        error = min(abs(touch.ratio / truth(m) - 1) for m in palpate.elasticity.SORBOTHANE_MPA.values())
        assert error < 4 * touch.standard_error / touch.ratio


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
    assert abs(touch.ratio / run.presses[0].ratios[0][1] - 1) < 4 * touch.standard_error / touch.ratio


def test_the_live_touches_are_those_of_touches() -> None:
    run = simulate(SCENARIOS["four-specimens"], 2)
    found = palpate.offline(run, threshold=9.0)
    assert [touch.live for touch in found] == palpate.touches(run, threshold=9.0)
    assert all(touch.ratio != touch.live.ratio for touch in found)


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


def test_no_touch_no_result() -> None:
    assert palpate.offline(simulate(Scenario(duration_s=4.0), 0)) == []


def test_times_of_a_host_are_smoothed_but_not_a_pause() -> None:
    t = 0.026 * np.arange(200.0)
    t[100:] += 5.0
    late = t + np.random.default_rng(3).uniform(-0.003, 0.003, t.size)
    assert np.abs(smooth(late) - t)[20:80].max() < 0.0012
    assert np.abs(smooth(late) - t).max() < 0.0035


def test_coarse_codes_have_the_baseline_after_the_release() -> None:
    [touch] = palpate.offline(simulate(SCENARIOS["coarse-codes"], 0))
    assert touch.baselines == "before and after"


def test_a_window_with_a_gap_does_not_hide_the_result() -> None:
    run = simulate(SCENARIOS["host-stamps"], 91)  # readings left out make such windows
    [touch] = palpate.offline(run, host_stamps=True)
    assert touch.samples > 150
    assert abs(touch.ratio / run.presses[0].ratios[0][1] - 1) < 5 * touch.standard_error / touch.ratio


def test_scipy_is_not_needed() -> None:
    code = (
        "import sys, palpate; from palpate.simulation import scenarios; "
        "palpate.offline(scenarios.run('tremor')); assert 'scipy' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
