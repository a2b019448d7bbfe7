"""The noise on request: rms and spectrum of what is known, peaks named by where the mains appear."""

import math

import numpy as np
import pytest
from palpate.live.feed import ROW, Flag, Rows
from palpate.live.noise_spectrum import FEWEST, alias, idle, noise_of

RATE = 38.5


def made(count: int = 8192, *, hard: float = 12.0, soft: float = 7.0, line_hz: float = 0, line_aF: float = 0) -> Rows:
    """Return idle rows with white noise of these rms values, aF, and a line in the hard channel."""
    draw = np.random.default_rng(1)
    rows = np.zeros(count, ROW)
    rows["t_s"] = np.arange(count) / RATE
    line = line_aF * math.sqrt(2) * np.sin(2 * np.pi * line_hz * rows["t_s"])
    rows["hard"] = (hard * draw.normal(size=count) + line) * 1e-6
    rows["soft"] = soft * draw.normal(size=count) * 1e-6
    return rows


def test_white_noise_has_its_rms_and_its_level() -> None:
    """A mean of 8192 samples: rms within 5 standard errors, 5 / sqrt(2 * 8192); its level is rms * sqrt(2 / rate)."""
    found = noise_of(made())
    assert found["seconds"] == pytest.approx(8192 / RATE)
    for name, rms in (("hard", 12.0), ("soft", 7.0)):
        assert found[f"{name}_aF"] == pytest.approx(rms, rel=0.04)
        level = math.sqrt(np.mean(np.square(found[name])))
        assert level == pytest.approx(rms * math.sqrt(2 / RATE), rel=0.04)
    assert found["peaks"] == []
    assert "hard 12 aF rms" in found["text"]
    assert "50 Hz at 11.5 Hz and 60 Hz at 17.0 Hz" in found["text"]


@pytest.mark.parametrize(("hz", "name"), [(50.0, "mains, 50 Hz"), (60.0, "mains, 60 Hz"), (6.0, "tremor of a hand")])
def test_a_line_is_found_where_it_appears(hz: float, name: str) -> None:
    [peak] = noise_of(made(line_hz=hz, line_aF=20.0))["peaks"]
    assert peak["hz"] == pytest.approx(alias(hz, RATE), abs=RATE / 512)
    assert peak["aF"] == pytest.approx(20.0, rel=0.1)
    assert (peak["channel"], peak["name"]) == ("hard", name)


def test_touches_and_missing_values_are_left_out() -> None:
    rows = made()
    rows["hard"][3000:4000] += 0.5
    rows["flags"][3000:4000] = int(Flag.CONTACT)
    rows["hard"][5000] = np.nan
    rows["flags"][5000] = int(Flag.REFUSED)
    assert noise_of(rows)["hard_aF"] == pytest.approx(12.0, rel=0.05)
    rows["t_s"][6000:] += 3.0
    for segment in idle(rows):
        assert not segment["flags"].any()
        assert np.diff(segment["t_s"]) == pytest.approx(1 / RATE, rel=1e-6)
    rows["flags"] = int(Flag.CONTACT)
    assert noise_of(rows)["hard_aF"] is None
    assert f"wait for {FEWEST} samples" in noise_of(rows)["text"]
    assert noise_of(rows[:0])["hz"] == []
