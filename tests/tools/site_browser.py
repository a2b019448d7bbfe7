"""The built site in headless Chromium: each page at the size of a desk and of a phone, in light and dark."""

import base64
import json
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path
from typing import Any

from live_browser import browser
from live_server import PATIENCE_S
from selenium.webdriver.support.ui import WebDriverWait

SIZES = {"desk": (1280, 1000), "phone": (390, 844)}

SIDEWAYS = """
const inner = (e) => {
  for (let p = e.parentElement; !p.matches(".content, body"); p = p.parentElement)
    if (getComputedStyle(p).overflowX !== "visible") return true;
  return false;
};
const beyond = (e) => e.getBoundingClientRect().right > innerWidth + 1;
return [...document.querySelectorAll(".main *")]
  .filter((e) => e.checkVisibility() && !e.closest("aside") && beyond(e) && !inner(e))
  .map((e) => `${e.tagName} ${e.className}: ${e.textContent.trim().slice(0, 40)}`);"""
"""What is wider than the window, and in no box that scrolls: the theme lets the whole text scroll sideways then."""

CUT = """
const wrong = [];
for (const e of document.querySelectorAll(".page *")) {
  const style = getComputedStyle(e), hides = (way) => /hidden|clip/.test(way);
  if (!e.checkVisibility() || e.closest("svg, .visually-hidden, math") || e.clientHeight === 0) continue;
  if (hides(style.overflowX) && e.scrollWidth > e.clientWidth + 1) wrong.push(e);
  else if (hides(style.overflowY) && !e.matches(".math-wrapper") && e.scrollHeight > e.clientHeight + 2) wrong.push(e);
}
return wrong.map((e) => `${e.tagName} ${e.className}: ${e.textContent.trim().slice(0, 40)}`);"""
"""Boxes that hide a part of what is in them; `formulas` of `Site` measures those of formulas."""

BARE = "return [...document.images].filter((e) => !e.complete || !e.naturalWidth || !e.alt).map((e) => e.src);"
"""Pictures that are not there, or say nothing to who cannot see them."""

CHECKS = {"sideways": SIDEWAYS, "cut": CUT, "bare": BARE}

_SHOWN = """const style = document.head.appendChild(document.createElement("style"));
style.id = "shown";
style.textContent = arguments[0];"""
_STILL = ".math-wrapper { scrollbar-width: none; }"
_WHOLE = f"{_STILL} .math-wrapper {{ overflow: clip visible !important; }}"


class Site:
    """A browser that goes through the pages of a folder."""

    def __init__(self, folder: Path, driver: Any) -> None:
        self.folder, self.driver = folder, driver

    def run(self, script: str, *given: Any) -> Any:
        """Run a script in the page."""
        return self.driver.execute_script(script, *given)

    def until(self, script: str) -> None:
        """Wait until a script returns something true."""
        WebDriverWait(self.driver, PATIENCE_S, 0.05).until(lambda _: self.run(script))

    def open(self, page: str) -> None:
        """Open a page, given by its path in the folder, with a query or an anchor."""
        self.driver.get(f"{self.folder.resolve().as_uri()}/{page}")

    def sized(self, width: int, height: int) -> None:
        """Set the size of the window's inside; no scroll bar takes a part of it."""
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        self.driver.execute_cdp_cmd("Emulation.setScrollbarsHidden", {"hidden": True})

    def coloured(self, scheme: str) -> None:
        """Prefer light or dark, as the system of a reader does."""
        wanted = {"features": [{"name": "prefers-color-scheme", "value": scheme}]}
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", wanted)

    def settled(self) -> None:
        """Wait until the fonts are there, and what they move is drawn."""
        script = "document.fonts.ready.then(() => requestAnimationFrame(() => requestAnimationFrame(arguments[0])))"
        self.driver.execute_async_script(script)

    def picture(self) -> str:
        """Return a PNG of the whole page, base64."""
        self.settled()
        return str(self.driver.execute_cdp_cmd("Page.captureScreenshot", {"captureBeyondViewport": True})["data"])

    def shoot(self, path: Path) -> None:
        """Write a PNG of the window."""
        path.write_bytes(base64.b64decode(self.driver.execute_cdp_cmd("Page.captureScreenshot", {})["data"]))

    def heard(self) -> tuple[list[str], list[str]]:
        """Return what the console said, and the addresses that were asked for or failed, since the last call."""
        said = [entry["message"] for entry in self.driver.get_log("browser")]
        asked = []
        for entry in self.driver.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent":
                asked.append(message["params"]["request"]["url"])
            elif message["method"] == "Network.loadingFailed":
                said.append(f"{message['params']['errorText']} {message['params'].get('type')}")
        return said, asked

    def hides_formulas(self) -> bool:
        """Return whether a box hides a part of a formula: whether the page looks different if no box hides anything."""
        pictures = []
        for style in (_STILL, _WHOLE):
            self.run(_SHOWN, style)
            pictures.append(self.picture())
            self.run("document.getElementById('shown').remove()")
        return pictures[0] != pictures[1]

    def audit(self) -> list[Any]:
        """Return what axe-core finds that is serious or worse."""
        if not self.run("return 'axe' in window"):
            self.run((files("axe_core_python") / "axe.min.js").read_text())
        script = "axe.run(document).then((found) => arguments[0](found.violations))"
        wrong = [rule for rule in self.driver.execute_async_script(script) if rule["impact"] in ("serious", "critical")]
        return [(rule["id"], [node["target"] for node in rule["nodes"]][:3]) for rule in wrong]


@contextmanager
def site_browser(folder: Path, downloads: Path) -> Iterator[Site]:
    """Start Chromium for the pages of a folder."""
    with browser(downloads) as started:
        started.driver.execute_cdp_cmd("Network.enable", {})
        yield Site(folder, started.driver)
