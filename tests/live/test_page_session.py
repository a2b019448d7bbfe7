"""The page with the real server: a plug that is pulled, a calibration that is measured with, pages that sleep."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from live_browser import Browser, browser
from live_server import Live, played
from numpy.typing import NDArray
from palpate.elasticity import SORBOTHANE_MPA
from project import need
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from tally import Tally

NOTED = """
window.noted = { rows: 0, fault: 0, what: "" };
window.WebSocket = class extends WebSocket {
  constructor(...given) {
    super(...given);
    this.addEventListener("message", ({ data }) => {
      if (typeof data !== "string" && new Uint32Array(data, 0, 4)[2] && !noted.fault) noted.rows = performance.now();
    });
  }
};
addEventListener("DOMContentLoaded", () => {
  const line = document.getElementById("line");
  const look = () => {
    if (line.dataset.level !== "fault" || !line.textContent.includes("Unplugged") || noted.fault) return;
    noted.fault = performance.now();
    noted.what = line.textContent;
  };
  new MutationObserver(look).observe(line, { attributes: true, subtree: true, childList: true, characterData: true });
});
"""
"""Notes in the page when the newest rows came, and when the line first showed a fault."""
NAMES = list(SORBOTHANE_MPA)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    need("chromium")
    need("chromedriver")
    return tmp_path_factory.mktemp("session")


@pytest.fixture
def page(folder: Path) -> Iterator[Browser]:
    with browser(folder / "downloads") as page:
        yield page


def press(page: Browser, *keys: str) -> None:
    page.driver.switch_to.active_element.send_keys(*keys)


def plan(page: Browser, text: str, wanted: int) -> None:
    """Enter the specimens."""
    press(page, "p")
    page.until(lambda: page["plan"].is_displayed())
    page["list"].send_keys(text)
    page["wanted"].clear()
    page["wanted"].send_keys(str(wanted))
    page["operator"].send_keys("A. B.", Keys.ENTER)
    page.until(lambda: not page["plan"].is_displayed())


def button(page: Browser, text: str) -> Any:
    return next(b for b in page["fitwords"].find_elements(By.TAG_NAME, "button") if b.text == text)


def test_a_plug_that_is_pulled(page: Browser, serve: Callable[..., Live], tally: Tally) -> None:
    page.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": NOTED})
    live = serve(source="sim:four-specimens?seed=1&fault=unplug:30@12")
    page.driver.get(live.address)
    page.until(lambda: page.driver.execute_script("return noted.fault") > 0)
    noted = page.driver.execute_script("return noted")
    took_s = (noted["fault"] - noted["rows"]) / 1e3
    live.end()
    assert "Unplugged" in noted["what"]
    assert took_s < 15  # while it is unplugged
    tally.say(f"live page: {took_s:.2f} s from the last rows before the plug was pulled to the line")


def test_a_calibration_in_the_page_is_measured_with(page: Browser, serve: Callable[..., Live], tmp_path: Path) -> None:
    live = serve("--folder", str(tmp_path), source=played("ten-specimens", tmp_path, 60))
    page.driver.get(live.address)
    page.until(lambda: page["again"].is_displayed())
    plan(page, "\n".join(f"{name}; {SORBOTHANE_MPA[name]:g}" for name in NAMES), 4)
    press(page, "k")
    page.until(lambda: page["fit"].is_displayed())
    page["again"].click()
    page.until(lambda: page.text("sessioncount") == "40 of 40 touches")
    page.until(lambda: "rigid_ratio" in page.text("fitwords"))
    page.until(lambda: button(page, "Save the calibration").is_enabled())
    page.until(lambda: button(page, "Save the calibration").click() is None)  # each fit makes it anew
    page.until(lambda: "Saved as probe.toml" in page.text("fitwords"))
    page.until(lambda: button(page, "Measure with it").click() is None)
    page.until(lambda: page.text("mainname").startswith("Modulus"))
    live.end()
    calibration = palpate.Calibration.load(tmp_path / "probe.toml")
    measured = palpate.touches(palpate.read(tmp_path / "ten-specimens.csv"))
    inside = 0
    for number, touch in enumerate(measured):
        _, low, high = calibration.modulus(touch.ratio, touch.standard_error)
        inside += low <= SORBOTHANE_MPA[NAMES[number // 4]] <= high
    assert inside >= 36


PIXELS = """return [...document.querySelectorAll("#overview canvas")].flatMap((c) =>
  [...c.getContext("2d").getImageData(0, 0, c.width, c.height).data]);"""


def story(page: Browser) -> dict[str, str]:
    """Return what a page tells in words."""
    words = (
        "word",
        "sub",
        "mainname",
        "number",
        "range",
        "rows",
        "marks",
        "nextname",
        "says",
        "sessioncount",
        "together",
    )
    return {name: page.text(name) for name in words}


def pixels(page: Browser) -> NDArray[np.int64]:
    """Return the picture of the whole measurement, shape (pixels, 4)."""
    return np.array(page.driver.execute_script(PIXELS)).reshape(-1, 4)


def alike(one: NDArray[np.int64], other: NDArray[np.int64]) -> float:
    """Return the share of pixels whose colour is about the same."""
    assert one.shape == other.shape
    assert len(np.unique(one, axis=0)) > 3
    return float(np.mean(np.abs(one - other).max(axis=1) < 64))


def test_every_page_tells_the_same_in_words(
    page: Browser, serve: Callable[..., Live], folder: Path, tmp_path: Path, tally: Tally
) -> None:
    """One is open all the time, another one is slow and sleeps through most of it, a third one comes at the end.

    The pictures of the whole measurement are not required to be the same: how far they are is only said.
    """
    from bench.speed.live_recording import written

    written(tmp_path / "hour.csv", 1.0)
    live = serve(source=f"{tmp_path / 'hour.csv'}?speed=240")
    page.driver.get(live.address)
    with browser(folder) as other:
        other.driver.execute_cdp_cmd("Emulation.setCPUThrottlingRate", {"rate": 6})
        other.driver.get(live.address)
        other.until(lambda: len(other.driver.find_elements(By.CSS_SELECTOR, "#rows tr[data-touch]")) > 3)
        other.driver.set_script_timeout(600)
        other.driver.execute_async_script(
            "const until = Date.now() + 1000 * arguments[0]; while (Date.now() < until); arguments[1]();", 10
        )
        for one in (page, other):
            one.until(lambda one=one: one["again"].is_displayed())
            press(one, "l")
        other.driver.execute_cdp_cmd("Emulation.setCPUThrottlingRate", {"rate": 1})
        settled(page)
        expected, picture = story(page), pixels(page)
        assert len(expected["rows"].splitlines()) > 100
        settled(other)
        assert story(other) == expected
        asleep = alike(picture, pixels(other))
        other.driver.get(live.address)
        other.until(lambda: other["again"].is_displayed())
        settled(other)
        assert story(other) == expected
        late = alike(picture, pixels(other))
    live.end()
    tally.say(
        f"live page: overview of a page that slept {100 * asleep:.1f} % the same, of a late one {100 * late:.1f} %"
    )


def settled(page: Browser) -> None:
    """Wait until the page draws nothing new."""
    before: list[int] = []
    while (now := page.driver.execute_script(PIXELS)) != before:
        before = now
        time.sleep(1)
