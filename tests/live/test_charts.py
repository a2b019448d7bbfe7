"""The charts of the page: window, zoom, selection, cursors, labels, read-outs, and rows at the screen's resolution."""

import re
from collections.abc import Callable, Iterator
from itertools import combinations

import numpy as np
import pytest
from live_browser import Browser
from page_charts import drag, drawn, fire, look, settled, share_of, window
from page_data import GAP, ORIGIN_S, RATE, State, state
from page_states import Canned, opened
from palpate import number_format
from palpate.live.page_frames import ROW, RowFlag, Rows
from selenium.webdriver.common.keys import Keys

HOURS = 10.0


@pytest.fixture
def live(shown: Callable[..., Canned]) -> Canned:
    return shown("contact")


@pytest.fixture(scope="module")
def rows() -> Rows:
    """Return the rows of ten hours."""
    random = np.random.default_rng(3)
    t = np.arange(0, 3600 * HOURS, 1 / RATE)
    rows = np.zeros(len(t), ROW)
    rows["t_s"] = t + ORIGIN_S
    rows["hard"], rows["soft"] = random.normal(0, 0.0008, (2, len(t)))
    for name in ("ratio", "standard_error", "statistic"):
        rows[name] = np.nan
    return rows


@pytest.fixture
def recording(page: Browser, rows: Rows) -> Iterator[Canned]:
    """Serve a recording: the newest rows, and views of all."""
    file = state("file")
    file.told["state"]["end_s"] = float(rows["t_s"][-1])
    server = Canned(State(rows[-16384:], file.told), rows)
    with server:
        opened(page, server, "file")
        page.until(lambda: drawn(page)["overview"]["points"] > 0)
        yield server
        page.driver.get("about:blank")


def sent(page: Browser, live: Canned, count: int) -> float:
    """Send rows without a touch; return the time of the last one when the page has it."""
    more = np.zeros(count, ROW)
    more["t_s"] = live.state.rows["t_s"][-1] + np.arange(1, count + 1) / RATE
    for name in ("ratio", "standard_error", "statistic"):
        more[name] = np.nan
    live.send(more)
    page.until(lambda: drawn(page)["end"] == pytest.approx(more["t_s"][-1]))
    return float(more["t_s"][-1])


def test_the_window_follows_and_the_keys_change_it(page: Browser, live: Canned) -> None:
    """A pause keeps it while rows come."""
    end = live.state.told["state"]["end_s"] - ORIGIN_S
    steps = [("", 30, 0), ("+", 15, 0), (Keys.ARROW_LEFT, 18, 3), (Keys.ARROW_LEFT, 21, 6), (Keys.ARROW_RIGHT, 18, 3), ("-", 30, 0), ("0", end, 0), ("l", 30, 0)]  # fmt: skip
    for name, begin, until in steps:
        page.press(name)
        assert window(page) == pytest.approx((end - begin, end - until)), name
        assert (drawn(page)["back"] is not None) == (
            name in (Keys.ARROW_LEFT, Keys.ARROW_RIGHT, "-")
        ), name
    page.press(" ")
    before, last_s = window(page), sent(page, live, 100)
    assert window(page) == before
    page.press(" ")
    assert window(page)[1] == pytest.approx(last_s - ORIGIN_S)


def test_the_wheel_and_two_fingers_zoom_and_a_drag_pans(page: Browser, live: Canned) -> None:
    page.press(" ")
    moment = window(page)[1] - 20
    at = share_of(page, "detail", moment)
    fire(page, "detail", "wheel", at, deltaY=-200)
    begin, end = window(page)
    assert end - begin < 25
    # a wheel has whole pixels
    assert share_of(page, "detail", moment) == pytest.approx(at, abs=0.002)
    drag(page, "detail", 0.4, 0.6)
    moved = window(page)
    assert moved[1] - moved[0] == pytest.approx(end - begin)
    assert moved[0] < begin - 2
    drag(page, "detail", 0.3, 0.5, shiftKey=True)
    selected = window(page)
    assert moved[0] < selected[0] < selected[1] < moved[1]
    assert (selected[1] - selected[0]) / (moved[1] - moved[0]) == pytest.approx(0.2, abs=0.02)
    for kind, x, finger in (("down", 0.5, 1), ("down", 0.6, 2), ("move", 0.4, 1), ("move", 0.7, 2), ("up", 0.5, 1), ("up", 0.5, 2)):  # fmt: skip
        fire(page, "detail", f"pointer{kind}", x, pointerId=finger)
    assert np.ptp(window(page)) == pytest.approx(np.ptp(selected) / 3, rel=0.05)


