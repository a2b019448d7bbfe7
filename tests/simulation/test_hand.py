"""Tilt, an object that relaxes, and the spectra of the tremor."""

import numpy as np
import pytest
from palpate.simulation import Lines, Press, Tilt
from palpate.simulation.tilt import Tilting
from quiet import changes, held, quiet

RATIO = 2.5


def test_a_ramp_and_rocking_are_their_formulas() -> None:
    run = quiet(tilt=Tilt(ramp_per_s=0.02, rock=0.05, rock_Hz=0.5))
    t, inside = run.t_hard_s - 2.0, held(run)
    expected = RATIO * (1 + 0.02 * t) * (1 + 0.05 * np.sin(np.pi * t))
    assert run.true_ratio[inside] == pytest.approx(expected[inside], rel=1e-12)


def test_an_object_relaxes() -> None:
    run = quiet(presses=[Press(2.0, [(0.0, RATIO)], relaxes=0.2, relaxation_s=1.0)])
    inside = held(run)
    expected = RATIO * (0.8 + 0.2 * np.exp(-(run.t_hard_s[inside] - 2.0)))
    assert run.true_ratio[inside] == pytest.approx(expected, rel=1e-12)
    assert expected[0] > 0.92 * RATIO  # it begins at contact


@pytest.mark.parametrize(
    ("tilt", "tolerance"),
    [
        # A slope of the ratio times a slope of the tremor, times T^2 / 12: below 4e-6 with T = 11 ms.
        (Tilt(ramp_per_s=0.02), 1e-5),
        (Tilt(rock=0.05, rock_Hz=0.5), 1e-5),
        (Tilt(oblique=0.05), 1e-5),
        # The mean of a walk over T differs from its middle by an s.d. of walk sqrt(T / 12) = 6e-4; 5 of it.
        (Tilt(walk=0.02), 3e-3),
    ],
)
def test_the_readings_have_the_true_ratio(tilt: Tilt, tolerance: float) -> None:
    run = quiet(3, tilt=tilt, tremor=0.05)
    hard, soft = (change[held(run)] for change in changes(run))
    assert hard / soft == pytest.approx(run.true_ratio[held(run)], rel=tolerance)
    assert np.abs(run.true_ratio[held(run)] / RATIO - 1).max() > 0.002


def test_a_walk_grows_with_the_root_of_the_time() -> None:
    ends = np.array(
        [
            Tilting(Tilt(walk=0.01), 10.0, np.random.default_rng(s)).factor(2.0, np.array([2.0, 3.0, 6.0]))
            for s in range(800)
        ]
    )
    assert ends[:, 0] == pytest.approx(1, abs=1e-12)
    # Relative standard deviation of an s.d. from 800 values: 1 / sqrt(1600) = 2.5 %; 4 of it.
    assert ends[:, 1].std() == pytest.approx(0.01, rel=0.1)
    assert ends[:, 2].std() == pytest.approx(0.02, rel=0.1)


def spectrum(values: np.ndarray, step_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies, Hz, and power; the sum of the power is the variance."""
    power = np.abs(np.fft.rfft(values * np.hanning(values.size))) ** 2
    return np.fft.rfftfreq(values.size, step_s), power / power.sum() * values.var()


def test_lines_and_sway_have_their_bands() -> None:
    t = np.arange(0, 400, 0.02)
    for seed in range(5):
        values = Lines((4.0, 9.0), width_Hz=0.4, sway=0.5).course(np.random.default_rng(seed))(t)
        frequency, power = spectrum(values - values.mean(), 0.02)
        tremor = power[(frequency > 2.98) & (frequency < 12.02)].sum()
        sway = power[(frequency > 0.08) & (frequency < 1.02)].sum()
        # The window weights 400 s unevenly, and two of 12 sines may be closer than 1 / 400 s.
        assert tremor == pytest.approx(1.0, rel=0.05)
        assert sway == pytest.approx(0.25, rel=0.1)
        assert tremor + sway == pytest.approx(power.sum(), rel=1e-3)


def test_a_line_has_its_width() -> None:
    t, second, middle = np.arange(0, 100, 0.02), [], 7.0
    for seed in range(60):
        values = Lines((middle,), width_Hz=0.4, sway=0.0).course(np.random.default_rng(seed))(t)
        frequency, power = spectrum(values, 0.02)
        second.append((power * (frequency - middle) ** 2).sum() / power.sum())
    # 60 x 12 sines of unequal power count as 360: an s.d. is known to 1 / sqrt(720) = 3.7 %; 4 of it.
    assert np.sqrt(np.mean(second)) == pytest.approx(0.4, rel=0.15)


def test_tremor_of_lines_shakes_the_force() -> None:
    press = Press(0.0, [(0.0, RATIO)], depth_pF=1.0, hold_s=200.0)
    run = quiet(presses=[press], duration_s=195.0, tremor=0.08, spectrum=Lines(sway=0.0))
    soft = changes(run)[1][held(run)]
    # A conversion of 11 ms averages 9 Hz by 1.6 %, half of the power.
    assert np.std(soft) == pytest.approx(0.08, rel=0.05)


def test_settings_out_of_range() -> None:
    with pytest.raises(ValueError, match=r"lines_Hz: got \(2\.0, 9\.0\), allowed: 3 to 12"):
        Lines((2.0, 9.0))
    with pytest.raises(ValueError, match=r"walk: got -1\.0, allowed: 0 or more"):
        Tilt(walk=-1.0)
