"""What a prompt and a notebook show: short, escaped, nothing from elsewhere, no more digits than are known; and the example notebook."""

import asyncio
import re
from pathlib import Path
from typing import Any

import nbclient
import nbformat
import numpy as np
import palpate
import pytest
from bs4 import BeautifulSoup
from hypothesis import given
from hypothesis import strategies as st
from palpate.display import cards, markup
from palpate.recording.recording import Mark, Recording
from palpate.simulation import scenarios
from project import ROOT
from recording_bench import measured

CALIBRATION = palpate.Calibration.fit([2.0, 3.0, 4.0, 5.0], [0.18, 0.46, 1.0, 2.5])
EVIL = "<script>alert(1)</script><img src=x onerror=alert(1)>\"'&"


def recording(**more: Any) -> Recording:
    run = scenarios.run("four-specimens", 1)
    return Recording(run.t_hard_s, run.t_soft_s, run.hard, run.soft, **more)


def shown() -> dict[str, Any]:
    """Return one object of each kind."""
    found = recording().touches()
    stream = measured("sim:stiff-steady?seed=1")
    estimator = palpate.HandoverRls()
    estimator.process(np.linspace(0.02, 0.6, 300), np.linspace(0.01, 0.3, 300))
    return {
        "touch": found[0],
        "touches": found,
        "no touches": type(found)(),
        "flagged": palpate.touches(scenarios.run("not-level")),
        "recording": recording(),
        "marked": recording(
            marks=(Mark(2.0, EVIL),), notes=(EVIL,), doubts=(EVIL,), understood=EVIL, gap_rows=(9,)
        ),
        "no times": Recording(*np.full((2, 5), np.nan), *np.ones((2, 5))),
        "nothing": Recording(*np.zeros((4, 0))),
        "no readings": Recording(np.arange(5.0), np.arange(5.0), *np.full((2, 5), np.nan)),
        "calibration": CALIBRATION,
        "stream": stream,
        "tracker": palpate.Tracker(),
        "estimator": estimator,
        "estimator with floats": palpate.AdaptiveRls32(),
    }


SHOWN = shown()


@pytest.mark.parametrize("name", SHOWN)
def test_the_html_is_whole_and_needs_nothing_and_the_repr_is_short(name: str) -> None:
    html = SHOWN[name]._repr_html_()
    seen = BeautifulSoup(html, "html.parser")
    assert html.count("<") == 2 * html.count("</")  # each tag is closed
    tags = seen.find_all(True)
    assert {tag.name for tag in tags} <= {
        "div", "strong", "small", "table", "thead", "tbody", "tr", "th", "td", "details", "summary",
        "svg", "path", "circle", "line", "polygon", "text",
    }  # fmt: skip
    assert not {name for tag in tags for name in tag.attrs} & {
        "src",
        "href",
        "onclick",
        "onerror",
        "id",
        "class",
    }
    assert "http" not in html
    assert "nan" not in seen.text + "".join(
        str(value) for tag in tags for value in tag.attrs.values()
    )
    assert set(re.findall(r"#[0-9a-fA-F]{6}", html)) <= {markup.ACCENT, markup.WARNING}
    assert len(html) < 20_000
    assert seen.text.count(EVIL) == (4 if name == "marked" else 0)
    lines = repr(SHOWN[name]).splitlines()
    assert len(lines) <= 4
    assert max(map(len, lines)) < 130


@given(st.text(), st.text())
def test_any_text_is_text_again(child: str, attribute: str) -> None:
    seen = BeautifulSoup(
        markup.element("p", child, title=attribute).replace("\r", ""), "html.parser"
    ).p
    assert seen
    assert seen.text == child.replace("\r", "")
    assert seen["title"] == attribute.replace("\r", "")


def test_a_flag_has_its_sentence() -> None:
    assert "hold the probe upright" in SHOWN["flagged"]._repr_html_()
    assert repr(SHOWN["flagged"][0]).endswith(", 250 samples, flags offset>")


