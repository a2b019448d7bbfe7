"""Figures: axes in, axes out; nothing is shown, nothing of matplotlib changes."""

import sys
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import palpate
import pytest
from click.testing import CliRunner, Result
from matplotlib import pyplot
from palpate.cli import main
from palpate.recording.recording import Mark, Recording
from palpate.simulation import scenarios
from project import ROOT

FOUR = ROOT / "tests" / "data" / "four-specimens.csv"


@pytest.fixture(autouse=True)
def no_window(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    def fail() -> None:
        raise AssertionError("shown")

    before = mpl.get_backend()
    pyplot.switch_backend("agg")
    monkeypatch.setattr(pyplot, "show", fail)
    yield
    pyplot.close("all")
    pyplot.switch_backend(before)


def drawable() -> dict[str, Any]:
    whole = palpate.read(FOUR)
    return {
        "recording": whole,
        "touches": whole.touches(),
        "flagged": palpate.touches(scenarios.run("not-level")),
        "no touches": type(whole.touches())(),
        "untimed": Recording(*np.full((2, 9), np.nan), *np.ones((2, 9))),
        "nothing": Recording(*np.zeros((4, 0))),
        "calibration": palpate.Calibration.fit([2.0, 3.0, 4.0, 5.0], [0.18, 0.46, 1.0, 2.5]),
    }


DRAWABLE = drawable()


@pytest.mark.parametrize("name", DRAWABLE)
def test_axes_in_axes_out(name: str) -> None:
    before = mpl.rcParams.copy()
    new = DRAWABLE[name].plot()
    assert pyplot.get_fignums() == [new.figure.number]
    _, given = pyplot.subplots()
    assert DRAWABLE[name].plot(given) is given
    assert len(pyplot.get_fignums()) == 2
    for ax in (new, given):
        assert ax.get_xlabel()
        assert ax.get_ylabel()
        ax.figure.canvas.draw()
    assert mpl.rcParams == before


def test_what_is_drawn_is_what_was_measured() -> None:
    whole = DRAWABLE["recording"]
    hard, soft = whole.plot().get_lines()
    for line, t, readings in ((hard, whole.t_hard_s, whole.hard), (soft, whole.t_soft_s, whole.soft)):
        assert np.array_equal(line.get_xdata(), t)
        assert np.allclose(line.get_ydata(), readings - np.median(readings[:20]), rtol=0, atol=1e-12)
    touches = DRAWABLE["touches"].plot()
    [container] = touches.containers
    assert container[0].get_xdata().tolist() == [touch.start_s for touch in DRAWABLE["touches"]]
    assert container[0].get_ydata().tolist() == [touch.ratio for touch in DRAWABLE["touches"]]
    assert [text.get_text() for text in DRAWABLE["flagged"].plot().texts] == ["offset"]


def test_marks_and_gaps_are_lines_and_a_mark_is_no_formula() -> None:
    t = np.arange(9.0)
    whole = Recording(t, t, t, t, marks=(Mark(2.0, r"$\frac{$"), Mark(float("nan"), "early")), gap_rows=(5,))
    ax = whole.plot()
    assert [line.get_xdata()[0] for line in ax.get_lines()[2:]] == [5.0, 2.0]
    ax.figure.canvas.draw()


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, ["plot", *map(str, arguments)])


@pytest.mark.parametrize("suffix", ["png", "pdf", "svg", "PNG"])
def test_a_file_of_each_kind(suffix: str, tmp_path: Path) -> None:
    out = tmp_path / f"run.{suffix}"
    result = run(FOUR, "-o", out)
    assert (result.exit_code, result.stdout) == (0, f"{out}: 4 touches\n")
    begin = {"png": b"\x89PNG", "pdf": b"%PDF", "svg": b"<?xml"}[suffix.lower()]
    assert out.read_bytes().startswith(begin)
    if suffix == "svg":
        assert ET.parse(out).getroot().tag.endswith("svg")


def test_nothing_is_replaced_without_force(tmp_path: Path) -> None:
    out = tmp_path / "run.png"
    out.write_text("precious")
    result = run(FOUR, "-o", out)
    assert (result.exit_code, out.read_text()) == (4, "precious")
    assert "already exists" in result.stderr
    assert run(FOUR, "-o", out, "--force").exit_code == 0
    assert out.read_bytes().startswith(b"\x89PNG")


def test_another_suffix_is_refused_before_anything_is_read(tmp_path: Path) -> None:
    result = run(FOUR, "-o", tmp_path / "run.gif")
    assert result.exit_code == 2
    assert "plot: got 'run.gif', allowed: a name that ends in .png, .pdf, .svg" in result.stderr
    assert not list(tmp_path.iterdir())


def test_without_matplotlib_nothing_is_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as without:
        without.setitem(sys.modules, "matplotlib", None)
        result = run(FOUR, "-o", tmp_path / "run.png")
    assert result.exit_code == 6
    assert "pip install 'palpate[science]'" in result.stderr
    assert not list(tmp_path.iterdir())


def test_a_table_of_another_program(tmp_path: Path) -> None:
    whole = palpate.read(FOUR)
    table = tmp_path / "other.csv"
    columns = np.column_stack([whole.t_hard_s, whole.hard, whole.soft])
    np.savetxt(table, columns, delimiter=",", header="time (s),A (pF),B (pF)", comments="")
    result = run(table, "-o", tmp_path / "other.png", "--map", "hard=A (pF),soft=B (pF)", "--scene", "paper", "--json")
    assert result.exit_code == 0, result.stderr
    assert '"touches": 4' in result.stdout
