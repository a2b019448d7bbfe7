"""The noise on request: rms of what is known, and peaks named by where mains and tremor appear."""

import math

import numpy as np
import pytest
from palpate.live.noise import FEWEST, idle_segments, noise_of
from palpate.live.page_frames import ROW, RowFlag, Rows

RATE = 38.5


def made(
    count: int = 8192,
    *,
    hard: float = 12.0,
    soft: float = 7.0,
    line_hz: float = 0,
    line_aF: float = 0,
) -> Rows:
    """Return idle rows with white noise of these rms values, aF, and a line in the hard channel."""
    draw = np.random.default_rng(1)
    rows = np.zeros(count, ROW)
    rows["t_s"] = np.arange(count) / RATE
    line = line_aF * math.sqrt(2) * np.sin(2 * np.pi * line_hz * rows["t_s"])
    rows["hard"] = (hard * draw.normal(size=count) + line) * 1e-6
    rows["soft"] = soft * draw.normal(size=count) * 1e-6
    return rows


@pytest.mark.parametrize(
    ("hz", "said"),
    [
        (0.0, "12 aF rms"),
        (50.0, "23 aF rms with 50 Hz mains at 11.5 Hz"),
        (6.0, "23 aF rms with tremor of a hand at 6.0 Hz"),
        (15.0, "23 aF rms"),
    ],
)
def test_the_sentence_has_the_rms_and_what_stands_out(hz: float, said: str) -> None:
    """A mean of 8192 samples: two digits of an rms of 12 aF, or of the root of 12² + 20² aF²."""
    assert (
        noise_of(made(line_hz=hz, line_aF=20.0))
        == f"Noise without contact, 213 s: hard {said}, soft 7.0 aF rms."
    )


def test_touches_and_missing_values_are_left_out() -> None:
    rows = made()
    rows["hard"][3000:4000] += 0.5
    rows["flags"][3000:4000] = int(RowFlag.CONTACT)
    rows["hard"][5000] = np.nan
    rows["flags"][5000] = int(RowFlag.REFUSED)
    assert "hard 12 aF rms, soft 7.0 aF rms." in noise_of(rows)
    rows["t_s"][6000:] += 3.0
    for segment in idle_segments(rows):
        assert not segment["flags"].any()
        assert np.diff(segment["t_s"]) == pytest.approx(1 / RATE, rel=1e-6)
    rows["flags"] = int(RowFlag.CONTACT)
    for known in (rows, rows[:0]):
        assert f"wait for {FEWEST} samples" in noise_of(known)
