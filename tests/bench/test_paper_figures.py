"""The paper's figures (bench/paper): what is drawn, and that its numbers are true."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray
from palpate.elasticity import SORBOTHANE_MPA
from palpate.simulation.scenarios import PROBE

from bench.paper.__main__ import FIGURES, main
from bench.paper.specimens import ten_specimens
from bench.paper.touches import one_touch, two_specimens


def stretches(contact: NDArray[Any]) -> list[NDArray[np.intp]]:
    """Return the row numbers of each stretch that is not nan."""
    rows = np.flatnonzero(np.isfinite(contact))
    return np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)


def test_the_command_writes_all_figures_with_their_captions(tmp_path: Path) -> None:
    assert CliRunner().invoke(main, ["-o", str(tmp_path / "a")]).exit_code == 0
    for number, figure in FIGURES.items():
        assert (tmp_path / "a" / f"fig{number:02}.pdf").read_bytes().startswith(b"%PDF")
        png = (tmp_path / "a" / f"fig{number:02}.png").read_bytes()
        width, height = (int.from_bytes(png[at : at + 4], "big") for at in (16, 20))
        assert (width, height) == tuple(round(size * 300) for size in figure.size_in)
        assert b"Simulated data (palpate.simulation, seed 0), not a measurement." in png
    assert (tmp_path / "a" / "captions.md").read_text().count("Fig. ") >= 6


def test_fig_6_and_7_show_what_the_paper_says() -> None:
    for name, t in two_specimens(0).items():
        [rows] = stretches(t.statistic)
        first = rows[30:40]
        last = rows[-100:]
        error = {
            each: np.abs(getattr(t, each) / t.truth - 1) for each in ("slow", "fast", "handheld")
        }
        assert error["fast"][first].mean() < error["slow"][first].mean()
        assert np.ptp(t.fast[last]) > 2 * np.ptp(t.slow[last])
        assert error["handheld"][last].max() < 0.1 * error["fast"][last].max()
        assert t.handheld[last] == pytest.approx(PROBE.ratio(SORBOTHANE_MPA[name]), rel=0.01)
        assert (t.slow[np.isnan(t.statistic)] == 1).all()
    t = one_touch(0)
    [rows] = stretches(t.statistic)
    assert 0 <= np.flatnonzero(t.statistic[rows] > 0.05)[0] < 15
    on = rows[t.paper_alarm[rows]]
    assert (np.diff(on) == 1).all()
    assert t.statistic[on[-1] + 1] == 0  # the alarm ends where the signal is back at 0
    assert np.ptp(t.adaptive[rows[-100:]]) < 0.5 * np.ptp(t.fast[rows[-100:]])


def test_fig_10_to_12_scatter_as_the_hand_does_and_their_intervals_hold_the_truth() -> None:
    ten = ten_specimens(0)
    truth = np.array([PROBE.ratio(one.modulus) for one in ten.paper])
    both = [
        np.array([[touch.ratio for touch in one.touches] for one in of])
        for of in (ten.paper, ten.handheld)
    ]
    # the hand's obliqueness
    assert np.std(both[1] / truth[:, None]) == pytest.approx(0.03, rel=0.4)
    assert both[0] == pytest.approx(both[1], rel=0.01)
    assert list(ten.chosen().values())[1:] == [pytest.approx(truth, rel=0.1)] * 2
    for fitted in (ten.smallest_p, ten.every_touch):
        for name in ("rigid_ratio", "half_modulus"):
            low, high = fitted.parameter_intervals()[name]
            assert low < getattr(PROBE, name) < high
