"""Times, codes, stamps and faults of the converter."""

from dataclasses import replace

import numpy as np
import pytest
from palpate import Status
from palpate.ad7746.datasheet import NOISE_PF
from palpate.samples import samples_of
from palpate.simulation import SCENARIOS, Converter, Faults, Press, Scenario, Stamps, simulate
from palpate.simulation.effects import EFFECTS
from quiet import QUIET, STEP_PF

IDLE = Scenario(duration_s=60.0, tremor=0.0)


@pytest.mark.parametrize(("name", "pairs"), [("slow-converter", 18.0), ("fast-converter", 1000.0), ("lag", 1 / 0.026)])
def test_pairs_per_second(name: str, pairs: float) -> None:
    run = simulate(SCENARIOS[name])
    assert (run.t_hard_s.size - 1) / np.ptp(run.t_hard_s) == pytest.approx(pairs, rel=1e-3)
    assert 1 / SCENARIOS[name].converter.period_s == pytest.approx(pairs)


def test_both_channels_at_once() -> None:
    run = simulate(replace(QUIET, converter=Converter(together=True, conversion_s=0.0009, bus_s=0.0001)))
    assert (run.t_hard_s == run.t_soft_s).all()
    pressed = run.soft + 0.41 > 0.01
    assert (run.hard - 0.62)[pressed] == pytest.approx(2.5 * (run.soft + 0.41)[pressed], abs=3 * 5 * NOISE_PF[0])


def test_the_noise_and_the_steps_of_another_converter() -> None:
    run = simulate(replace(IDLE, converter=Converter(noise_pF=1e-4)))
    assert np.std(run.soft) == pytest.approx(1e-4, rel=5 / np.sqrt(2 * run.soft.size))
    coarse = simulate(replace(IDLE, converter=Converter(code_pF=1e-3)))
    steps = coarse.hard / 1e-3
    assert np.abs(steps - np.rint(steps)).max() < STEP_PF / 1e-3
    assert len(np.unique(coarse.hard)) <= 2


def test_host_stamps_are_wrong_and_the_readings_are_not() -> None:
    base = replace(IDLE, presses=QUIET.presses, converter=Converter(jitter_s=0.0))
    true, run = simulate(base), simulate(replace(base, stamps=Stamps(host_s=0.003)))
    assert np.diff(true.t_hard_s) == pytest.approx(0.026)
    for name in ("t_hard_s", "t_soft_s"):
        wrong = getattr(run, name) - getattr(true, name)
        assert np.abs(wrong).max() < 0.003
        # A uniform error of +-a has an s.d. of a / sqrt(3); from n = 2300 values it is known to 1 %.
        assert wrong.std() == pytest.approx(0.003 / np.sqrt(3), rel=0.05)
        assert abs(np.corrcoef(wrong[1:], wrong[:-1])[0, 1]) < 5 / np.sqrt(wrong.size)  # they do not add up
    assert (run.hard == true.hard).all()
    assert np.array_equal(run.true_ratio, true.true_ratio, equal_nan=True)
    together = simulate(replace(base, converter=Converter(together=True), stamps=Stamps(host_s=0.003)))
    assert (together.t_hard_s == together.t_soft_s).all()


def test_a_skew_is_of_the_soft_times_alone() -> None:
    run, true = simulate(replace(IDLE, stamps=Stamps(skew_s=0.003))), simulate(IDLE)
    assert (run.t_hard_s == true.t_hard_s).all()
    assert run.t_soft_s - true.t_soft_s == pytest.approx(0.003)


def test_jitter_of_the_conversions_adds_up() -> None:
    run = simulate(replace(IDLE, converter=Converter(jitter_s=0.001)))
    steps = np.diff(run.t_hard_s) - 0.026
    # Two uniform errors of +-1 ms in each.
    assert steps.std() == pytest.approx(0.001 * np.sqrt(2 / 3), rel=5 / np.sqrt(2 * steps.size))
    assert abs(np.corrcoef(steps[1:], steps[:-1])[0, 1]) < 5 / np.sqrt(steps.size)


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


def test_runs_go_through_both_channels() -> None:
    run = simulate(replace(IDLE, duration_s=2000.0, faults=Faults(lost=0.3, lost_run=8.0)), 1)
    order = np.isnan(np.stack((run.hard, run.soft), axis=1)).ravel()
    assert lengths(order).mean() == pytest.approx(8.0, rel=0.06)
    assert order.mean() == pytest.approx(0.3, rel=0.06)


def test_a_channel_that_was_not_lost_keeps_its_value() -> None:
    run = simulate(SCENARIOS["lost-10"], 1)
    one = np.flatnonzero(np.isnan(run.hard) & ~np.isnan(run.soft))
    assert one.size > 20
    sample = samples_of(run.block())[one[0]]
    assert (sample.hard_raw, sample.status) == (-1, Status.LOST)
    assert (sample.soft, sample.soft_raw) == (run.soft[one[0]], run.soft_raw[one[0]])


def test_bursts_raise_the_noise_for_their_time() -> None:
    faults = Faults(bursts_per_s=0.5, burst_s=0.3, burst_factor=20.0)
    run, calm = (simulate(replace(IDLE, duration_s=1000.0, faults=f), 4) for f in (faults, Faults()))
    noise, before = run.hard - 0.62, calm.hard - 0.62
    hit = run.hard != calm.hard
    # A code may stay the same by chance; a burst's share of the time: 1 - exp(-rate length), from 500 bursts.
    assert hit.mean() == pytest.approx(1 - np.exp(-0.15), rel=0.2)
    assert noise[hit] == pytest.approx(20 * before[hit], abs=20 * STEP_PF)
    assert lengths(hit).max() * 0.026 > 0.2


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
    same = {n: s for n, s in EFFECTS.items() if n not in moved and s.converter == Converter()}
    assert len(same) > 20
    for name, scenario in same.items():
        plain = Scenario(presses=[Press(2.0, [(0.0, 2.0)])], duration_s=scenario.duration_s)
        run, other = simulate(scenario, 6), simulate(plain, 6)
        idle = (other.t_hard_s < 1.5) & (run.hard_raw >= 0)
        assert np.array_equal(run.hard_raw[idle], other.hard_raw[idle]), name


def test_settings_out_of_range() -> None:
    for lost_run in (0.5, -1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match=r"lost_run: got .*, allowed: 0, or 1 or more"):
            Faults(lost_run=lost_run)
    with pytest.raises(ValueError, match=r"lost: got 0\.9, allowed: at most 0\.889 with lost_run 8\.0"):
        Faults(lost=0.9, lost_run=8.0)
    with pytest.raises(ValueError, match="conversion_s: got 0, allowed: a finite number above 0"):
        Converter(conversion_s=0)
    with pytest.raises(ValueError, match="host_s: got -1, allowed: 0 or more"):
        Stamps(host_s=-1)