def test_the_overview_moves_the_window(page: Browser, live: Canned) -> None:
    """It is dragged, or goes to what is clicked; a touch that is clicked is shown."""
    page.press(" ")
    begin, end = window(page)
    middle = share_of(page, "overview", (begin + end) / 2)
    drag(page, "overview", middle, middle - 0.2)
    moved = window(page)
    assert moved[1] - moved[0] == pytest.approx(end - begin)
    assert moved[0] == pytest.approx(begin - 0.2 * live.state.told["state"]["end_s"], abs=3)
    at = share_of(page, "overview", 8.0)  # in the first touch
    fire(page, "overview", "pointerdown", at)
    fire(page, "overview", "pointerup", at)
    assert window(page)[0] <= 8 <= window(page)[1]
    assert drawn(page)["touch"]["number"] == 1


def test_cursors_read_the_values_of_rows(page: Browser, live: Canned) -> None:
    rows = live.state.rows
    look(page, 31, 79)
    for which, (at, shift) in enumerate(((40.0, False), (70.0, True))):
        share = share_of(page, "detail", at)
        fire(page, "detail", "pointerdown", share, shiftKey=shift)
        fire(page, "detail", "pointerup", share, shiftKey=shift)
        found = drawn(page)["cursors"][which]
        assert found["t"] == pytest.approx(at + ORIGIN_S, abs=0.05)
        nearest = rows[np.argmin(np.abs(rows["t_s"] - found["t"]))]
        assert (found["hard"], found["soft"]) == (nearest["hard"], nearest["soft"])
    a, b = drawn(page)["cursors"]
    said = page.text("readout")
    assert f"{a['hard']:.4f} {b['hard']:.4f}".replace("-", "\N{MINUS SIGN}") in said
    assert re.search(rf"01:\d\d\.\d\d \+{b['t'] - a['t']:.2f} s", said)
    drag(page, "detail", share_of(page, "detail", a["t"] - ORIGIN_S), share_of(page, "detail", 50))
    assert drawn(page)["cursors"][0]["t"] == pytest.approx(50 + ORIGIN_S, abs=0.05)
    page.press(Keys.ESCAPE)
    page.until(lambda: not page["readout"].is_displayed())


def test_the_part_between_both_cursors_of_a_recording_is_estimated(page: Browser) -> None:
    with Canned(state("file")) as server:
        opened(page, server, "file")
        page.run(
            "palpate.charts.cursors.put(0, 130 + arguments[0]); palpate.charts.cursors.put(1, 120 + arguments[0])",
            ORIGIN_S,
        )
        page.until(lambda: "Done: cut." in page.text("readout"))
        [cut] = server.asked("cut")
        assert (cut["from_s"], cut["to_s"]) == (ORIGIN_S + 120, ORIGIN_S + 130)


@pytest.mark.parametrize("size", ["desk", "phone"])
def test_labels_are_whole_and_apart(page: Browser, size: str) -> None:
    crowded = state("contact")
    marks = [{"id": 50 + k, "t_s": ORIGIN_S + 100 + 0.4 * k, "text": f"{k}: {'a long text ' * (k % 5)}"} for k in range(20)]  # fmt: skip
    events = crowded.told["events"]
    events["marks"] = sorted([*events["marks"], *marks], key=lambda mark: mark["t_s"])
    page.size(size)
    with Canned(crowded) as server:
        opened(page, server, "contact")
        for begin, end in ((0, 197), (95, 115), (99, 101)):
            look(page, begin, end)
            now = drawn(page)
            for place in ("overview", "detail"):
                labels = now[place]["labels"]
                assert labels
                for one in labels:
                    assert 0 <= one["x"] <= now[place]["width"] - one["width"], one
                    assert (
                        one["height"] / 2 <= one["y"] <= now[place]["height"] - one["height"] / 2
                    ), one
                for one, other in combinations(labels, 2):
                    beside = (
                        one["x"] + one["width"] <= other["x"]
                        or other["x"] + other["width"] <= one["x"]
                    )
                    assert (
                        beside
                        or abs(one["y"] - other["y"])
                        >= (one["height"] + other["height"]) / 2 - 1e-6
                    )


