"""What a prompt and a notebook show: short, escaped, nothing from elsewhere, no more digits than are known."""

import re
from datetime import timedelta
from html.parser import HTMLParser
from typing import Any

import numpy as np
import palpate
import pytest
from hypothesis import given
from hypothesis import strategies as st
from palpate.display import cards, drawings, markup
from palpate.display.text import ratio
from palpate.recording.recording import Mark, Recording
from palpate.simulation import scenarios

CALIBRATION = palpate.Calibration.fit([2.0, 3.0, 4.0, 5.0], [0.18, 0.46, 1.0, 2.5])
EVIL = "<script>alert(1)</script><img src=x onerror=alert(1)>\"'&"


class Seen(HTMLParser):
    """Tags, attributes and texts; each tag has to be closed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.open: list[str] = []
        self.attributes: list[tuple[str, str]] = []
        self.text = ""
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note it."""
        self.tags.append(tag)
        self.open.append(tag)
        self.attributes += [(name, value or "") for name, value in attrs]

    def handle_endtag(self, tag: str) -> None:
        """Check that it closes the last one."""
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        """Note it."""
        self.text += data


def recording(**more: Any) -> Recording:
    run = scenarios.run("four-specimens", 1)
    return Recording(run.t_hard_s, run.t_soft_s, run.hard, run.soft, **more)


def shown() -> dict[str, Any]:
    """Return one object of each kind."""
    found = recording().touches()
    tracker = palpate.Tracker()
    with palpate.Stream("sim:stiff-steady?seed=1") as stream:
        for _ in stream:
            pass
    estimator = palpate.HandoverRls()
    estimator.process(np.linspace(0.02, 0.6, 300), np.linspace(0.01, 0.3, 300))
    kinds = ("Rls", "Rls32", "AdaptiveRls", "AdaptiveRls32", "HandoverRls", "HandoverRls32")
    return {
        "touch": found[0],
        "touches": found,
        "no touches": type(found)(),
        "flagged": palpate.touches(scenarios.run("not-level")),
        "recording": recording(),
        "marked": recording(marks=(Mark(2.0, EVIL),), notes=(EVIL,), doubts=(EVIL,), understood=EVIL, gap_rows=(9,)),
        "no times": Recording(*np.full((2, 5), np.nan), *np.ones((2, 5))),
        "nothing": Recording(*np.zeros((4, 0))),
        "no readings": Recording(np.arange(5.0), np.arange(5.0), *np.full((2, 5), np.nan)),
        "calibration": CALIBRATION,
        "stream": stream,
        "tracker": tracker,
        "estimator": estimator,
        **{kind: getattr(palpate, kind)() for kind in kinds},
    }


SHOWN = shown()


@pytest.mark.parametrize("name", SHOWN)
def test_the_html_is_whole_and_needs_nothing(name: str) -> None:
    html = SHOWN[name]._repr_html_()
    seen = Seen(html)
    assert set(seen.tags) <= {
        "div", "strong", "small", "table", "thead", "tbody", "tr", "th", "td", "svg", "path", "circle", "details", "summary",
    }  # fmt: skip
    assert not {name for name, _ in seen.attributes} & {"src", "href", "onclick", "onerror", "id", "class"}
    assert "http" not in html.replace('xmlns="http://www.w3.org/2000/svg"', "")
    assert "nan" not in seen.text + "".join(value for _, value in seen.attributes)
    assert len(html) < 20_000


@pytest.mark.parametrize("name", SHOWN)
def test_the_repr_is_short(name: str) -> None:
    lines = repr(SHOWN[name]).splitlines()
    assert len(lines) <= 4
    assert max(map(len, lines)) < 130


def test_text_of_a_file_is_escaped() -> None:
    html = SHOWN["marked"]._repr_html_()
    assert "<script" not in html
    assert "<img" not in html
    assert Seen(html).text.count(EVIL) == 4


@given(st.text(), st.text())
def test_any_text_is_text_again(child: str, attribute: str) -> None:
    seen = Seen(markup.element("p", child, title=attribute).replace("\r", ""))
    assert seen.text == child.replace("\r", "")
    assert ("title", attribute.replace("\r", "")) in seen.attributes


