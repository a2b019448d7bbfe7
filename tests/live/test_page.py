"""The live page in headless Chromium."""

import json
import math
import re
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import palpate
import pytest
from effort import random_of
from live_browser import Browser, browser
from live_server import Live, played
from palpate import digits
from palpate.live.server import page_files
from palpate.simulation.scenarios import SCENARIOS
from palpate.simulation.truth import Truth
from project import need
from selenium.webdriver.common.keys import Keys
from tally import Tally


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    need("chromium")
    need("chromedriver")
    folder = tmp_path_factory.mktemp("live")
    (folder / "played").mkdir()
    return folder


@pytest.fixture(scope="module")
def page(folder: Path) -> Iterator[Browser]:
    with browser(folder / "downloads") as page:
        yield page


def pressed(page: Browser, key: str) -> None:
    page.driver.switch_to.active_element.send_keys(key)


def answers(page: Browser, text: str) -> None:
    page.until(lambda: text in page.text("answer"))


def is_up(page: Browser) -> bool:
    body = page.driver.find_element("css selector", "body")
    return bool(body.get_attribute("data-up") == "yes") and page.text("word") not in ("", "\N{EN DASH}")


def tared(page: Browser) -> bool:
    """Press Tare if that is possible now; return whether it was obeyed, or refused as the next touch has begun."""
    if page["tare"].is_enabled():
        page["tare"].click()
    return bool(re.search("do not touch anything|in contact", page.text("answer")))


def test_a_session(page: Browser, serve: Callable[..., Live], folder: Path, tally: Tally) -> None:
    live = serve(
        "--record", str(folder / "run.csv"), source=played("four-specimens", folder / "played", 0.5)
    )  # 74 s: slow machines, too
    page.driver.get(live.address)
    page.until(lambda: page.text("word") == "Hold" and "±" in page.text("range"))
    truth = Truth(SCENARIOS["four-specimens"], np.random.default_rng(1)).presses[0].ratios[0][1]
    page.until(
        lambda: abs(float(page.text("number")) / truth - 1) < 0.01
    )  # the first pairs have a large error, and say so
    ratio = float(page.text("number"))

    pressed(page, "m")
    page.until(lambda: page["marking"].is_displayed())
    page["marktext"].send_keys("first specimen", Keys.ENTER)
    page.until(lambda: "first specimen" in page.text("marks"))
    page["record"].click()
    answers(page, "run.csv: ")
    page.until(lambda: page.text("record").startswith("Record "))
    pressed(page, "r")
    answers(page, "Recording to ")
    page.until(lambda: tared(page))
    for theme in ("light", "dark"):
        page.theme(theme)
        page.shoot(folder / f"{theme}.png")
        assert page.driver.execute_script("return document.documentElement.dataset.theme") == theme
    page["openfiles"].click()
    page["downloads"].find_element("link text", "run.csv").click()
    page.until(lambda: (folder / "downloads" / "run.csv").exists())
    assert live.end() == 130

    assert (folder / "downloads" / "run.csv").read_bytes() == (folder / "run.csv").read_bytes()
    assert [mark["text"] for mark in json.loads((folder / "run.json").read_text())["marks"]] == ["first specimen"]
    recordings = sorted(folder.glob("*.csv"))
    assert len(recordings) == 2
    for path in recordings:
        report = palpate.check(path)
        assert (report.clean, report.faults) == (True, ())
    tally.say(f"live page: ratio {ratio} by the page, {truth:.5f} true")


def test_a_flagged_touch_says_why(page: Browser, serve: Callable[..., Live], folder: Path) -> None:
    live = serve("--touch-seconds", "60", source=played("stiff-steady", folder / "played"))
    page.driver.get(live.address)
    page.until(lambda: page.text("word") == "Hold")
    assert not page["tare"].is_enabled()
    sentence = "before its full length: hold the probe longer"
    page.until(lambda: sentence in page.text("rows"))
    live.end()


def test_no_request_leaves_the_machine(page: Browser, serve: Callable[..., Live]) -> None:
    live = serve()
    page.driver.get("about:blank")  # the page of the test before asks no more
    page.driver.get_log("performance")
    page.driver.get(live.address)
    page.until(lambda: is_up(page))
    seen = [json.loads(entry["message"])["message"] for entry in page.driver.get_log("performance")]
    asked = [m["params"]["request"]["url"] for m in seen if m["method"] == "Network.requestWillBeSent"]
    complained = [entry for entry in page.driver.get_log("browser") if entry["level"] == "SEVERE"]
    live.end()
    assert len(asked) > 5
    assert all(url.startswith((live.origin, "data:")) for url in asked), asked
    assert [entry for entry in complained if live.origin in entry["message"]] == []


