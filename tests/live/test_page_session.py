"""The page with the real server: every button and key, a plug that is pulled, a calibration that is measured with."""

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from importlib.resources import files
from pathlib import Path
from typing import Any

import palpate
import pytest
from live_browser import Browser, browser
from live_server import Live, played
from palpate.elasticity import SORBOTHANE_MPA
from project import need, need_package
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
    if (line.dataset.level !== "fault" || noted.fault) return;
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


@pytest.fixture
def serve() -> Iterator[Callable[..., Live]]:
    with ExitStack() as running:
        yield lambda *options, **more: running.enter_context(Live(*options, **more))


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


def audit(page: Browser) -> list[Any]:
    """Return what axe-core finds that is serious or worse."""
    need_package("axe_core_python")
    page.driver.execute_script((files("axe_core_python") / "axe.min.js").read_text())
    found = page.driver.execute_async_script("axe.run(document).then((r) => arguments[0](r.violations))")
    return [(v["id"], [n["target"] for n in v["nodes"]][:3]) for v in found if v["impact"] in ("serious", "critical")]


def test_keys_and_buttons(page: Browser, serve: Callable[..., Live], folder: Path) -> None:
    live = serve("--folder", str(folder), source=played("ten-specimens", folder, 1))
    page.driver.get(live.address)
    page.until(lambda: page.text("word") == "Hold")
    plan(page, "soft; 0,2\nstiff; 3\n", 2)
    page.until(lambda: page.text("sessioncount") == "0 of 4 touches")
    page.until(lambda: page.text("nextname").startswith("soft"))
    press(page, "n")
    page.until(lambda: page.text("nextname").startswith("stiff"))
    page["onemore"].click()
    page.until(lambda: page.text("sessioncount") == "0 of 5 touches")
    press(page, "r")
    page.until(lambda: page.text("record").startswith("Recording"))
    press(page, "m")
    page.until(lambda: page["marking"].is_displayed())
    press(page, "wet", Keys.ENTER)
    page.until(lambda: "wet" in page.text("marks"))
    page["note"].send_keys("warm", Keys.ENTER)
    page.until(lambda: "warm" in page.text("marks"))
    press(page, Keys.ESCAPE)

    page.until(lambda: page["discard"].is_enabled())
    press(page, "d")
    page.until(lambda: page.text("discard").endswith("after all"))
    press(page, "d")
    page.until(lambda: page.text("discard").startswith("Discard"))
    page.until(lambda: page["tare"].is_enabled())
    press(page, "t")
    page.until(lambda: "do not touch anything" in page.text("answer"))

    for key, place in (("s", "noise"), ("k", "fit")):
        press(page, key)
        page.until(lambda place=place: page[place].is_displayed())
        press(page, key)
        page.until(lambda place=place: not page[place].is_displayed())
    press(page, " ")
    page.until(lambda: page.text("pause").startswith("Live"))
    for key in (Keys.ARROW_LEFT, "+", "-", "0"):
        before = page.text("timetitle")
        press(page, key)
        page.until(lambda before=before: page.text("timetitle") != before)
    press(page, "a", "b")
    page.until(lambda: page["readout"].is_displayed())
    press(page, Keys.ESCAPE)
    page.until(lambda: not page["readout"].is_displayed())
    press(page, "l")
    page.until(lambda: page.text("pause").startswith("Pause"))
    assert audit(page) == []

    press(page, "f")
    page.until(lambda: page["files"].is_displayed())
    page["report"].click()
    page.until(lambda: "-report.html" in page.text("downloads"))
    page["csv"].click()
    page.until(lambda: (folder / "downloads" / "touches.csv").exists())
    press(page, Keys.ESCAPE)
    press(page, "?")
    page.until(lambda: page["keys"].is_displayed())
    press(page, Keys.ESCAPE)
    press(page, "r")
    page.until(lambda: page.text("record").startswith("Record "))
    live.end()
    [path] = folder.glob("palpate-*.csv")
    assert palpate.check(path).clean
    assert [mark.text for mark in palpate.read(path).marks if mark.text == "wet"] == ["wet"]
    assert path.with_name(f"{path.stem}-report.html").exists()


def test_a_plug_that_is_pulled(page: Browser, serve: Callable[..., Live], tally: Tally) -> None:
    page.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": NOTED})
    live = serve(source="sim:four-specimens?seed=1&fault=unplug:30@12")
    page.driver.get(live.address)
    page.until(lambda: page.driver.execute_script("return noted.fault") > 0)
    noted = page.driver.execute_script("return noted")
    took_s = (noted["fault"] - noted["rows"]) / 1e3
    live.end()
    assert "Unplugged" in noted["what"]
    assert took_s < 5
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
    button(page, "Save the calibration").click()
    page.until(lambda: "Saved as probe.toml" in page.text("fitwords"))
    button(page, "Measure with it").click()
    page.until(lambda: page.text("mainname").startswith("Modulus"))
    live.end()
    calibration = palpate.Calibration.load(tmp_path / "probe.toml")
    measured = palpate.touches(palpate.read(tmp_path / "ten-specimens.csv"))
    inside = 0
    for number, touch in enumerate(measured):
        low, high = calibration.interval(touch.ratio, touch.standard_error)
        inside += low <= SORBOTHANE_MPA[NAMES[number // 4]] <= high
    assert inside >= 36


def story(page: Browser) -> dict[str, Any]:
    """Return what a page tells, and the picture of its overview."""
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
    told: dict[str, Any] = {name: page.text(name) for name in words}
    told["overview"] = page.driver.execute_script(
        "return [...document.querySelectorAll('#overview canvas')].map((c) => c.toDataURL())"
    )
    return told


def test_every_page_tells_the_same_story(
    page: Browser, serve: Callable[..., Live], folder: Path, tmp_path: Path
) -> None:
    """One is open all the time, another one is slow and sleeps through most of it, a third one comes at the end."""
    from bench.speed.live_recording import written

    written(tmp_path / "hour.csv", 1.0)
    live = serve(source=f"{tmp_path / 'hour.csv'}?speed=120")
    page.driver.get(live.address)
    with browser(folder) as other:
        other.driver.execute_cdp_cmd("Emulation.setCPUThrottlingRate", {"rate": 6})
        other.driver.get(live.address)
        other.until(lambda: len(other.driver.find_elements(By.CSS_SELECTOR, "#rows tr[data-touch]")) > 3)
        other.driver.set_script_timeout(600)
        other.driver.execute_async_script(
            "const until = Date.now() + 1000 * arguments[0]; while (Date.now() < until); arguments[1]();", 25
        )
        for one in (page, other):
            one.until(lambda one=one: one["again"].is_displayed())
            press(one, "l")
        other.driver.execute_cdp_cmd("Emulation.setCPUThrottlingRate", {"rate": 1})
        settled(page)
        expected = story(page)
        assert len(expected["rows"].splitlines()) > 100
        settled(other)
        assert story(other) == expected
        other.driver.get(live.address)
        other.until(lambda: other["again"].is_displayed())
        settled(other)
        assert story(other) == expected
    live.end()


def settled(page: Browser) -> None:
    """Wait until the page draws nothing new."""
    before: dict[str, Any] = {}
    while (now := story(page)) != before:
        before = now
        time.sleep(1)
