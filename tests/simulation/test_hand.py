"""The spectra of the tremor, and the session of ten specimens."""

import numpy as np
import palpate
import pytest
from palpate.elasticity import SORBOTHANE_MPA
from palpate.simulation import Lines, simulate
from palpate.simulation.board import known
from palpate.simulation.hand import SESSIONS
from palpate.simulation.scenarios import PROBE


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


def test_ten_specimens() -> None:
    scenario = SESSIONS["ten-specimens"]
    assert "ten-specimens" in known()
    begins = [press.start_s for press in scenario.presses]
    assert np.allclose(np.diff(begins), 8.9)
    assert begins[0] > 5  # s: a list of specimens is entered, and a busy computer has its baseline
    found = palpate.touches(simulate(scenario, seed=1))
    assert len(found) == 40
    assert sum(bool(touch.flags) for touch in found) <= 4  # the gauges bend a little: the firmest presses are flagged
    means = np.array([touch.ratio for touch in found]).reshape(10, 4).mean(axis=1)
    truth = [PROBE.ratio(modulus) for modulus in SORBOTHANE_MPA.values()]
    assert np.abs(means / truth - 1).max() < 0.05
