"""The pictures of the live page for docs, from a session of ten simulated specimens.

python tests/tools/live_pictures.py FOLDER      writes live-light, -dark, -phone, -file.png
"""

import subprocess
import sys
import tempfile
from pathlib import Path

from live_browser import Browser, browser
from live_server import Live
from page_states import SIZES, sized
from palpate.elasticity import SORBOTHANE_MPA
from PIL import Image

SOURCE = "sim:ten-specimens?speed=4"
PLAN = "\n".join(f"{name}; {modulus}" for name, modulus in SORBOTHANE_MPA.items())


class Taker:
    """Takes pictures of one page."""

    def __init__(self, page: Browser, folder: Path) -> None:
        self._page, self._folder = page, folder

    def __call__(self, name: str, size: str = "desk", theme: str = "light") -> None:
        """Take one, of few colours: a tenth of its size is enough for a page."""
        sized(self._page, *SIZES[size])
        while self._page["theme"].get_attribute("aria-label") != f"Colours: {theme}":
            self._run("document.getElementById('theme').click()")
        path = self._folder / f"live-{name}.png"
        self._page.shoot(path)
        with Image.open(path) as picture:
            few = picture.convert("RGB").quantize(128)
        few.save(path, optimize=True)

    def _run(self, script: str) -> None:
        self._page.driver.execute_script(script)


def calibrated(folder: Path) -> Path:
    """Calibrate on simulated specimens."""
    for command in ("simulate -o specimens", "calibrate specimens/*.csv --moduli specimens/moduli.csv -o probe.toml"):
        subprocess.run(
            f"{sys.executable} -m palpate {command}", cwd=folder, shell=True, check=True, capture_output=True
        )
    return folder / "probe.toml"


def press(page: Browser, key: str) -> None:
    """Press a key of the page."""
    page.driver.find_element("tag name", "body").send_keys(key)


def plan(page: Browser) -> None:
    """Give the list of specimens."""
    press(page, "p")
    fill = "document.getElementById(arguments[0]).value = arguments[1]"
    for name, text in {"list": PLAN, "title": "ten specimens", "operator": "A. Bee"}.items():
        page.driver.execute_script(fill, name, text)
    page.driver.find_element("css selector", "#plan button.strong").click()


def measuring(page: Browser, touch: int) -> None:
    """Wait until a touch runs, and has a result."""
    page.until(lambda: page.text("mainname").endswith(f"touch {touch}") and page.text("word") == "Hold" and half(page))


def half(page: Browser) -> bool:
    """Return whether the touch that runs is more than half done."""
    return float(page["bar"].find_element("tag name", "b").get_attribute("style").split(":")[1].split("%")[0]) > 50


def session(page: Browser, take: Taker, work: Path) -> None:
    """Measure ten specimens."""
    with Live("--record", f"{work}/run.csv", "--calibration", str(calibrated(work)), source=SOURCE) as live:
        sized(page, *SIZES["desk"])
        page.driver.get(live.address)
        page.until(lambda: page.text("word") in ("Touch", "Wait"))
        plan(page)
        measuring(page, 10)
        take("light")
        measuring(page, 12)
        take("phone", "phone")
        press(page, "k")
        measuring(page, 27)
        take("dark", theme="dark")
        page.until(
            lambda: page.driver.execute_script("return document.querySelectorAll('#rows tr[data-touch]').length") == 40
        )
        live.end()


def recorded(page: Browser, take: Taker, work: Path) -> None:
    """Open the recording, with both cursors."""
    with Live("--calibration", f"{work}/probe.toml", source=f"{work}/run.csv") as live:
        sized(page, *SIZES["desk"])
        page.driver.get(live.address)
        page.until(lambda: page.text("word") == "File" and page.text("nextname").startswith("40"))
        for key in "0++++ab":
            press(page, key)
        page.until(lambda: page["readout"].is_displayed())
        take("file")
        live.end()


def main() -> int:
    """Take them."""
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as work, browser(folder) as page:
        take = Taker(page, folder)
        session(page, take, Path(work))
        recorded(page, take, Path(work))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
