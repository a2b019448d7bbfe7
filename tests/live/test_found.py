"""A recording in the page: from touch to touch, what is found by words and times, its statistics, its table, its names."""

import csv
import statistics
from collections.abc import Callable
from pathlib import Path
from shutil import copy

import numpy as np
import palpate
import pytest
from live_bench import OWN_FILE
from live_browser import Browser
from live_server import Live
from page_charts import drag, drawn, fire, settled, share_of, window
from page_data import ORIGIN_S, State, state
from page_states import Canned, opened
from palpate import number_format
from palpate.recording import sidecar
from palpate.recording.session import Entry, Plan, plan_of
from selenium.webdriver.common.keys import Keys

NUMBERS = ("start_s", "samples", "ratio", "standard_error", "covariance")


@pytest.fixture
def file(shown: Callable[..., Canned]) -> Canned:
    return shown("file")


def find(page: Browser, words: str) -> list[int]:
    """Type words; return the numbers of the touches that are found."""
    page["find"].send_keys(Keys.CONTROL, "a", Keys.NULL, words or Keys.BACKSPACE)
    return [one["number"] for one in page.run("return palpate.known.found")]


def test_from_touch_to_touch_and_to_a_time(page: Browser, file: Canned) -> None:
    """Inside what is found; the window, its numbers and the row go along."""
    for key, number in (("n", 1), ("n", 2), (Keys.SHIFT + "n" + Keys.NULL, 1)):
        page.press(key)
        assert page.text("word") == str(number)
    assert find(page, "50 A") == [5, 6, 7, 8, 9]
    page["find"].send_keys(Keys.TAB)
    page.press("n")
    assert (page.text("word"), page.text("mainname")) == ("5", "Touch 5")
    touch = file.state.told["touches"]["rows"][4]
    begin, end = window(page)
    assert begin < touch["start_s"] - ORIGIN_S < touch["end_s"] - ORIGIN_S < end < begin + 37
    assert page.all("#rows tr.chosen")[0].get_attribute("data-touch") == "5"
    page.press("g")
    page["time"].send_keys("2:20,5" + Keys.ENTER)
    page.until(lambda: np.mean(window(page)) == pytest.approx(140.5, abs=0.1))
    page["time"].clear()
    page["time"].send_keys("soon" + Keys.ENTER)
    page.until(
        lambda: (
            page.text("answer")
            == "Go to: got soon, allowed: a time up to 03:20, as 3:41:41, 41:41 or 41.5"
        )
    )


def test_words_narrow_together(page: Browser, file: Canned) -> None:
    rows = file.state.told["touches"]["rows"]
    above = [one["number"] for one in rows if one["ratio"] > 8.4]
    wanted = {"": range(1, 21), "#12": [12], "left out": [6, 12], "flagged": [6, 12], "OFFSET": [12], "no name": [],
              ">8.4": above, "8.4 - 99": above, "8,4-99": above, ">much": [], "<8.4; 70 A": set(range(1, 5)) - set(above), "lifted too": [5], "1:00-1:20": [8, 9],
              "50 a; 0:50-1:05": [6, 7]}  # fmt: skip
    assert 0 < len(above) < 4
    for words, numbers in wanted.items():
        assert find(page, words) == list(numbers), words
        assert ("allowed: a ratio, as >8 or <4.4" in page.text("foundcount")) == (words == ">much")
    page["find"].send_keys(Keys.ESCAPE)
    assert page["find"].get_attribute("value") == "50 a"
    assert find(page, "30 OO") == [19, 20]
    assert [line.split(" ")[0] for line in page.text("statistics").splitlines()][::2] == [
        "Mean",
        "s.d.",
    ]
    find(page, "")
    drag(page, "overview", share_of(page, "overview", 44), share_of(page, "overview", 79.5))
    page.until(lambda: page.run("return palpate.known.found.length") == 5)
    assert page["find"].get_attribute("value") == "00:44-01:20"
    used = [one["ratio"] for one in rows[4:9] if one["kept"]]
    assert page.text("foundcount") == "5 of 20 found · 4 count\nSave 5 as CSV"
    mean, spread = statistics.mean(used), statistics.stdev(used)
    percent = number_format.error(100 * spread / mean)
    expected = f"Mean\n{number_format.number(mean, spread)}\ns.d.\n{number_format.error(spread)}, {percent} %"
    assert page.text("statistics") == expected  # no slope: the touches are within an hour


