"""The paper's figures: what is drawn, and that its numbers are true."""

import csv
import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from made_once import made_once
from numpy.typing import NDArray
from palpate import figure_style, figures
from palpate.cli import main
from palpate.elasticity import SORBOTHANE_MPA
from palpate.figures import drawings
from palpate.figures.traces import FOUR, ONE, PAIR, SETTLED, TREMOR
from palpate.simulation.scenarios import PROBE

ESTIMATES = (figure_style.PAPER, figure_style.HANDHELD, figure_style.SLOW, figure_style.FAST)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made_once(tmp_path_factory, "figures", lambda base: draw(base / "new")) / "new"


def draw(path: Path) -> None:
    """Draw the figures with the command."""
    result = CliRunner().invoke(main, ["figures", "-o", str(path)])
    assert result.exit_code == 0, result.output
    assert set(result.stdout.splitlines()) == {str(p) for p in path.iterdir()}


def numbers(folder: Path, number: int) -> dict[str, NDArray[np.float64]]:
    return {
        name: np.array([float(cell or "nan") for cell in column])
        for name, column in columns(folder, number).items()
        if name not in ("specimen", "fitted_on", "parameter")
    }


def columns(folder: Path, number: int) -> dict[str, list[str]]:
    with (folder / f"fig{number:02}.csv").open(newline="") as file:
        head, *rows = list(csv.reader(file))
    return dict(zip(head, map(list, zip(*rows, strict=True)), strict=True))


@pytest.mark.parametrize("number", figures.FIGURES)
def test_each_is_a_vector_and_a_picture_that_say_what_they_are(folder: Path, number: int) -> None:
    assert (folder / f"fig{number:02}.pdf").read_bytes().startswith(b"%PDF")
    png = (folder / f"fig{number:02}.png").read_bytes()
    width, height = (int.from_bytes(png[at : at + 4], "big") for at in (16, 20))
    size = figures.FIGURES[number].size_in
    assert (width, height) == (round(size[0] * 300), round(size[1] * 300))
    assert b"Simulated data (palpate.simulation, seed 0), not a measurement." in png
    assert f"Fig. {number}. " in (folder / "captions.md").read_text()


@pytest.mark.parametrize("number", [6, 7, 9])
def test_no_estimate_is_hidden_under_the_truth(number: int) -> None:
    drawing = drawings.FIGURES[number]
    with figure_style.sheet(*drawing.size_in) as figure:
        drawing.draw(figure, drawing.data(0))
        panels = [ax for each in figure.axes for ax in (each, *each.child_axes)]
        compared = 0
        for ax in panels:
            truths = [line for line in ax.lines if line.get_label() == "truth"]
            estimates = [line for line in ax.lines if line.get_color() in ESTIMATES]
            compared += len(truths) * len(estimates)
            assert all(truth.get_zorder() < other.get_zorder() for truth in truths for other in estimates)
            assert all(truth.get_linewidth() > 2 * other.get_linewidth() for truth in truths for other in estimates)
    assert compared >= 2


def luminance(colour: str) -> float:
    """Return the relative luminance of "#rrggbb" (WCAG 2.2)."""
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("name", ["HARD", "SOFT", "PAPER", "HANDHELD", "SLOW", "FAST"])
def test_lines_are_seen_on_white_paper(name: str) -> None:
    least = 3.0 if name != "FAST" else 2.9  # of Okabe and Ito, the lightest that is used
    assert 1.05 / (luminance(getattr(figure_style, name)) + 0.05) >= least


def test_the_tremor_is_stated_and_the_same_in_all_figures_of_touches() -> None:
    for number in (6, 7, 9):
        assert f"Tremor {100 * TREMOR:g} % of the press" in drawings.caption(number, 0)
    # That of a run is seen in its readings: rms of the soft channel while it is pressed, without the noise of 5e-5 pF.
    pressed = [(t.soft[200:400], 0.25) for t in drawings.FIGURES[6].data(0).values()]
    pressed += [(drawings.FIGURES[7].data(0).soft[200:400], 0.25), (drawings.FIGURES[9].data(0).soft[120:320], 0.2)]
    shares = [np.std(soft) / depth for soft, depth in pressed]
    assert shares == pytest.approx([shares[0]] * 4, rel=0.25)


def touches(contact: NDArray[np.float64]) -> list[NDArray[np.intp]]:
    """Row numbers of each stretch that is not nan."""
    rows = np.flatnonzero(np.isfinite(contact))
    return np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)


@pytest.mark.parametrize(("number", "names"), [(6, PAIR), (7, (ONE,)), (9, FOUR)])
def test_settled_ratios_are_within_1_percent_of_the_truth(folder: Path, number: int, names: tuple[str, ...]) -> None:
    data = numbers(folder, number)
    for name in ("ratio_0.995", "ratio_0.9", "ratio_adaptive", "ratio_handheld"):
        stretches = touches(data["ratio_handheld" if name == "ratio_handheld" else "alarm_signal_pF"])
        assert len(stretches) == len(names)
        for rows, specimen in zip(stretches, names, strict=True):
            assert 240 <= len(rows) <= 251
            true = PROBE.ratio(SORBOTHANE_MPA[specimen])
            # The steady estimator forgets its beginning at 1 within 2 / (1 - 0.995) = 400 samples: it is judged at the end.
            settled = rows[-1:] if name == "ratio_0.995" else rows[SETTLED:]
            assert data[name][settled] == pytest.approx(true, rel=0.01)
            assert data["truth"][settled] == pytest.approx(true)


