"""The charts of the page: window, zoom, selection, cursors, labels, read-outs, and rows at the screen's resolution."""

import re
from collections.abc import Iterator
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from chart_pan import PAN, Long, long_rows, visit
from live_browser import Browser, browser
from page_cases import CASES
from page_data import GAP, ORIGIN_S, RATE
from page_states import SIZES, Canned, serving, sized
from palpate.live.feed import ROW, Flag, Rows
from project import need

Window = tuple[float, float]
FIRE = """
const [id, type, more] = arguments, place = document.getElementById(id), { left, top, width, height } = place.getBoundingClientRect();
place.setPointerCapture = () => {};
const at = { clientX: left + more.x * width, clientY: top + (more.y ?? 0.6) * height, bubbles: true, cancelable: true, button: 0, pointerId: 1, ...more };
place.dispatchEvent(type === "wheel" ? new WheelEvent(type, at) : new PointerEvent(type, at));
"""
NOTHING_BUT = "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(done));"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    need("chromium")
    need("chromedriver")
    with browser(tmp_path_factory.mktemp("charts")) as page:
        sized(page, *SIZES["desk"])
        yield page


@pytest.fixture(scope="module")
def rows() -> Rows:
    return long_rows()


@pytest.fixture
def live(page: Browser) -> Iterator[Canned]:
    with serving(Canned(CASES["contact"]())) as server:
        visit(page, server)
        yield server


@pytest.fixture
def recording(page: Browser, rows: Rows) -> Iterator[Long]:
    server = Long(rows)
    with serving(server):
        visit(page, server)
        page.until(lambda: drawn(page)["overview"]["points"] > 0)
        yield server
        page.driver.get("about:blank")


def drawn(page: Browser) -> Any:
    page.driver.execute_async_script(NOTHING_BUT)
    return page.driver.execute_script("return charts.geometry()")


def window(page: Browser) -> Window:
    now = drawn(page)
    return now["from"] - ORIGIN_S, now["to"] - ORIGIN_S


def fire(page: Browser, place: str, kind: str, x: float, **more: Any) -> None:
    page.driver.execute_script(FIRE, place, kind, {"x": x, **more})


def drag(page: Browser, place: str, begin: float, end: float, **more: Any) -> None:
    fire(page, place, "pointerdown", begin, **more)
    fire(page, place, "pointermove", (begin + end) / 2, **more)
    fire(page, place, "pointermove", end, **more)
    fire(page, place, "pointerup", end, **more)


def key(page: Browser, name: str) -> None:
    page.driver.execute_script("charts.key(arguments[0])", name)


def share_of(page: Browser, place: str, t: float) -> float:
    """Return where a moment is, as a share of the width of a chart."""
    now = drawn(page)[place]
    x = page.driver.execute_script(f"return charts.{place}.x(arguments[0])", t + ORIGIN_S)
    return float(x / now["width"])


def test_the_window_follows_and_the_keys_change_it(page: Browser, live: Canned) -> None:
    end = live.state.told["state"]["end_s"] - ORIGIN_S
    assert window(page) == pytest.approx((end - 30, end))
    key(page, "in")
    assert window(page) == pytest.approx((end - 15, end))
    assert drawn(page)["back"] is None
    key(page, "left")
    assert window(page) == pytest.approx((end - 18, end - 3))
    assert drawn(page)["back"] == pytest.approx({"from_s": end - 18 + ORIGIN_S, "to_s": end - 3 + ORIGIN_S})
    key(page, "out")
    assert window(page) == pytest.approx((end - 30, end))
    key(page, "all")
    assert window(page) == pytest.approx((0, end))
    key(page, "live")
    assert window(page) == pytest.approx((end - 30, end))


