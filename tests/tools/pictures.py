"""The pictures for docs, of the live page and of a report, from a session of ten simulated specimens.

python tests/tools/pictures.py FOLDER      writes live-light, -dark, -phone, -file.png, and report.png, a first page on paper
"""

import subprocess
import sys
import tempfile
from contextlib import chdir
from pathlib import Path

from live_browser import Browser, browser
from live_server import Live
from palpate.elasticity import SORBOTHANE_MPA
from PIL import Image
from selenium.webdriver.common.keys import Keys

PLAN = "\n".join(f"{name}; {modulus}" for name, modulus in SORBOTHANE_MPA.items())
COMMANDS = (
    "simulate -o specimens",
    "simulate -o gel --object gel=1.1 --seed 7",
    "calibrate specimens/*.csv --moduli specimens/moduli.csv -o probe.toml",
    (
        "report specimens/*.csv gel/gel.csv --calibration probe.toml --moduli specimens/moduli.csv -o r.html "
        "--title 'ten specimens, one gel' --operator 'A. Bee' --note 'left hand'"
    ),
    "record sim:ten-specimens -o ten-specimens.csv --touches 40",  # played, it is never late, on a busy machine either
)
TOUCHES = "return document.querySelectorAll('#rows tr[data-touch]').length"
HALF = """const text = (id) => document.getElementById(id).textContent, share = parseFloat(document.querySelector("#bar b").style.width);
return text("word") === "Hold" && Number(text("mainname").split(" ").at(-1)) >= arguments[0] && share > 50 && share < 85
  && document.getElementById("line").dataset.level === "quiet";"""
"""Whether more than half of this touch, or of a later one, is done, and nothing is wrong."""


def take(page: Browser, path: Path) -> None:
    """Take a picture with 128 colours: the file is small, and looks the same."""
    page.drawn()
    page.driver.save_screenshot(str(path))
    with Image.open(path) as picture:
        few = picture.convert("RGB").quantize(128)
    few.save(path, optimize=True)


def session(page: Browser, folder: Path) -> None:
    """Measure ten specimens: light, on a phone, and dark while they calibrate."""
    with Live("--record", "run.csv", "--calibration", "probe.toml", source="ten-specimens.csv?speed=1") as live:
        page.driver.get(live.address)
        page.until(lambda: page.text("word") in ("Touch", "Wait", "Hold"))
        page.press("p")
        fill = "document.getElementById(arguments[0]).value = arguments[1]"
        for name, text in {"list": PLAN, "title": "ten specimens", "operator": "A. Bee"}.items():
            page.run(fill, name, text)
        page.all("#plan button.strong")[0].click()
        for name, size, theme, key, touch in (("light", "desk", "light", "", 10), ("phone", "phone", "light", "", 12), ("dark", "desk", "dark", "k", 25)):  # fmt: skip
            page.size(size)
            page.theme(theme)
            page.press(*key)
            page.until(lambda touch=touch: page.run(HALF, touch))
            take(page, folder / f"live-{name}.png")
        page.until(lambda: page.run(TOUCHES) == 40)
        live.end()


def recorded(page: Browser, folder: Path) -> None:
    """Open the recording, with both cursors."""
    with Live("--calibration", "probe.toml", source="run.csv") as live:
        page.driver.get(live.address)
        page.until(lambda: page.text("word") == "File" and page.run(TOUCHES) == 40)
        page.theme("light")
        page.press("0", "+", "+", "+", "a", Keys.ARROW_LEFT, "b")
        page.until(lambda: page["readout"].is_displayed())
        take(page, folder / "live-file.png")
        live.end()


def printed(page: Browser, folder: Path) -> None:
    """Open the report as it is on A4, at 96 pixels an inch."""
    size = {"width": 794, "height": 1123, "deviceScaleFactor": 1, "mobile": False}
    page.driver.get(Path("r.html").absolute().as_uri())
    for command, values in (("EmulatedMedia", {"media": "print"}), ("ScrollbarsHidden", {"hidden": True}), ("DeviceMetricsOverride", size)):  # fmt: skip
        page.driver.execute_cdp_cmd(f"Emulation.set{command}", values)
    page.run("document.body.style.padding = '60px'")  # the margins of the sheet
    take(page, folder / "report.png")


if __name__ == "__main__":
    folder = Path(sys.argv[1]).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as work, chdir(work), browser(folder) as page:
        for line in COMMANDS:
            subprocess.run(f"{sys.executable} -m palpate {line}", shell=True, check=True, capture_output=True)
        session(page, folder)
        recorded(page, folder)
        printed(page, folder)
