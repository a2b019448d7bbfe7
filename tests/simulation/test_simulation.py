"""The simulation: its truth, its converter, and what a scenario promises."""

import re
from collections.abc import Callable
from dataclasses import replace
from math import nan
from pathlib import Path

import numpy as np
import pytest
from palpate import Status
from palpate.ad7746.datasheet import CODES_PER_PF, NOISE_PF
from palpate.simulation import Converter, Faults, Gauge, Press, Record, Scenario, Substrate, scenarios, simulate
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


@pytest.mark.parametrize("capf", range(8))
def test_noise_and_codes_are_the_converters(capf: int) -> None:
    run = simulate(Scenario(duration_s=400.0, converter=Converter(capf=capf), tremor=0.0), seed=1)
    # rms of n values: a relative standard deviation of 1 / sqrt(2 n); 5 of them.
    tolerance = 5 / np.sqrt(2 * len(run.hard))
    assert np.std(run.hard) == pytest.approx(NOISE_PF[capf], rel=tolerance)
    assert np.array_equal(run.hard, (run.hard_raw - 0x800000) / CODES_PER_PF)
    assert abs(np.corrcoef(run.hard, run.soft)[0, 1]) < 5 / np.sqrt(len(run.hard))


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


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (lambda: Converter(capf=8), "capf: got 8, allowed: 0 to 7"),
        (lambda: Converter(conversion_s=0), "conversion_s: got 0, allowed: a finite number above 0"),
        (lambda: Faults(lost=-1.0), "lost: got -1.0, allowed: 0 to 1"),
        (lambda: Faults(lost=0.9, lost_run=8.0), "lost: got 0.9, allowed: at most 0.889 with lost_run 8.0"),
        (lambda: Gauge(exponent=0.9), "reference_pF: got 0 with exponent 0.9, allowed: above 0, or exponent 1"),
        (lambda: Substrate(rigid_ratio=1), "rigid_ratio: got 1, allowed: above 1"),
        (lambda: Press(0.0, [(0.0, 1.0)], tilt_deg=(60.0, 0.0)), "tilt_deg: got (60.0, 0.0), allowed: -45 to 45"),
        (lambda: replace(QUIET, tremor=nan), "tremor: got nan, allowed: 0 or more"),
        (lambda: scenarios.run("moon"), "scenario: got 'moon', allowed: soft-steady"),
    ],
)
def test_what_is_out_of_range_is_refused(made: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        made()