def test_a_slope_is_given_from_an_hour_on(page: Browser) -> None:
    told = state("file").told
    rows = told["touches"]["rows"]
    for one in rows:
        for name in ("start_s", "end_s"):
            one[name] *= 60
    told["state"]["end_s"] = rows[-1]["end_s"]
    with Canned(State(state("file").rows, told)) as server:
        opened(page, server, "file")
        find(page, "50 A; 1:00:00-2:00:00")
        assert "Slope" not in page.text("statistics")
        find(page, "")
        used = [one for one in rows if one["kept"]]
        times, ratios = ([one[name] for one in used] for name in ("start_s", "ratio"))
        fit, covariance = np.polyfit(times, ratios, 1, cov=True)
        mean = statistics.mean(ratios)
        slope, error = (
            abs(float(value)) * 360_000 / mean for value in (fit[0], covariance[0, 0] ** 0.5)
        )
        assert number_format.plus_minus(slope, error) in page.text("statistics")


def test_a_time_moves_the_touch_and_its_numbers_too(page: Browser, file: Canned) -> None:
    """Also a time without a touch: then the nearest one is shown."""
    rows = file.state.told["touches"]["rows"]
    times = ((140.5, 15, "Touch 15, 2 s later"), (103, 11, ""), (0.5, 1, "Touch 1, 4 s later"))
    for at, number, said in times:
        page.press("g")
        page["time"].clear()
        page["time"].send_keys(f"{at}" + Keys.ENTER)
        page.until(lambda at=at: np.mean(window(page)) == pytest.approx(at, abs=18))
        t = at + ORIGIN_S
        away = [max(one["start_s"] - t, t - one["end_s"], 0) for one in rows]
        assert away.index(min(away)) + 1 == number
        assert page.text("word") == str(number), at
        assert page.text("mainname").startswith(f"Touch {number}")
        assert said in page.text("answer")
        page.press(Keys.ESCAPE)


def test_a_zoom_is_about_the_middle_and_the_values_at_the_pointer_go_along(
    page: Browser, file: Canned
) -> None:
    page.press("0")
    begin, end = window(page)
    fire(page, "detail", "pointermove", 0.3)
    tip = "return palpate.charts.detail.hover.tip.firstChild.textContent"
    before = page.run(tip)
    page.press("+")
    assert window(page) == pytest.approx((begin + (end - begin) / 4, end - (end - begin) / 4))
    settled(page)
    drawn(page)
    assert page.run(tip) != before


def test_all_touches_are_saved_and_named_in_the_sidecar(
    page: Browser, serve: Callable[..., Live], tmp_path: Path
) -> None:
    """The table has the numbers of `replay`. Entries of touches that are not found stay; rows of the file, too."""
    path, table = tmp_path / "gels.csv", page.downloads / "gels-touches.csv"
    for each in (OWN_FILE, OWN_FILE.with_suffix(".json")):
        copy(each, tmp_path / f"gels{each.suffix}")
    sidecar.amend(path, Plan("series", touches=(Entry(1e4, "lost"),)), Plan())
    table.unlink(missing_ok=True)
    page.driver.get(serve(source=str(path)).address)
    page.until(lambda: page.text("savefound") == "Save 4 as CSV")
    page["savefound"].click()
    page.downloaded(table.name)
    touches = palpate.touches(palpate.read(path))
    with table.open() as file:
        saved = [[float(row[name]) for name in NUMBERS] for row in csv.DictReader(file)]
    assert saved == [[getattr(one, name) for name in NUMBERS] for one in touches]
    find(page, "#2")
    page["name"].send_keys("40 A; 1,54" + Keys.ENTER)
    page.until(lambda: page.text("answer") == "1 touch: 40 A.")
    find(page, "")
    page.all("#rows tr[data-touch='3'] button")[0].click()
    page.until(lambda: page.all("tr.chosen select"))
    page.all("tr.chosen td:last-child button")[0].click()
    page.until(lambda: "Touch 3 is left out." in page.text("answer"))
    plan = plan_of(sidecar.load(path) or {})
    assert [(one.name, one.modulus_MPa) for one in plan.specimens] == [("40 A", 1.54)]
    entries = [(one.start_s, one.specimen, one.left_out) for one in plan.touches]
    assert entries == [
        (touches[1].start_s, "40 A", ""),
        (touches[2].start_s, None, "discarded"),
        (1e4, "lost", ""),
    ]
    assert palpate.check(path).faults == ()
    assert path.read_bytes() == OWN_FILE.read_bytes()
