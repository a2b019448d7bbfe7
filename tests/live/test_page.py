"""The live page in headless Chromium."""

import json
import math
import re
import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import palpate
import pytest
from effort import random_of
from live_browser import Browser, browser
from live_server import Live
from palpate import digits
from palpate.live.server import page_files
from palpate.simulation.scenarios import SCENARIOS
from palpate.simulation.truth import Truth
from project import ROOT, need
from selenium.webdriver.common.keys import Keys
from tally import Tally


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    need("chromium")
    need("chromedriver")
    return tmp_path_factory.mktemp("live")


@pytest.fixture(scope="module")
def page(folder: Path) -> Iterator[Browser]:
    with browser(folder / "downloads") as page:
        yield page


@pytest.fixture
def serve() -> Iterator[Callable[..., Live]]:
    with ExitStack() as running:
        yield lambda *options, port=0: running.enter_context(Live(*options, port=port))


def says(page: Browser, text: str) -> None:
    page.until(lambda: text in page.text("message"))


def pressed(page: Browser, key: str) -> None:
    page.driver.switch_to.active_element.send_keys(key)


def test_a_session(page: Browser, serve: Callable[..., Live], folder: Path, tally: Tally) -> None:
    live = serve("--record", str(folder / "run.csv"))
    page.driver.get(live.address)
    page.until(lambda: page.text("state") == "contact" and "±" in page.text("error"))
    truth = Truth(SCENARIOS["four-specimens"], np.random.default_rng(1)).presses[0].ratios[0][1]
    page.until(
        lambda: abs(float(page.text("ratio")) / truth - 1) < 0.01
    )  # the first pairs have a large error, and say so
    ratio = float(page.text("ratio"))

    pressed(page, "m")
    page["text"].send_keys("first specimen", Keys.ENTER)
    says(page, "Marked: first specimen")
    page["record"].click()
    says(page, "run.csv: ")
    page.until(lambda: page["record"].get_attribute("aria-pressed") == "false")
    pressed(page, "r")
    says(page, "Recording to ")
    page["tare"].click()
    page.until(lambda: re.search("do not touch anything|in contact", page.text("message")))
    for theme in ("light", "dark"):
        page.theme(theme)
        page.shoot(folder / f"{theme}.png")
        assert page.driver.execute_script("return document.documentElement.dataset.theme") == theme
    page["downloads"].find_element("link text", "↓ run.csv").click()
    page.until(lambda: (folder / "downloads" / "run.csv").exists())
    assert live.end() == 130

    assert (folder / "downloads" / "run.csv").read_bytes() == (folder / "run.csv").read_bytes()
    for name in ("run.csv", "run-2.csv"):
        report = palpate.check(folder / name)
        assert (report.clean, report.faults) == (True, ())
    assert [mark["text"] for mark in json.loads((folder / "run.json").read_text())["marks"]] == ["first specimen"]
    tally.say(f"live page: ratio {ratio} by the page, {truth:.5f} true")


def test_a_flagged_touch_and_a_refused_tare(page: Browser, folder: Path) -> None:
    """The sentence stands beside the headline and in the row, with the revised result.

    From a file: a simulated board loses pairs on a busy machine, and the touch its revised result.
    """
    source = str(folder / "stiff.csv")
    with palpate.Stream("sim:stiff-steady?seed=1", record=source) as stream:
        for _ in stream.batches():
            pass
    with Live("--touch-seconds", "60", source=source) as live:
        page.driver.get(live.address)
        page.until(lambda: page.text("state") in ("contact", "adapting"))
        assert not page["anyway"].is_displayed()
        page["tare"].click()
        says(page, "tare: the probe is in contact; lift it first")
        page.until(lambda: page["anyway"].is_displayed())
        page.until(lambda: page.text("error").endswith(", revised"))
        sentence = "samples, before its full length"
        page.until(lambda: sentence in page.text("warning") and sentence in page.text("rows"))
        assert "hold the probe longer" in page.text("warning")
        assert "short, revised" in page.text("rows")
        assert not page["anyway"].is_displayed()
    with Live("--touch-seconds", "60", source=source) as live:
        page.driver.get(live.address)
        page.until(lambda: page.text("state") in ("contact", "adapting"))
        page["tare"].click()
        page.until(lambda: page["anyway"].is_displayed())
        page["anyway"].click()
        says(page, "do not touch anything")
        page.until(lambda: page.text("state") == "baseline")


def test_no_request_leaves_the_machine(page: Browser, serve: Callable[..., Live]) -> None:
    live = serve()
    page.driver.get_log("performance")
    page.driver.get(live.address)
    page.until(lambda: page.text("link") == "connected")
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
    page.until(lambda: page.text("link") == "connected" and page.text("rate") not in ("", "\N{EN DASH}"))
    live.end(signal.SIGKILL)
    page.until(lambda: page.text("link").startswith("no connection"))
    assert not page["tare"].is_enabled()
    again = serve("--no-token", port=live.port)
    page.until(lambda: page.text("link") == "connected" and page["tare"].is_enabled())
    page.until(lambda: page.text("state") == "contact")
    again.end()


def test_an_old_tab_is_told_that_its_address_is_no_longer_valid(page: Browser, serve: Callable[..., Live]) -> None:
    live = serve()
    page.driver.get(live.address)
    page.until(lambda: page.text("link") == "connected")
    assert "token" not in page.driver.current_url
    live.end()
    again = serve(port=live.port)
    page.until(lambda: page.text("link") == "address no longer valid")
    assert "open the address that it printed" in page.text("advice")
    old = page.driver.current_window_handle
    page.driver.switch_to.new_window("tab")
    page.driver.get(again.origin)
    assert "token: missing or wrong" in page.driver.find_element("css selector", "body").text
    page.driver.get(again.address)
    page.until(lambda: page.text("link") == "connected")
    page.driver.close()
    page.driver.switch_to.window(old)
    page.until(lambda: page.text("link") == "connected")
    again.end()


def test_a_page_that_stands_still_draws_no_hole_and_does_not_slow_the_measurement(
    page: Browser, serve: Callable[..., Live], folder: Path
) -> None:
    live = serve("--record", str(folder / "still.csv"))
    page.driver.get("about:blank")
    page.times()
    page.driver.get(live.address)
    page.until(lambda: page.text("state") == "no contact")
    page.driver.execute_script("const until = Date.now() + 5000; while (Date.now() < until);")
    page.until(lambda: page.text("state") in ("contact", "adapting"))
    times = page.times()
    assert ", 0 samples missed" in page.text("frames")
    counters = page.text("counters")
    live.end()
    assert counters.startswith("0 dropped")
    recording = palpate.read(folder / "still.csv")
    first = int(np.searchsorted(recording.t_hard_s, times[0] - 1e-9))
    assert np.allclose(times, recording.t_hard_s[first : first + len(times)], rtol=0, atol=1e-9)
    assert max(recording.t_hard_s[1:] - recording.t_hard_s[:-1]) < 1


def test_touches_that_differ_have_no_best(page: Browser) -> None:
    with Live(source=str(ROOT / "tests" / "data" / "four-specimens.csv")) as live:
        page.driver.get(live.address)
        page.until(lambda: len(page.driver.find_elements("css selector", "#rows tr.best")) == 1)
        assert page.text("together") == ""
        page.until(lambda: "differ" in page.text("together"))
        assert page.driver.find_elements("css selector", "#rows tr.best") == []
        assert page["together"].get_attribute("data-agree") == "no"


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
