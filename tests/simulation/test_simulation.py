"""The simulation: its truth, its converter, and what a scenario promises."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from palpate import Status
from palpate.ad7746.datasheet import CODES_PER_PF, NOISE_PF
from palpate.elasticity import SORBOTHANE_MPA, Elasticity
from palpate.simulation import Converter, Faults, Press, Record, Scenario, scenarios, simulate
from project import ROOT

QUIET = Scenario(presses=[Press(2.0, [(0.0, 2.5)])], tremor=0.0)


def test_the_same_seed_gives_the_same_recording() -> None:
    for name in scenarios.SCENARIOS:
        first, again, other = scenarios.run(name, 4), scenarios.run(name, 4), scenarios.run(name, 5)
        assert np.array_equal(first.hard_raw, again.hard_raw)
        assert not np.array_equal(first.hard_raw, other.hard_raw)


def test_every_scenario_is_on_its_page() -> None:
    page = (ROOT / "docs" / "simulation.md").read_text(encoding="utf-8")
    table = "".join(line.split("|")[1] for line in page.splitlines() if line.startswith("| `"))
    assert sorted(re.findall("`(.*?)`", table)) == sorted(scenarios.SCENARIOS)


def test_the_channels_are_read_in_turn() -> None:
    run = simulate(replace(QUIET, converter=Converter(jitter_s=0.0)))
    assert np.diff(run.t_hard_s) == pytest.approx(0.026)
    assert run.t_soft_s - run.t_hard_s == pytest.approx(0.013)


@pytest.mark.parametrize("capf", range(8))
def test_noise_and_codes_are_the_converters(capf: int) -> None:
    run = simulate(Scenario(duration_s=400.0, converter=Converter(capf=capf), tremor=0.0), seed=1)
    # rms of n values: a relative standard deviation of 1 / sqrt(2 n); 5 of them.
    tolerance = 5 / np.sqrt(2 * len(run.hard))
    assert np.std(run.hard) == pytest.approx(NOISE_PF[capf], rel=tolerance)
    assert np.array_equal(run.hard, (run.hard_raw - 0x800000) / CODES_PER_PF)
    assert abs(np.corrcoef(run.hard, run.soft)[0, 1]) < 5 / np.sqrt(len(run.hard))


def test_a_quiet_press_has_its_ratio() -> None:
    run = simulate(QUIET, seed=2)
    held = (run.t_hard_s > 2.5) & (run.t_hard_s < 8.5)
    hard, soft = run.hard[held] - 0.62, run.soft[held] + 0.41
    assert hard.mean() / soft.mean() == pytest.approx(2.5, rel=1e-4)
    assert (run.true_ratio[held] == 2.5).all()
    assert np.isnan(run.true_ratio[run.t_hard_s < 2]).all()
    idle = run.t_hard_s < 2
    assert run.hard[idle].mean() == pytest.approx(0.62, abs=5 * NOISE_PF[0] / np.sqrt(idle.sum()))


def test_a_conversion_is_an_average_dated_at_its_middle() -> None:
    """On a ramp of half a cosine, symmetric around its middle, the average is the value at the middle up to the curvature."""
    scenario = replace(QUIET, converter=Converter(jitter_s=0.0))
    run, press = simulate(scenario, seed=3), scenario.presses[0]
    rising = (run.t_soft_s > 2.0) & (run.t_soft_s < 2.3)
    expected = press.depth_pF * press.profile(run.t_soft_s[rising])
    # Curvature: depth (pi / rise)^2 / 2 times T^2 / 24 = 7e-5 pF; noise 4e-5 pF, 5 of it.
    assert run.soft[rising] + 0.41 == pytest.approx(expected, abs=7e-5 + 5 * NOISE_PF[0])


def test_tremor_has_its_size_and_its_band() -> None:
    run = simulate(
        Scenario(presses=[Press(0.0, [(0.0, 1.0)], depth_pF=1.0, hold_s=200.0)], duration_s=195.0, tremor=0.05)
    )
    held = run.t_hard_s > 1
    force = run.hard[held] - 0.62
    assert np.std(force) == pytest.approx(0.05, rel=0.15)  # conversions average, 24 tones beat
    spectrum = np.abs(np.fft.rfft((force - force.mean()) * np.hanning(force.size))) ** 2
    frequency = np.fft.rfftfreq(force.size, 0.026)
    assert spectrum[(frequency > 2.9) & (frequency < 12.1)].sum() > 0.99 * spectrum.sum()


def test_a_real_tremor_record_can_drive_the_press(recordings: Path) -> None:
    table = np.genfromtxt(recordings / "tremor" / "tremor1.csv", delimiter=";", skip_header=1, usecols=(0, 1))
    press = Press(0.0, [(0.0, 2.0)], hold_s=60.0)
    run = simulate(Scenario(presses=[press], duration_s=55.0, tremor=0.05, spectrum=Record(table[:, 0], table[:, 1])))
    held = run.t_soft_s > 1
    assert np.std(run.soft[held] + 0.41) / 0.25 == pytest.approx(0.05, rel=0.3)


def test_faults_are_marked_as_in_samples() -> None:
    lost = scenarios.run("dropouts", 1)
    missing = np.isnan(lost.hard) | np.isnan(lost.soft)
    assert np.array_equal(missing, lost.status == Status.LOST)
    assert np.array_equal(lost.hard_raw == -1, np.isnan(lost.hard))
    assert 0.05 < missing.mean() < 0.15  # two conversions a pair, 5 % each
    saturated = scenarios.run("saturating", 1)
    for values, flag in ((saturated.hard, Status.HARD_SATURATED), (saturated.soft, Status.SOFT_SATURATED)):
        marked = (saturated.status & int(flag)) != 0
        assert np.array_equal(marked, np.abs(values) >= saturated.full_scale_pF)
    assert (saturated.status == Status.HARD_SATURATED).any()


def test_what_is_out_of_range_is_refused() -> None:
    with pytest.raises(ValueError, match="capf: got 8, allowed: 0 to 7"):
        Converter(capf=8)
    with pytest.raises(ValueError, match=r"lost: got -1\.0, allowed: 0 to 1"):
        Faults(lost=-1.0)
    with pytest.raises(ValueError, match=r"tremor: got nan, allowed: 0 or more"):
        replace(QUIET, tremor=float("nan"))
    with pytest.raises(ValueError, match="scenario: got 'moon', allowed: soft-steady"):
        scenarios.run("moon")


def test_the_probe_and_its_inverse() -> None:
    probe = Elasticity()
    moduli = list(SORBOTHANE_MPA.values())
    assert moduli == sorted(moduli)
    assert len(moduli) == 10
    for modulus in moduli:
        assert probe.modulus(probe.ratio(modulus)) == pytest.approx(modulus, rel=1e-12)
    for wrong in (0.99, 10.0, float("nan")):
        with pytest.raises(ValueError, match="ratio: got"):
            probe.modulus(wrong)
    with pytest.raises(ValueError, match="modulus: got"):
        probe.ratio(-1.0)