def test_a_flag_has_its_sentence() -> None:
    html = SHOWN["flagged"]._repr_html_()
    assert "hold the probe upright" in html
    assert "hold the probe upright" in SHOWN["flagged"][0]._repr_html_()
    assert repr(SHOWN["flagged"][0]).endswith(", 250 samples, flags offset>")


def test_digits_are_those_of_the_standard_error() -> None:
    touch = SHOWN["touch"]
    wanted = ratio(touch.ratio, touch.standard_error)
    assert re.fullmatch(r"\d\.\d{6} ± 0\.0000\d\d", wanted)
    assert wanted in repr(touch)
    assert wanted in touch._repr_html_()
    assert wanted in SHOWN["touches"]._repr_html_()
    assert repr(touch) == f"<Touch at {touch.start_s:.3f} s: ratio {wanted}, {touch.samples} samples>"


def test_a_bar_is_two_standard_errors_to_each_side() -> None:
    low, high = drawings.span([(2.0, 0.5), (4.0, 0.25)])
    assert (low, high) == (1.0, 4.5)
    whole, half = drawings.interval(2.75, 0.875, (low, high)), drawings.interval(1.5, 0.25, (low, high))
    assert re.findall(r"[ML]([\d.]+) ", whole) == ["4.0", "136.0"]
    assert re.findall(r"[ML]([\d.]+) ", half) == ["4.0", "41.7"]
    assert "path" not in drawings.interval(float("nan"), 1.0, (low, high))


def test_a_missing_reading_is_a_hole_in_the_line() -> None:
    values = np.array([0.0, 1.0, np.nan, 1.0, 0.0])
    drawn = drawings.channels(np.arange(5.0), values, np.zeros(5))
    assert [path.count("M") for path in re.findall(' d="(.*?)"', drawn)] == [2, 1]


def test_long_lists_are_cut_and_say_so() -> None:
    many = type(SHOWN["touches"])(SHOWN["touches"] * 500)
    assert len(repr(many).splitlines()) == 21
    assert "1,980 touches more" in repr(many)
    assert "1,950 more" in many._repr_html_()
    assert len(many._repr_html_()) < 60_000


def test_a_long_recording_costs_no_more_to_show() -> None:
    n = 1_000_000
    t = np.linspace(0, 9999.99, n, dtype=np.float64)
    long = Recording(t, t, np.sin(t), np.cos(t))
    assert len(long._repr_html_()) < 20_000
    assert repr(long) == "<Recording: 2:46:39, 1,000,000 pairs>"
    assert long.duration == timedelta(seconds=9999.99)


def contrast(first: str, second: str) -> float:
    """Return the contrast of two colours, from 1 to 21 (WCAG 2.2)."""
    light = []
    for colour in (first, second):
        parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
        linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
        light.append(sum(weight * c for weight, c in zip((0.2126, 0.7152, 0.0722), linear, strict=True)))
    return (max(light) + 0.05) / (min(light) + 0.05)


@pytest.mark.parametrize("paper", ["#ffffff", "#111111", "#1f1f1f"])
def test_colours_can_be_seen_on_light_and_dark_paper(paper: str) -> None:
    """3 is the least for graphics; all other lines and texts have the colour of the text around them."""
    assert min(contrast(colour, paper) for colour in (markup.ACCENT, markup.WARNING)) >= 3
    html = "".join(one._repr_html_() for one in SHOWN.values())
    assert set(re.findall(r"#[0-9a-fA-F]{6}", html)) <= {markup.ACCENT, markup.WARNING}


def test_a_class_of_your_own_shows_itself() -> None:
    class Mine(palpate.AdaptiveRls):
        def __init__(self, name: str) -> None:
            super().__init__(steady=0.99)

    assert repr(Mine("x")) == "<Mine(steady=0.99): ratio 1.00, 0 samples>"
    assert "steady = 0.99" in cards.estimator(Mine("x"))


def test_a_tracker_shows_the_running_ratio_in_contact_only() -> None:
    run = scenarios.run("stiff-steady")
    tracker = palpate.Tracker()
    assert repr(tracker) == "<Tracker('handheld'): baseline, 0 touches>"
    tracker.process(*(column[:200] for column in (run.t_hard_s, run.t_soft_s, run.hard, run.soft)))
    assert (
        repr(tracker)
        == f"<Tracker('handheld'): contact, ratio {ratio(tracker.ratio, tracker.standard_error)}, 0 touches>"
    )
    assert repr(tracker) != repr(palpate.Tracker())