def test_a_server_that_is_killed_and_comes_back(page: Browser, serve: Callable[..., Live]) -> None:
    live = serve("--no-token")
    page.driver.get(live.address)
    page.until(lambda: is_up(page))
    live.end(signal.SIGKILL)
    page.until(lambda: page.text("says").startswith("✕ No connection"))
    assert not page["tare"].is_enabled()
    again = serve("--no-token", port=live.port)
    page.until(lambda: is_up(page) and page.text("word") == "Hold")
    again.end()


def test_an_old_tab_is_told_that_its_address_is_no_longer_valid(page: Browser, serve: Callable[..., Live]) -> None:
    live = serve()
    page.driver.get(live.address)
    page.until(lambda: is_up(page))
    assert "token" not in page.driver.current_url
    live.end()
    again = serve(port=live.port)
    page.until(lambda: page.text("says").startswith("✕ Address no longer valid."))
    assert "open the address that it printed" in page.text("says")
    old = page.driver.current_window_handle
    page.driver.switch_to.new_window("tab")
    page.driver.get(again.origin)
    assert "token: missing or wrong" in page.driver.find_element("css selector", "body").text
    page.driver.get(again.address)
    page.until(lambda: is_up(page))
    page.driver.close()
    page.driver.switch_to.window(old)
    page.until(lambda: is_up(page))
    again.end()


def test_a_page_that_stands_still_draws_no_hole_and_does_not_slow_the_measurement(
    page: Browser, serve: Callable[..., Live], folder: Path
) -> None:
    live = serve("--record", str(folder / "still.csv"))
    page.driver.get("about:blank")
    page.times()
    page.driver.get(live.address)
    page.until(lambda: page.text("word") == "Touch")
    page.driver.execute_script("const until = Date.now() + 9000; while (Date.now() < until);")
    page.until(lambda: page.text("word") == "Hold")
    times = page.times()
    live.end()
    recording = palpate.read(folder / "still.csv")
    first = int(np.searchsorted(recording.t_hard_s, times[0] - 1e-9))
    assert np.allclose(times, recording.t_hard_s[first : first + len(times)], rtol=0, atol=1e-9)
    assert (
        max(recording.t_hard_s[1:] - recording.t_hard_s[:-1]) < 7
    )  # the page stood still for 9 s; the machine may, too


def test_touches_that_differ_have_no_best(page: Browser, serve: Callable[..., Live], folder: Path) -> None:
    live = serve(source=played("four-specimens", folder / "played"))
    page.driver.get(live.address)
    page.until(
        lambda: len(page.driver.find_elements("css selector", "#rows tr.best")) == 1 and page.text("together") == ""
    )
    page.until(lambda: "differ" in page.text("together"))
    assert page.driver.find_elements("css selector", "#rows tr.best") == []
    assert page["together"].get_attribute("data-agree") == "no"
    live.end()


def test_the_page_rounds_as_python_does(page: Browser) -> None:
    source = re.sub(r"^export ", "", page_files()["/formatting.js"][0].decode(), flags=re.MULTILINE)
    draw = random_of("rounding")
    pairs: list[tuple[float, float | None]] = [
        (0.0996, 0.0996), (9.996, 0.1), (-0.001, 0.12), (0.3, 120.0), (0.0, 0.12), (0.0, 1e-12), (0.0, None),
        (1e-300, 1e-302), (1e300, 1e298), (1.0, 1e300), (5e-324, 5e-324), (123456.0, 1234.0), (1234567.0, 1234.0),
    ]  # fmt: skip
    for _ in range(5000):
        value = draw.choice([-1, 1]) * 10 ** draw.uniform(-12, 12)
        pairs.append((value, abs(value) * 10 ** draw.uniform(-8, 3) if draw.random() < 0.8 else None))
    script = f"{source}; return JSON.parse(arguments[0]).map(([v, u]) => [number(v, u), plusMinus(v, u).join(' ')])"
    page.driver.get("about:blank")
    shown = page.driver.execute_script(script, json.dumps(pairs))
    for (value, uncertainty), (number, both) in zip(pairs, shown, strict=True):
        assert number == digits.number(value, uncertainty or math.nan)
        if uncertainty:
            assert both == digits.plus_minus(value, uncertainty)
