"""Headless Chromium on the page of a running `palpate live`."""

import base64
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from live_server import PATIENCE_S
from palpate.live.feed import HEADER
from project import need
from selenium import webdriver
from selenium.common.exceptions import StaleElementReferenceException
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait


class Browser:
    """Headless Chromium with the page open."""

    def __init__(self, driver: Any) -> None:
        self.driver = driver

    def __getitem__(self, name: str) -> Any:
        """Return the element with this id."""
        return self.driver.find_element(By.ID, name)

    def text(self, name: str) -> str:
        """Return the text of an element."""
        return str(self[name].text)

    def until(self, holds: Any) -> None:
        """Wait for a condition; an element that the page replaces meanwhile is looked for again."""
        wait = WebDriverWait(self.driver, PATIENCE_S, 0.1, ignored_exceptions=[StaleElementReferenceException])
        wait.until(lambda _: holds())

    def times(self) -> list[float]:
        """Return the times of all samples that have come since the last call, s."""
        found: list[float] = []
        for entry in self.driver.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.webSocketFrameReceived" and message["params"]["response"]["opcode"] == 2:
                frame = base64.b64decode(message["params"]["response"]["payloadData"])
                found += np.frombuffer(frame, "<f8", HEADER.unpack_from(frame)[2], HEADER.size).tolist()
        return found

    def theme(self, name: str) -> None:
        """Select light or dark colours."""
        while self["theme"].get_attribute("aria-label") != f"Colours: {name}":
            self["theme"].click()

    def shoot(self, path: Path) -> None:
        """Take a screenshot of the window."""
        self.driver.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
        self.driver.save_screenshot(str(path))


@contextmanager
def browser(downloads: Path, size: tuple[int, int] = (1280, 1180)) -> Iterator[Browser]:
    """Start Chromium; its downloads go to a folder."""
    options = webdriver.ChromeOptions()
    options.binary_location = need("chromium")
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"):
        options.add_argument(argument)
    options.add_argument(f"--window-size={size[0]},{size[1]}")
    options.add_experimental_option("prefs", {"download.default_directory": str(downloads)})
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options, webdriver.ChromeService(need("chromedriver")))
    try:
        yield Browser(driver)
    finally:
        driver.quit()
