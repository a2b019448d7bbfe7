"""Explain: one touch as a story, with its pins and its numbers."""

from collections.abc import Callable

import numpy as np
import page_looks
import pytest
from live_browser import SIZES, Browser
from page_data import RATE, State, state
from page_states import Canned, opened
from palpate import number_format
from palpate.live.page_frames import ROW, RowFlag
from selenium.webdriver.common.keys import Keys

Shown = Callable[..., Canned]
LIT = "return [...document.querySelectorAll('#explain [aria-current=true]')].map((e) => e.dataset.pin)"
DRAWN = "return document.querySelector('#storyplot svg').textContent"


def facts(page: Browser) -> dict[str, str]:
    """Return the numbers of the touch."""
    lines = page.text("storyfacts").splitlines()
    return dict(zip(lines[::2], lines[1::2], strict=True))


def test_a_touch_of_a_file_is_a_story(page: Browser, shown: Shown) -> None:
    """Each flag once, as a pin with its sentence; the numbers are those of its rows."""
    server = shown("file", depth="explain")
    page.run("palpate.charts.choose(12)")
    page.until(lambda: page.text("storytitle") == "Touch 12 · 30 A")
    touch = server.state.told["touches"]["rows"][11]
    result = number_format.plus_minus(touch["ratio"], touch["uncertainty"])
    assert page.text("storyresult").startswith("left out: 0.")
    assert page.text("storyresult").endswith(f"ratio {result}")
    page.until(lambda: page.all(".pin"))
    assert [pin.text for pin in page.all(".pin")] == ["1", "2"]
    sentences = [one.text for one in page.all("#pins button")]
    assert sentences[0] == "wiped the bumps"
    assert sentences[1] == touch["advice"][0]
    assert page.run("return document.body.innerText").count("the soft bump is reached") == 1
    for begin, end in (("#pins button", ".pin"), (".pin", "#pins button")):
        for number in (1, 0):
            page.run("document.querySelectorAll(arguments[0])[arguments[1]].focus()", begin, number)
            assert page.run(LIT) == [str(number)] * 2, (begin, end)
    rows = server.state.rows
    inside = rows[(rows["t_s"] >= touch["start_s"]) & (rows["t_s"] <= touch["end_s"])]
    words = facts(page)
    for name in ("hard", "soft"):
        assert (
            f"{name} to {number_format.number(float(inside[name].max()))} pF" in words["Channels"]
        )
    idle = rows[(rows["t_s"] >= touch["start_s"] - 1.5) & (rows["t_s"] < touch["start_s"] - 0.3)]
    noise = [f"{1e6 * np.std(idle[name], ddof=1):.0f} aF" for name in ("hard", "soft")]
    assert f"hard {noise[0]}, soft {noise[1]}" in words["Baseline"]
    assert "the last tare was" in words["Baseline"]
    error = number_format.error(touch["standard_error"])
    assert words["Noise of the estimate"].startswith(f"{error} (k = 1)")
    highest = number_format.number(float(np.nanmax(inside["statistic"])))
    assert words["Detector"].startswith(f"CUSUM at most {highest} at ")
    assert "the ratio did not change" in words["Detector"]
    assert words["Samples"].startswith("250 pairs in 6.5 s")


def test_arrows_go_to_the_touch_before_and_after(page: Browser, shown: Shown) -> None:
    """By keys and by buttons; the running touch grows, and has no result yet."""
    server = shown("contact", depth="explain")
    assert page.text("storytitle") == "Touch 20 · 30 OO · running"
    assert (page.text("pinshead"), page.text("storyresult")) == ("Nothing was noticed so far", "")
    assert not page["storyafter"].is_enabled()
    page.press(Keys.ARROW_LEFT)
    page.until(lambda: page.text("storytitle") == "Touch 19 · 30 OO")
    page["storybefore"].click()
    page.until(lambda: page.text("storytitle") == "Touch 18 · 50 OO")
    page.press(Keys.ARROW_RIGHT, Keys.ARROW_RIGHT)
    page.until(lambda: page.text("storytitle") == "Touch 20 · 30 OO · running")
    before = page.run("return palpate.charts.story().curve.length")
    more = np.zeros(20, ROW)
    more["t_s"] = server.state.rows["t_s"][-1] + np.arange(1, 21) / RATE
    more["hard"], more["soft"], more["ratio"], more["standard_error"] = 0.4, 0.25, 1.6, 0.01
    more["flags"] = RowFlag.CONTACT | RowFlag.MEASURED
    server.send(more)
    page.until(lambda: page.run("return palpate.charts.story().curve.length") == before + 20)
    page.press("3")
    page.until(lambda: not page["storytitle"].is_displayed())
    page.press(Keys.ARROW_LEFT)  # in the Lab it moves the window
    assert page.run("return palpate.known.chosen") is None


