"""The report in headless Chromium: on a phone, in the dark, on paper; readable, and nothing is asked for."""

import base64
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import page_looks
import pytest
from live_browser import Browser
from palpate import report
from project import made_once
from report_session import recorded, specimens, with_session

LONG = "of a name that is very long and has_no_place_to_break_at_all" * 2


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write a report with everything in it, and a name that is too long."""
    folder = made_once(tmp_path_factory, "report", recorded)
    path = tmp_path_factory.mktemp("print") / "r.html"
    files = [*specimens(folder), with_session(path.with_name("odd.csv"), odd=f" {LONG[:60]}")]
    moduli = folder / "ten" / "moduli.csv"
    options = report.ReportOptions(folder / "probe.toml", moduli, title=f"gel {LONG}")
    report.write_report(path, files, options)
    return path


@pytest.fixture(scope="module")
def driver(page: Path, chromium: Browser) -> Iterator[Any]:
    chromium.reset()
    chromium.driver.get(page.as_uri())
    yield chromium.driver
    chromium.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": []})


def show(
    driver: Any, width: int, height: int = 900, scheme: str = "light", media: str = ""
) -> None:
    """Set the size of the window in CSS pixels, the colours that the system asks for, and the medium."""
    driver.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600},
    )
    features = [{"name": "prefers-color-scheme", "value": scheme}]
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": media, "features": features})


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_each_text_can_be_read(driver: Any, scheme: str) -> None:
    show(driver, 1280, scheme=scheme)
    assert page_looks.audit(driver) == []
    ground = driver.execute_script(
        "return getComputedStyle(document.documentElement).backgroundColor"
    )
    assert ground == {"light": "rgb(255, 255, 255)", "dark": "rgb(29, 33, 37)"}[scheme]


@pytest.mark.parametrize("width", [320, 2560])
def test_no_scrolling_to_the_side(driver: Any, width: int) -> None:
    show(driver, width)
    inner, whole = driver.execute_script(
        "const page = document.documentElement; return [page.clientWidth, page.scrollWidth]"
    )
    assert whole == inner > width - 20
    cut = driver.execute_script(
        "return [...document.querySelectorAll('h1, p, dd, dl, pre, figure')]"
        ".filter(one => one.getBoundingClientRect().right > document.documentElement.clientWidth + 1).map(one => one.tagName)"
    )
    assert cut == []


def test_it_prints_on_a4(driver: Any) -> None:
    show(driver, 1280)
    printed = driver.execute_cdp_cmd(
        "Page.printToPDF", {"preferCSSPageSize": True, "printBackground": True}
    )
    data = base64.b64decode(printed["data"])
    boxes = {
        tuple(map(round, map(float, box)))
        for box in re.findall(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", data)
    }
    assert boxes == {(595, 842)}  # points
    assert 3 <= data.count(b"/Type /Page\n") <= 8


def test_nothing_is_asked_for(driver: Any, page: Path) -> None:
    driver.get_log("performance")
    driver.get_log("browser")
    driver.get(page.as_uri())
    sent = [json.loads(entry["message"])["message"] for entry in driver.get_log("performance")]
    asked = [
        one["params"]["request"]["url"]
        for one in sent
        if one["method"] == "Network.requestWillBeSent"
    ]
    assert asked == [page.as_uri()]
    assert driver.get_log("browser") == []
    assert driver.execute_script("return performance.getEntriesByType('resource').length") == 0
