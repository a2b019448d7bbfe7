"""Figures: axes in, axes out; nothing is shown, nothing of matplotlib changes."""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import palpate
import pytest
from command_lines import run
from matplotlib import pyplot
from palpate.recording.recording import Mark, Recording
from palpate.simulation import scenarios
from project import FOUR


@pytest.fixture(autouse=True)
def no_window() -> Iterator[None]:
    before = mpl.get_backend()
    pyplot.switch_backend("agg")
    pyplot.close("all")
    yield
    pyplot.close("all")
    pyplot.switch_backend(before)


WHOLE = palpate.read(FOUR)
DRAWABLE: dict[str, Any] = {
    "recording": WHOLE,
    "touches": WHOLE.touches(),
    "flagged": palpate.touches(scenarios.run("not-level")),
    "no touches": type(WHOLE.touches())(),
    "untimed": Recording(*np.full((2, 9), np.nan), *np.ones((2, 9))),
    "nothing": Recording(*np.zeros((4, 0))),
    "calibration": palpate.Calibration.fit([2.0, 3.0, 4.0, 5.0], [0.18, 0.46, 1.0, 2.5]),
}


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
    for line, t, readings in zip(
        WHOLE.plot().get_lines(),
        (WHOLE.t_hard_s, WHOLE.t_soft_s),
        (WHOLE.hard, WHOLE.soft),
        strict=True,
    ):
        assert np.array_equal(line.get_xdata(), t)
        assert np.allclose(
            line.get_ydata(), readings - np.median(readings[:20]), rtol=0, atol=1e-12
        )
    touches = DRAWABLE["touches"].plot()
    [container] = touches.containers
    assert container[0].get_xdata().tolist() == [touch.start_s for touch in DRAWABLE["touches"]]
    assert container[0].get_ydata().tolist() == [touch.ratio for touch in DRAWABLE["touches"]]
    assert [text.get_text() for text in DRAWABLE["flagged"].plot().texts] == ["offset"]


def test_marks_and_gaps_are_lines_and_a_mark_is_no_formula() -> None:
    t = np.arange(9.0)
    whole = Recording(
        t, t, t, t, marks=(Mark(2.0, r"$\frac{$"), Mark(float("nan"), "early")), gap_rows=(5,)
    )
    ax = whole.plot()
    assert [line.get_xdata()[0] for line in ax.get_lines()[2:]] == [5.0, 2.0]
    ax.figure.canvas.draw()


@pytest.mark.parametrize(
    ("name", "begin"), [("a.pdf", b"%PDF"), ("a.svg", b"<?xml"), ("a.PNG", b"\x89PNG")]
)
def test_a_file_of_each_kind(name: str, begin: bytes, tmp_path: Path) -> None:
    result = run("plot", FOUR, "-o", tmp_path / name)
    assert (result.exit_code, result.stdout) == (0, f"{tmp_path / name}: 4 touches\n")
    assert (tmp_path / name).read_bytes().startswith(begin)


def test_what_is_refused_leaves_everything_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = run("plot", FOUR, "-o", tmp_path / "run.gif")
    assert (result.exit_code, "ends in .png, .pdf, .svg" in result.stderr) == (2, True)
    with monkeypatch.context() as without:
        without.setitem(sys.modules, "matplotlib", None)
        assert run("plot", FOUR, "-o", tmp_path / "other.png").exit_code == 6
    assert list(tmp_path.iterdir()) == []