def test_the_wheel_zooms_at_the_pointer_and_a_drag_pans(page: Browser, live: Canned) -> None:
    key(page, "pause")
    moment = window(page)[1] - 20
    at = share_of(page, "detail", moment)
    fire(page, "detail", "wheel", at, deltaY=-200)
    begin, end = window(page)
    assert end - begin < 25
    assert share_of(page, "detail", moment) == pytest.approx(at, abs=0.002)  # a wheel has whole pixels
    drag(page, "detail", 0.4, 0.6)
    moved = window(page)
    assert moved[1] - moved[0] == pytest.approx(end - begin)
    assert moved[0] < begin - 2
    drag(page, "detail", 0.3, 0.5, shiftKey=True)
    selected = window(page)
    assert moved[0] < selected[0] < selected[1] < moved[1]
    assert (selected[1] - selected[0]) / (moved[1] - moved[0]) == pytest.approx(0.2, abs=0.02)


def test_two_fingers_zoom(page: Browser, live: Canned) -> None:
    key(page, "pause")
    begin, end = window(page)
    fire(page, "detail", "pointerdown", 0.5, pointerId=1)
    fire(page, "detail", "pointerdown", 0.6, pointerId=2)
    fire(page, "detail", "pointermove", 0.4, pointerId=1)
    fire(page, "detail", "pointermove", 0.7, pointerId=2)
    for finger in (1, 2):
        fire(page, "detail", "pointerup", 0.5, pointerId=finger)
    assert (window(page)[1] - window(page)[0]) / (end - begin) == pytest.approx(1 / 3, rel=0.05)
    assert drawn(page)["cursors"] == [None, None]


def test_the_overview_selects_and_its_window_is_dragged(page: Browser, live: Canned) -> None:
    end = live.state.told["state"]["end_s"] - ORIGIN_S
    drag(page, "overview", 0.2, 0.4)
    begin, stop = window(page)
    assert (begin, stop) == pytest.approx((0.2 * end, 0.4 * end), abs=0.01 * end)
    drag(page, "overview", 0.3, 0.5)
    assert window(page) == pytest.approx((begin + 0.2 * end, stop + 0.2 * end), abs=0.01 * end)
    fire(page, "overview", "pointerdown", 0.1)
    fire(page, "overview", "pointerup", 0.1)
    begin, stop = window(page)
    assert begin <= 0.1 * end <= stop


def test_a_pause_keeps_the_window_while_rows_come(page: Browser, live: Canned) -> None:
    key(page, "pause")
    before = window(page)
    more = np.zeros(100, ROW)
    more["t_s"] = live.state.rows["t_s"][-1] + np.arange(1, 101) / RATE
    live.send(more)
    page.until(lambda: drawn(page)["extent"]["end"] == pytest.approx(more["t_s"][-1]))
    assert window(page) == before
    key(page, "pause")
    assert window(page)[1] == pytest.approx(more["t_s"][-1] - ORIGIN_S)
    assert drawn(page)["back"] is None


def test_cursors_read_the_values_of_rows(page: Browser, live: Canned) -> None:
    rows = live.state.rows
    t = np.array([40.0, 70.0]) + ORIGIN_S
    page.driver.execute_script("charts.window.show(arguments[0] - 9, arguments[1] + 9)", *t.tolist())
    for which, (at, shift) in enumerate(zip(t, (False, True), strict=True)):
        share = share_of(page, "detail", at - ORIGIN_S)
        fire(page, "detail", "pointerdown", share, shiftKey=shift)
        fire(page, "detail", "pointerup", share, shiftKey=shift)
        found = drawn(page)["cursors"][which]
        assert found["t"] == pytest.approx(at, abs=0.05)
        nearest = rows[np.argmin(np.abs(rows["t_s"] - found["t"]))]
        assert found["hard"] == nearest["hard"]
        assert found["soft"] == nearest["soft"]
    a, b = drawn(page)["cursors"]
    said = page.text("readout")
    assert f"{a['hard']:.4f} {b['hard']:.4f}".replace("-", "\N{MINUS SIGN}") in said
    assert re.search(rf"time 00:{a['t'] - ORIGIN_S:05.2f} 01:\d\d\.\d\d \+{b['t'] - a['t']:.2f} s", said)
    drag(page, "detail", share_of(page, "detail", a["t"] - ORIGIN_S), share_of(page, "detail", 50))
    assert drawn(page)["cursors"][0]["t"] == pytest.approx(50 + ORIGIN_S, abs=0.05)
    key(page, "clear")
    drawn(page)
    assert not page["readout"].is_displayed()