def test_a_long_recording_is_drawn_with_few_points_and_few_requests(
    page: Browser, recording: Canned, rows: Rows
) -> None:
    """What is drawn is bounded by the pixels, not by the rows; a cursor reads a row; a new connection asks again."""
    assert window(page) == pytest.approx((0, 36000), abs=1)
    for span in (20.0, 7200.0):
        look(page, 15000, 15000 + span)
        settled(page)
        before, width = (
            len(recording.asked("view")),
            drawn(page)["detail"]["right"] - drawn(page)["detail"]["left"],
        )
        drag(page, "detail", 0.6, 0.3)
        settled(page)
        now = drawn(page)
        assert 0.5 * min(width, span * RATE) < now["detail"]["points"] <= 4 * width + 10
        assert now["overview"]["points"] <= now["overview"]["width"] + 2
        assert len(recording.asked("view")) - before <= 4
    asked = [(command["id"], command["rows"] <= 8192) for command in recording.asked("view")]
    assert len(dict(asked)) == len(asked)
    assert all(few for _, few in asked)
    fire(page, "detail", "pointermove", 0.5)
    assert re.search(
        r"hard -?\d\.\d{4} to \d\.\d{4} pF",
        page.run("return palpate.charts.detail.hover.tip.textContent"),
    )
    page.run("palpate.charts.cursors.put(0, arguments[0])", float(rows["t_s"][700_000]))
    page.until(lambda: drawn(page)["cursors"][0]["hard"] == rows["hard"][700_000])
    before = len(recording.asked("view"))
    recording.change(recording.state)  # a server that was started again
    page.until(
        lambda: len(recording.asked("view")) > before and drawn(page)["overview"]["points"] > 0
    )


def test_the_touch_chart_shows_the_running_or_the_chosen_touch_and_charts_have_names(
    page: Browser, live: Canned
) -> None:
    now = drawn(page)["touch"]
    assert (now["number"], now["scale"] in (0.2, 0.5, 1, 2, 5, 10)) == (20, True)
    assert page.text("touchtitle") == "Touch 20 · 30 OO · running"
    page.run("palpate.charts.choose(12)")
    page.until(lambda: drawn(page)["touch"]["number"] == 12)
    assert page.text("touchtitle") == "Touch 12 · 30 A"
    [pin] = page.all("#touchplot .pin")
    assert pin.get_attribute("title").startswith("offset: the soft bump is reached")
    # the whole uncertainty, as beside the ratio everywhere; the noise alone is the band
    touch = live.state.told["touches"]["rows"][11]
    percent = number_format.error(100 * touch["uncertainty"] / touch["ratio"])
    shown = page.run("return document.querySelector('#touchplot svg').textContent")
    assert shown.count("±") == 1
    assert f"± {percent} %" in shown
    names = page.run(
        "return [...document.querySelectorAll('.plot [role=img]')].map((e) => e.getAttribute('aria-label'))"
    )
    whole = "The whole measurement: 03:17, 19 touches (2 left out), 4 marks, 1 gap, 3 tares"
    for part in (whole, "Capacitance changes from 02:4"):
        assert any(part in name for name in names), names


def test_the_course_of_a_touch_whose_rows_are_not_here_is_asked_for(page: Browser) -> None:
    whole = state("contact")
    with Canned(State(whole.rows[-2000:], whole.told), whole.rows) as server:
        opened(page, server, "contact")
        page.run("palpate.charts.choose(2)")
        page.until(lambda: drawn(page)["touch"]["number"] == 2)


def test_no_number_of_a_touch_lies_on_the_frame_of_the_window(page: Browser, live: Canned) -> None:
    for begin, end in ((20, 60), (24, 51), (108, 118)):
        look(page, begin, end)
        frame = [
            share_of(page, "overview", t) * drawn(page)["overview"]["width"] for t in (begin, end)
        ]
        for label in drawn(page)["overview"]["labels"]:
            for edge in frame:
                assert not label["x"] - 1 < edge < label["x"] + label["width"] + 1, (label, frame)


def test_a_gap_is_not_joined_and_a_touch_that_ends_is_not_lost(page: Browser, live: Canned) -> None:
    """Between the end of a touch and the message with its result, its chart stays."""
    look(page, GAP[0] - 2, GAP[1] + 2)
    rows = live.state.rows
    held = rows[(rows["t_s"] > GAP[0] + 3) & (rows["t_s"] < GAP[1] + 7)]
    assert drawn(page)["detail"]["points"] == pytest.approx(2 * len(held), abs=4)
    page.press("l")
    assert rows["flags"][-5] & RowFlag.MEASURED
    sent(page, live, 8)
    assert drawn(page)["touch"]["number"] == 20