def test_what_is_beyond_a_scale_is_cut_with_an_arrow(page: Browser) -> None:
    """In both charts of a touch: its furthest value stands at the edge; nothing is drawn flat there."""
    far = state("file")
    touch = far.told["touches"]["rows"][7]
    begin = touch["start_s"]
    low = (far.rows["t_s"] > begin + 2) & (far.rows["t_s"] < begin + 3)
    far.rows["ratio"][low] = 0.77 * touch["ratio"]
    with Canned(State(far.rows, far.told)) as server:
        opened(page, server, "file")
        for depth, chart in (("3", "touchplot"), ("2", "storyplot")):
            page.press(depth)
            page.run("palpate.charts.choose(8)")
            text = f"return document.querySelector('#{chart} svg')?.textContent ?? ''"
            page.until(lambda text=text: "↓ \N{MINUS SIGN}23 %" in page.run(text))
            assert page.run(f"return palpate.charts.{chart}.shown.touch.number") == 8
        span = "const box = document.querySelector('#storyplot svg path[stroke=\"var(--ratio)\"]').getBBox(); return box.height"
        assert page.run(span) > 200  # it goes on out of sight


def test_a_gap_in_a_touch_is_not_joined(page: Browser) -> None:
    whole = state("file")
    begin = whole.told["touches"]["rows"][7]["start_s"]
    rows = whole.rows[(whole.rows["t_s"] < begin + 2) | (whole.rows["t_s"] > begin + 3)]
    with Canned(State(rows, whole.told)) as server:
        opened(page, server, "file", depth="explain")
        for touch, pieces in ((8, 2), (7, 1)):
            page.run("palpate.charts.choose(arguments[0])", touch)
            page.until(lambda touch=touch: page.text("storytitle").startswith(f"Touch {touch} "))
            page.drawn()
            for name in ("hard", "soft"):
                drawn = page.all(f"#storyplot path[stroke='var(--{name})']")
                assert len(drawn) == pieces, (touch, name)


def test_a_recording_whose_rows_are_not_here(page: Browser) -> None:
    whole = state("file")
    with Canned(State(whole.rows[-2000:], whole.told), whole.rows) as server:
        opened(page, server, "file", depth="explain")
        page.run("palpate.charts.choose(2)")
        page.until(lambda: "250 pairs" in page.text("storyfacts"))
        touch = whole.told["touches"]["rows"][1]
        around = [touch["start_s"] - 1.5, touch["end_s"] + 1.5]
        views = [[one["from_s"], one["to_s"]] for one in server.asked("view")]
        assert [view for view in views if view == pytest.approx(around)] == [around]
        assert page.run(DRAWN).count("Capacitance change") == 1


@pytest.mark.parametrize("size", [size for size in SIZES if size != "tablet"])
def test_looks(page: Browser, shown: Shown, size: str) -> None:
    for name, touch, theme in (("file", 12, "dark"), ("contact", None, "light")):
        shown(name, size, theme, "explain")
        page.run("palpate.charts.choose(arguments[0])", touch)
        page.drawn()
        checks = page_looks.CHECKS
        if size in ("phone", "lying", "small"):
            checks = checks | {"small": page_looks.SMALL}
        found = {what: wrong for what, script in checks.items() if (wrong := page.run(script))}
        assert found == {}, name
        assert page_looks.audit(page.driver) == []
        page.driver.get("about:blank")


def test_no_touch_yet(page: Browser, shown: Shown) -> None:
    shown("bare", depth="explain")
    assert page.text("storytitle") == "No touch yet"
    assert "Press the probe on an object" in page.text("storyplot")
