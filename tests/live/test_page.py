"""The live page in headless Chromium, with the real server."""

import json
import math
import re
import signal
from collections.abc import Callable
from pathlib import Path

import palpate
from command_lines import run
from effort import random_of
from live_bench import OWN_FILE
from live_browser import Browser
from live_server import Live
from palpate import number_format
from palpate.elasticity import SORBOTHANE_MPA
from palpate.live.app import page_files
from selenium.webdriver.common.keys import Keys

Serve = Callable[..., Live]


def is_up(page: Browser) -> bool:
    return bool(page.all("body[data-up=yes]")) and page.text("word") not in ("", "\N{EN DASH}")


def test_a_session(page: Browser, serve: Serve, tmp_path: Path) -> None:
    """Measured, marked, recorded twice, tared, downloaded; no request leaves the machine."""
    # no pair of it comes late
    live = serve("--record", str(tmp_path / "run.csv"), source=f"{OWN_FILE}?speed=1")
    page.driver.get(live.lab)
    page.until(lambda: page.text("word") == "Hold" and "±" in page.text("range"))
    truths = [touch.ratio for touch in palpate.touches(OWN_FILE)]
    # the first pairs have a large error; a slow browser may see a later touch
    page.until(lambda: any(abs(float(page.text("number")) / truth - 1) < 0.01 for truth in truths))
    page.press("m")
    page.until(lambda: page["marking"].is_displayed())
    page["marktext"].send_keys("first specimen", Keys.ENTER)
    page.until(lambda: "first specimen" in page.text("marks"))
    page["record"].click()
    page.until(
        lambda: "run.csv: " in page.text("answer") and page.text("record").startswith("Record ")
    )
    page.press("r")
    page.until(lambda: "Recording to " in page.text("answer"))
    page.until(lambda: _tared(page))
    (page.downloads / "run.csv").unlink(missing_ok=True)
    page.click("openfiles")
    page["downloads"].find_element("link text", "run.csv").click()
    page.downloaded("run.csv")
    assert live.end() == 130
    assert (page.downloads / "run.csv").read_bytes() == (tmp_path / "run.csv").read_bytes()
    assert [mark["text"] for mark in json.loads((tmp_path / "run.json").read_text())["marks"]] == [
        "first specimen"
    ]
    recordings = sorted(tmp_path.glob("*.csv"))
    assert len(recordings) == 2
    for path in recordings:
        report = palpate.check(path)
        assert (report.clean, report.faults) == (True, ())
    asked = {url for url in page.requests() if not url.startswith(("about:", "blob:"))}
    assert len(asked) > 5
    assert all(url.replace("ws:", "http:").startswith(live.origin) for url in asked), asked


def test_a_session_of_ten_specimens(page: Browser, serve: Serve, tmp_path: Path) -> None:
    """Calibrated, saved and reported in 8 actions; all moduli are in their intervals; no text of an error is shown."""
    ten = tmp_path / "ten.csv"
    assert run("record", "sim:ten-specimens?seed=3", "-o", ten, "--touches", "40").exit_code == 0
    live = serve("--folder", str(tmp_path), source=f"{ten}?speed=60")
    page.driver.get(live.address)
    page.until(lambda: page.text("verb") == "Ended" and page["againhere"].is_displayed())
    page.press("p")
    lines = [f"{name}; {modulus}".replace(".", ",") for name, modulus in SORBOTHANE_MPA.items()]
    page["list"].send_keys("\n".join(lines))
    page.until(lambda: page.text("listread").splitlines()[-1:] == ["8.68 MPa"])
    page.all("#plan button.strong")[0].click()
    press_r = (
        "document.body.dispatchEvent(new KeyboardEvent('keydown', { key: 'r', bubbles: true }))"
    )
    once = f"if (!document.all.record.disabled) clearInterval(once), {press_r}"
    # from here it may come after the end: that is 6 s away
    page.run(f"const once = setInterval(() => {{ {once} }}, 10)")
    page["againhere"].click()
    page.press("k")
    page.until(
        lambda: (
            page.text("verb") == "Done" and "Calibration saved, report ready." in page.text("says")
        )
    )
    assert page.text("says").startswith("✓ 40 of 40 done.")
    page.until(lambda: "10 of 10 known moduli are in their intervals" in page.text("spread"))
    assert "fitted to them: no test" in page.text("spread")
    assert 2 < float(page.text("mean").split()[3]) < 4
    assert "got " not in page.all("body")[0].text
    page["openreport"].click()
    page.press("n")
    page.until(lambda: page.text("verb") != "Done")
    assert {path.suffix for path in tmp_path.glob("p*")} == {".toml", ".html", ".csv", ".json"}
    live.end()


def _tared(page: Browser) -> bool:
    """Press Tare if that is possible now; return whether it was obeyed, or refused as the next touch has begun."""
    if page["tare"].is_enabled():
        page["tare"].click()
    return bool(re.search("do not touch anything|in contact", page.text("answer")))


def test_a_server_that_is_killed_and_comes_back(
    page: Browser, serve: Serve, tmp_path: Path
) -> None:
    """With the same address the page goes on; with another token it says that its address is no longer valid."""
    live = serve("--no-token", "--record", str(tmp_path / "run.csv"))
    page.driver.get(live.lab)
    page.until(lambda: is_up(page) and "Recording 00:0" in page.text("record"))
    live.end(signal.SIGKILL)
    page.until(lambda: page.text("word") == "Offline")
    assert re.fullmatch(
        r"Recorded\n00:\d\d\nso far, \S+ rows; what came later is not known", page.text("next")
    )
    assert "Recording? · not known now" in page.text("record")
    page.press("t")
    page.until(lambda: page.text("answer").endswith(": not possible now, without a connection."))
    page.until(lambda: page.text("says").startswith("✕ No connection"))
    assert not page["tare"].is_enabled()
    again = serve("--no-token", port=live.port)
    page.until(lambda: is_up(page) and page["mark"].is_enabled())
    again.end(signal.SIGKILL)
    locked = serve(port=live.port)
    page.until(lambda: page.text("says").startswith("✕ Address no longer valid."))
    page.driver.get(locked.origin)
    assert "This address is not valid." in page.all("body")[0].text
    page.driver.get(locked.lab)
    page.until(lambda: is_up(page))
    locked.end()


def test_the_page_rounds_as_python_does(page: Browser) -> None:
    source = re.sub(r"^export ", "", page_files()["/formatting.js"][0].decode(), flags=re.MULTILINE)
    draw = random_of("rounding")
    pairs: list[tuple[float, float | None]] = [
        (0.0996, 0.0996), (9.996, 0.1), (-0.001, 0.12), (0.3, 120.0), (0.0, 0.12), (0.0, 1e-12), (0.0, None),
        (1e-300, 1e-302), (1e300, 1e298), (1.0, 1e300), (5e-324, 5e-324), (123456.0, 1234.0), (1234567.0, 1234.0),
    ]  # fmt: skip
    for _ in range(5000):
        value = draw.choice([-1, 1]) * 10 ** draw.uniform(-12, 12)
        pairs.append(
            (value, abs(value) * 10 ** draw.uniform(-8, 3) if draw.random() < 0.8 else None)
        )
    script = f"{source}; return JSON.parse(arguments[0]).map(([v, u]) => [number(v, u), plusMinus(v, u).join(' ')])"
    for (value, uncertainty), (number, both) in zip(
        pairs, page.run(script, json.dumps(pairs)), strict=True
    ):
        assert number == number_format.number(value, uncertainty or math.nan)
        if uncertainty:
            assert both == number_format.plus_minus(value, uncertainty)