def test_digits_are_those_of_the_uncertainty() -> None:
    touch = SHOWN["touch"]
    wanted = str(palpate.Uncertainty.of(touch))
    assert re.fullmatch(r"\d\.\d{3} ± 0\.0\d\d \(assumed\)", wanted)
    assert all(wanted in shown._repr_html_() for shown in (touch, SHOWN["touches"]))
    assert (
        repr(touch) == f"<Touch at {touch.start_s:.3f} s: ratio {wanted}, {touch.samples} samples>"
    )


def test_a_bar_is_two_uncertainties_to_each_side() -> None:
    html = SHOWN["touches"]._repr_html_()
    known = [palpate.Uncertainty.of(touch) for touch in SHOWN["touches"]]
    ends = [one.ratio + side * one.uncertainty for one in known for side in (-2, 2)]
    assert (
        f"95 % interval (k = 2), {' to '.join(map(palpate.number_format.number, markup.span(ends)))}"
        in html
    )
    bars = [
        cards.interval_drawing(bar, (1.0, 4.5))
        for bar in ((1.0, 4.5), (1.0, 2.0), (float("nan"), 1.0))
    ]
    assert [re.findall(r"[ML]([\d.]+) ", bar) for bar in bars] == [
        ["4.0", "136.0"],
        ["4.0", "41.7"],
        [],
    ]


def test_what_is_long_is_cut_and_says_so() -> None:
    many = type(SHOWN["touches"])(SHOWN["touches"] * 500)
    assert len(repr(many).splitlines()) == 21
    assert "1,980 touches more" in repr(many)
    assert "1,950 more" in many._repr_html_()
    t = np.linspace(0, 9999.99, 1_000_000)
    long = Recording(t, t, np.sin(t), np.cos(t))
    assert len(long._repr_html_()) < 20_000
    assert repr(long) == "<Recording: 2:46:39, 1,000,000 pairs>"


def test_a_class_of_your_own_shows_itself() -> None:
    mine = type("Mine", (palpate.AdaptiveRls,), {})(steady=0.99)
    assert repr(mine) == "<Mine(steady=0.99): ratio 1.00, 0 samples>"
    assert "steady = 0.99" in mine._repr_html_()


NOTEBOOK = ROOT / "docs" / "examples" / "notebook.ipynb"
HTML = {
    "stream": "Stream of",
    "recording": "<strong>Recording</strong>",
    "touches": "<strong>4 touches</strong>",
    "touches[0]": "<strong>Touch</strong>",
    'palpate.touches(scenarios.run("not-level"))': "hold the probe upright",
    "calibration": "<strong>Calibration</strong>",
    "estimator": "<strong>HandoverRls</strong>",
}
"""The last line of a cell, and what is in its HTML."""
MODULI = "[str(calibration.modulus(touch.ratio, touch.standard_error)) for touch in touches]"
DRAWN = [
    "recording.plot();",
    "recording[9.5:19.0].plot();",
    "touches.plot();",
    "calibration.plot();",
]


def test_each_object_shows_itself_and_each_plot_is_a_picture(tmp_path: Path) -> None:
    document = nbformat.read(NOTEBOOK, as_version=4)
    assert not any(cell.get("outputs") for cell in document.cells)
    assert NOTEBOOK.stat().st_size < 20_000
    client = nbclient.NotebookClient(
        document, timeout=300, resources={"metadata": {"path": str(tmp_path)}}
    )
    with asyncio.Runner() as runner:
        runner.run(client.async_execute())
    outputs = {
        cell.source.splitlines()[-1]: cell.outputs[-1]
        for cell in document.cells
        if cell.get("outputs")
    }
    for line, part in HTML.items():
        assert part in outputs[line].data["text/html"], line
    for line in DRAWN:
        assert outputs[line].output_type == "display_data"
        assert len(outputs[line].data["image/png"]) > 10_000
    assert outputs[MODULI].data["text/plain"].count("MPa") == 4
