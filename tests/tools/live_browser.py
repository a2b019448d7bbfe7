"""Headless Chromium: one for all tests of a worker."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from project import need
from selenium import webdriver
from selenium.common.exceptions import StaleElementReferenceException
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait

PATIENCE_S = 90  # long, since a busy machine is slow
SIZES = {"desk": (1280, 800), "phone": (390, 844), "wall": (2560, 1440), "lying": (844, 390), "small": (640, 400), "screen": (1920, 1080), "tablet": (768, 1024)}  # fmt: skip


class Browser:
    """Chromium with a page open."""

    def __init__(self, driver: Any, downloads: Path) -> None:
        self.driver, self.downloads = driver, downloads
        self.run = driver.execute_script

    def __getitem__(self, name: str) -> Any:
        """Return the element with this id."""
        return self.driver.find_element(By.ID, name)

    def all(self, selector: str) -> list[Any]:
        """Return the elements of a CSS selector."""
        return list(self.driver.find_elements(By.CSS_SELECTOR, selector))

    def text(self, name: str) -> str:
        """Return the text of an element."""
        return str(self[name].text)

    def press(self, *keys: str) -> None:
        """Press keys, one after the other."""
        self.driver.switch_to.active_element.send_keys(*keys)

    def click(self, name: str) -> None:
        """Click an element, also one that something lies over."""
        self.run("document.getElementById(arguments[0]).click()", name)

    def until(self, holds: Any, patience_s: float = PATIENCE_S) -> None:
        """Wait for a condition; an element that the page replaces meanwhile is looked for again."""
        wait = WebDriverWait(
            self.driver, patience_s, 0.1, ignored_exceptions=[StaleElementReferenceException]
        )
        wait.until(lambda _: holds())

    def settled(self, script: str) -> Any:
        """Return what a script returns, once it stays for half a second: a page is laid out while it loads."""
        seen: list[Any] = []

        def stays() -> bool:
            seen.append(self.run(script))
            return len(seen) > 5 and all(one == seen[-1] for one in seen[-6:])

        self.until(stays)
        return seen[-1]

    def size(self, name: str) -> None:
        """Give the window's inside a size of `SIZES`, also one that a window cannot have."""
        width, height = SIZES[name]
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 900}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)

    def theme(self, name: str) -> None:
        """Select light or dark colours."""
        self.choose("theme", name)

    def choose(self, setting: str, value: str) -> None:
        """Choose a setting in its dialog."""
        self.run(f"document.querySelector('[name={setting}][value={value}]').click()")

    def drawn(self) -> None:
        """Wait for two frames."""
        self.driver.execute_async_script(
            "requestAnimationFrame(() => requestAnimationFrame(arguments[0]))"
        )

    def reset(self) -> None:
        """Leave the page, close what it opened, and forget what it did."""
        first, *opened = self.driver.window_handles
        for window in opened:
            self.driver.switch_to.window(window)
            self.driver.close()
        self.driver.switch_to.window(first)
        self.driver.get("about:blank")
        self.size("desk")
        self.driver.set_script_timeout(60)
        for kind in ("browser", "performance"):
            self.driver.get_log(kind)

    def downloaded(self, name: str) -> Path:
        """Wait for a download; return its path. The browser makes an empty file first, and writes beside it."""
        path = self.downloads / name
        self.until(
            lambda: (
                path.exists() and path.stat().st_size and not [*self.downloads.glob("*.crdownload")]
            )
        )
        return path

    def requests(self) -> set[str]:
        """Return the addresses that were asked for since the last call; what is in a page itself has none."""
        told = [
            json.loads(entry["message"])["message"] for entry in self.driver.get_log("performance")
        ]
        asked = {
            one["params"]["request"]["url"]
            for one in told
            if one["method"] == "Network.requestWillBeSent"
        }
        sockets = {
            one["params"]["url"] for one in told if one["method"] == "Network.webSocketCreated"
        }
        return {url for url in asked | sockets if not url.startswith("data:")}

    def complaints(self) -> list[str]:
        """Return the errors and warnings of the console since the last call."""
        return [entry["message"] for entry in self.driver.get_log("browser")]


@contextmanager
def browser(downloads: Path) -> Iterator[Browser]:
    """Start Chromium; its downloads go to a folder."""
    options = webdriver.ChromeOptions()
    options.binary_location = need("chromium")
    for argument in (
        "headless=new",
        "no-sandbox",
        "disable-gpu",
        "disable-dev-shm-usage",
        "window-size=1280,1180",
    ):
        options.add_argument(f"--{argument}")
    options.add_experimental_option("prefs", {"download.default_directory": str(downloads)})
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options, webdriver.ChromeService(need("chromedriver")))
    try:
        yield Browser(driver, downloads)
    finally:
        driver.quit()