@pytest.mark.parametrize("size", ["desk", "phone", "wall"])
def test_labels_are_whole_and_apart(page: Browser, size: str) -> None:
    state = CASES["contact"]()
    events = state.told["events"]
    near = [
        {"id": 50 + k, "t_s": ORIGIN_S + 100 + 0.4 * k, "text": f"{k}: {'a long text ' * (k % 5)}"} for k in range(20)
    ]
    state.told["events"] = {**events, "marks": sorted([*events["marks"], *near], key=lambda mark: mark["t_s"])}
    sized(page, *SIZES[size])
    try:
        with serving(Canned(state)) as server:
            visit(page, server)
            for begin, end in ((0, 197), (95, 115), (167, 197), (99, 101)):
                page.driver.execute_script("charts.window.show(arguments[0], arguments[1])", begin + 5, end + 5)
                now = drawn(page)
                for place in ("overview", "detail"):
                    labels = now[place]["labels"]
                    assert labels
                    for one in labels:
                        assert 0 <= one["x"] <= now[place]["width"] - one["width"], one
                        assert one["height"] / 2 <= one["y"] <= now[place]["height"] - one["height"] / 2, one
                    for one, other in combinations(labels, 2):
                        beside = one["x"] + one["width"] <= other["x"] or other["x"] + other["width"] <= one["x"]
                        assert beside or abs(one["y"] - other["y"]) >= (one["height"] + other["height"]) / 2 - 1e-6
                for one in now["detail"]["labels"]:
                    if "at" in one:  # beside its line
                        assert min(abs(one["x"] - one["at"]), abs(one["x"] + one["width"] - one["at"])) <= 5 + 1e-6
    finally:
        sized(page, *SIZES["desk"])


def test_a_long_recording_is_drawn_with_few_points_and_few_requests(page: Browser, recording: Long) -> None:
    """What is drawn is bounded by the pixels, not by the rows; a pan asks for three windows at once."""
    assert window(page) == pytest.approx((0, 36000), abs=1)
    for span in (20.0, 600.0, 7200.0):
        page.driver.execute_script("charts.window.show(15000, 15000 + arguments[0])", span)
        page.until(lambda: not page.driver.execute_script("return charts.rows.views.underWay().length"))
        width = drawn(page)["detail"]["right"] - drawn(page)["detail"]["left"]
        before = len(recording.asked("view"))
        page.driver.execute_async_script(PAN, "detail", 40)
        now = drawn(page)
        assert 0.5 * min(width, span * RATE) < now["detail"]["points"] <= 4 * width + 10
        assert now["overview"]["points"] <= now["overview"]["width"] + 1
        assert len(recording.asked("view")) - before <= 4
    ids = [command["id"] for command in recording.asked("view")]
    assert len(ids) == len(set(ids))
    assert all(command["rows"] <= 4096 for command in recording.asked("view"))


def test_lowest_and_highest_values_of_a_pixel_are_shown(page: Browser, recording: Long, rows: Rows) -> None:
    page.driver.execute_script("charts.window.show(15000, 18600)")
    page.until(lambda: page.driver.execute_script("return charts.rows.views.best(15000, 18600)?.bin < 6"))
    page.until(lambda: not page.driver.execute_script("return charts.rows.views.underWay().length"))
    inside = rows[(rows["t_s"] >= 15200) & (rows["t_s"] < 15300)]
    low, high = page.driver.execute_script("return charts.rows.within('hard', 15200, 15300)")
    assert (low, high) == (inside["hard"].min(), inside["hard"].max())
    fire(page, "detail", "pointermove", 0.5)
    assert re.search(
        r"hard -?\d\.\d{4} to \d\.\d{4} pF", page.driver.execute_script("return charts.detail.hover.tip.textContent")
    )


def test_a_cursor_in_a_wide_window_reads_a_row_not_a_bin(page: Browser, recording: Long, rows: Rows) -> None:
    page.driver.execute_script("charts.window.show(5, 36005)")
    at = rows["t_s"][700_000]
    page.driver.execute_script("charts.cursors.put(0, arguments[0])", float(at))
    page.until(lambda: drawn(page)["cursors"][0]["hard"] == rows["hard"][700_000])


