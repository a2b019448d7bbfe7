"""The pictures of the live page for docs, from a session of ten simulated specimens.

python tests/tools/live_pictures.py FOLDER      writes live-light, -dark, -phone, -file.png
"""

import subprocess
import sys
import tempfile
from contextlib import chdir
from pathlib import Path

from live_browser import Browser, browser
from live_server import Live
from page_states import SIZES, sized
from palpate.elasticity import SORBOTHANE_MPA
from PIL import Image
from selenium.webdriver.common.keys import Keys

SIMULATED, FILE = "sim:ten-specimens", "ten-specimens.csv"
"""A recording that is played is never late, on a busy machine either."""
PLAN = "\n".join(f"{name}; {modulus}" for name, modulus in SORBOTHANE_MPA.items())

ROWS = "return document.querySelectorAll('#rows tr[data-touch]').length"
HALF = """const text = (id) => document.getElementById(id).textContent;
const share = parseFloat(document.querySelector("#bar b").style.width);
return text("word") === "Hold" && Number(text("mainname").split(" ").at(-1)) >= arguments[0]
    && share > 50 && share < 85
    && document.getElementById("line").dataset.level === 'quiet'"""


class Taker:
    """Takes pictures of one page."""

    def __init__(self, page: Browser, folder: Path) -> None:
        self._page, self._folder = page, folder

    def dress(self, size: str = "desk", theme: str = "light") -> None:
        """Give the page a size and its colours."""
        sized(self._page, *SIZES[size])
        while self._page["theme"].get_attribute("aria-label") != f"Colours: {theme}":
            self._run("document.getElementById('theme').click()")

    def __call__(self, name: str) -> None:
        """Take one, with 128 colours: the file is small, and looks the same."""
        path = self._folder / f"live-{name}.png"
        self._page.shoot(path)
        with Image.open(path) as picture:
            few = picture.convert("RGB").quantize(128)
        few.save(path, optimize=True)

    def _run(self, script: str) -> None:
        self._page.driver.execute_script(script)


def palpate(line: str) -> None:
    """Run a command."""
    subprocess.run(f"{sys.executable} -m palpate {line}", shell=True, check=True, capture_output=True)


def prepare() -> None:
    """Calibrate on simulated specimens, and record the session that is played."""
    palpate("simulate -o specimens")
    palpate("calibrate specimens/*.csv --moduli specimens/moduli.csv -o probe.toml")
    palpate(f"record {SIMULATED} -o {FILE} --touches 40")


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
    """Wait until more than half of this touch, or of a later one, is done, and nothing is wrong; a busy machine is slow."""
    page.until(lambda: page.driver.execute_script(HALF, touch))


def session(page: Browser, take: Taker) -> None:
    """Measure ten specimens."""
    with Live("--record", "run.csv", "--calibration", "probe.toml", source=f"{FILE}?speed=1") as live:
        page.driver.get(live.address)
        page.until(lambda: page.text("word") in ("Touch", "Wait", "Hold"))
        take.dress()
        plan(page)
        measuring(page, 10)
        take("light")
        take.dress("phone")
        measuring(page, 12)
        take("phone")
        take.dress(theme="dark")
        press(page, "k")
        for touch in (18, 25):
            measuring(page, touch)
        take("dark")
        for touch in (32, 39):
            measuring(page, touch)
        page.until(lambda: page.driver.execute_script(ROWS) == 40)
        live.end()


def recorded(page: Browser, take: Taker) -> None:
    """Open the recording, with both cursors."""
    with Live("--calibration", "probe.toml", source="run.csv") as live:
        page.driver.get(live.address)
        page.until(lambda: page.text("word") == "File" and page.driver.execute_script(ROWS) == 40)
        take.dress()
        for key in ("0", "+", "+", "+", "a", Keys.ARROW_LEFT, "b"):
            press(page, key)
        page.until(lambda: page["readout"].is_displayed())
        take("file")
        live.end()


def main() -> int:
    """Take them."""
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    folder = folder.resolve()
    with tempfile.TemporaryDirectory() as work, chdir(work), browser(folder) as page:
        take = Taker(page, folder)
        prepare()
        session(page, take)
        recorded(page, take)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