@pytest.mark.parametrize("number", [6, 7, 9])
def test_the_ratio_of_the_paper_is_1_outside_touches(folder: Path, number: int) -> None:
    data = numbers(folder, number)
    outside = np.isnan(data["alarm_signal_pF"])
    assert 0.1 < outside.mean() < 0.6
    for name in ("ratio_0.995", "ratio_0.9", "ratio_adaptive"):
        assert (data[name][outside] == 1).all()
        assert (data[name][~outside] != 1).all()
    assert not data["alarm_adaptive"][outside].any()


@pytest.mark.parametrize("specimen", PAIR)
def test_fig_6_a_smaller_forgetting_factor_is_faster_and_less_steady(folder: Path, specimen: str) -> None:
    mine = np.array(columns(folder, 6)["specimen"]) == specimen
    data = {name: column[mine] for name, column in numbers(folder, 6).items()}
    error = {name: data[name] / data["truth"] - 1 for name in ("ratio_0.995", "ratio_0.9", "ratio_handheld")}
    [rows] = touches(data["alarm_signal_pF"])
    assert 145 <= rows[0] <= 155  # contact at about the 150th sample
    first, last = rows[30:40], rows[-100:]
    assert np.abs(error["ratio_0.9"][first]).mean() < np.abs(error["ratio_0.995"][first]).mean()
    assert np.ptp(error["ratio_0.9"][last]) > 2 * np.ptp(error["ratio_0.995"][last])
    assert np.abs(error["ratio_handheld"][last]).max() < 0.1 * np.abs(error["ratio_0.9"][last]).max()


def test_fig_7_the_alarm_comes_with_contact_and_goes(folder: Path) -> None:
    data = numbers(folder, 7)
    rows = touches(data["alarm_signal_pF"])[0]
    alarm = data["alarm_signal_pF"][rows]
    assert 0 <= rows[np.flatnonzero(alarm > 0.05)[0]] - rows[0] < 15
    assert (alarm[100:] < 0.05).all()
    on = rows[np.flatnonzero(data["alarm_adaptive"][rows])]
    assert (np.diff(on) == 1).all()
    assert (data["alarm_signal_pF"][on[-5:]] < 0.05).all()  # still on below the threshold
    assert data["alarm_signal_pF"][on[-1] + 1] == 0  # and cleared at 0
    last = rows[-100:]
    spread = {name: np.ptp(data[name][last]) for name in ("ratio_0.9", "ratio_adaptive")}
    assert spread["ratio_adaptive"] < 0.5 * spread["ratio_0.9"]


def test_fig_9_harder_gives_a_higher_ratio_and_a_larger_alarm(folder: Path) -> None:
    data = numbers(folder, 9)
    stretches = touches(data["alarm_signal_pF"])
    for name, reduce in (
        ("ratio_adaptive", lambda a: a[-1]),
        ("alarm_signal_pF", max),
        ("ratio_handheld", np.nanmedian),
    ):
        found = [float(reduce(data[name][rows])) for rows in stretches]
        assert all(b > a for a, b in pairwise(found)), name


def test_fig_10_has_every_touch(folder: Path) -> None:
    data, names = numbers(folder, 10), columns(folder, 10)["specimen"]
    assert len(names) == 40
    assert set(names) == set(SORBOTHANE_MPA)
    for name in ("ratio_paper", "ratio_handheld"):
        assert np.std(data[name] / data["true_ratio"]) == pytest.approx(0.03, rel=0.4)  # the hand's obliqueness
    # Both see the same contact, oblique or not: what is left between them is the estimators' own.
    assert data["ratio_paper"] == pytest.approx(data["ratio_handheld"], rel=0.01)


def test_fig_11_the_chosen_touches_rise(folder: Path) -> None:
    data = numbers(folder, 11)
    assert (np.diff(data["modulus_MPa"]) > 0).all()
    for name in ("smallest_P_paper", "smallest_standard_error_handheld"):
        assert (np.diff(data[name]) > 0).all(), name
        assert data[name] == pytest.approx(data["true_ratio"], rel=0.1)


def test_fig_12_the_truth_lies_in_the_intervals(folder: Path) -> None:
    data = numbers(folder, 12)
    assert columns(folder, 12)["parameter"] == ["rigid_ratio", "half_modulus"] * 2
    assert ((data["low_95"] < data["truth"]) & (data["truth"] < data["high_95"])).all()
    assert ((data["low_95"] < data["value"]) & (data["value"] < data["high_95"])).all()
    assert data["truth"].tolist() == [PROBE.rigid_ratio, PROBE.half_modulus] * 2


def test_another_seed_is_another_figure(folder: Path) -> None:
    assert "seed 1" in drawings.caption(12, 1)
    drawing = figures.FIGURES[12]
    assert drawing.columns(drawing.data(1))["value"][0] != numbers(folder, 12)["value"][0]


def test_the_same_seed_gives_the_same_bytes(tmp_path: Path, folder: Path) -> None:
    figures.draw(tmp_path)
    for path in folder.iterdir():
        assert path.read_bytes() == (tmp_path / path.name).read_bytes(), path.name


def test_columns_are_of_one_length(tmp_path: Path) -> None:
    from palpate.figure_style import write_csv

    path = write_csv(tmp_path / "x.csv", {"a": [1.5, math.nan], "b": [True, False], "c": [3, 4]})
    assert path.read_text() == "a,b,c\n1.5,1,3\n,0,4\n"
    with pytest.raises(ValueError, match="zip"):
        write_csv(tmp_path / "y.csv", {"a": [1.0], "b": [1.0, 2.0]})