def test_requests_come_at_most_fifteen_times_a_second(page: Browser, recording: Long) -> None:
    jump = "const done = arguments[0], begun = performance.now(), before = charts.rows.views.sent; const step = (now) => { charts.window.show(5 + 30000 * Math.random(), 36000); if (now - begun < 1000) requestAnimationFrame(step); else done([performance.now() - begun, charts.rows.views.sent - before]); }; requestAnimationFrame(step);"
    took, sent = page.driver.execute_async_script(jump)
    assert sent <= took / 1000 * 15 + 1


def test_after_a_new_connection_views_are_asked_for_again(page: Browser, recording: Long) -> None:
    """The rows of a server that was started again are not those of the views that are kept."""
    before = len(recording.asked("view"))
    recording.change(recording.state)
    page.until(lambda: len(recording.asked("view")) > before)
    page.until(lambda: drawn(page)["overview"]["points"] > 0)


def test_the_touch_chart_shows_the_running_or_the_chosen_touch(page: Browser, live: Canned) -> None:
    now = drawn(page)["touch"]
    assert now["number"] == 20
    assert now["scale"] in (0.2, 0.5, 1, 2, 5, 10)
    assert page.text("touchtitle") == "Touch 20 · 30 OO · ratio, % from now"
    page.driver.execute_script("charts.choose(12)")
    page.until(lambda: drawn(page)["touch"]["number"] == 12)
    assert page.text("touchtitle") == "Touch 12 · 30 A · ratio, % from its result"
    said = [one["text"] for one in drawn(page)["touch"]["labels"]]
    assert len(said) == 1
    assert said[0].replace("\n", " ").startswith("▲ offset: the soft bump is reached")
    name = page.driver.execute_script("return document.querySelector('#touchplot svg').getAttribute('aria-label')")
    ratio = next(one["ratio"] for one in live.state.told["touches"]["rows"] if one["number"] == 12)
    assert f"ratio {ratio:.3f}" in name or f"ratio {ratio:.2f}" in name
    page.driver.execute_script("charts.choose(null)")
    assert drawn(page)["touch"]["number"] == 20


def test_charts_have_names_with_numbers(page: Browser, live: Canned) -> None:
    drawn(page)
    names = page.driver.execute_script(
        "return [...document.querySelectorAll('.plot [role=img]')].map((one) => one.getAttribute('aria-label'))"
    )
    said = " | ".join(names)
    for part in (
        "The whole measurement: 03:17, 19 touches (2 left out), 4 marks, 1 gap, 3 tares",
        "Capacitance changes from 02:4",
        "hard ",
        "Touches by specimen. 30 OO: 19 ",
    ):
        assert part in said, said


def test_the_noise_panel_asks_and_ends(page: Browser, live: Canned) -> None:
    key(page, "spectrum")
    page.until(lambda: "aF rms" in page.text("spectrum"))
    assert live.asked("noise")[-1] == {"do": "noise", "on": True}
    key(page, "spectrum")
    page.until(lambda: live.asked("noise")[-1] == {"do": "noise", "on": False})
    assert not page["spectrum"].is_displayed()


def test_a_gap_is_not_joined_and_a_touch_that_ends_is_not_lost(page: Browser, live: Canned) -> None:
    """Between the end of a touch and the message with its result, its chart stays."""
    page.driver.execute_script("charts.window.show(arguments[0], arguments[1])", GAP[0] + 3, GAP[1] + 7)
    rows = live.state.rows
    held = rows[(rows["t_s"] > GAP[0] + 3) & (rows["t_s"] < GAP[1] + 7)]
    assert drawn(page)["detail"]["points"] == pytest.approx(2 * len(held), abs=4)
    key(page, "live")
    more = np.zeros(8, ROW)
    more["t_s"] = rows["t_s"][-1] + np.arange(1, 9) / RATE
    for name in ("ratio", "standard_error", "statistic"):
        more[name] = np.nan
    assert rows["flags"][-5] & Flag.MEASURED
    live.send(more)
    page.until(lambda: drawn(page)["extent"]["end"] == pytest.approx(more["t_s"][-1]))
    assert drawn(page)["touch"]["number"] == 20
