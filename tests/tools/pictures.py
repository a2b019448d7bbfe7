"""The pictures for docs, of the live page and of a report, from a session of ten simulated specimens.

python tests/tools/pictures.py      writes live-light, -dark, -phone, -done, -file.png, and report.png, a first page on paper, to
docs/images; and gives the other pictures of the project that are larger than `MOST_BYTES` fewer colours.
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
from project import ROOT
from selenium.webdriver.common.keys import Keys

IMAGES, MOST_BYTES = ROOT / "docs" / "images", 100_000
SESSION_S = 400  # of ten specimens
PLAN = "\n".join(f"{name}; {modulus}" for name, modulus in SORBOTHANE_MPA.items())
COMMANDS = (
    "simulate -o specimens",
    "simulate -o gel --object gel=1.1 --seed 7",
    "calibrate specimens/*.csv --moduli specimens/moduli.csv -o probe.toml",
    (
        "report specimens/*.csv gel/gel.csv --calibration probe.toml --moduli specimens/moduli.csv -o r.html "
        "--title 'ten specimens, one gel' --operator 'A. Bee' --note 'left hand'"
    ),
    "record sim:ten-specimens?seed=3 -o ten-specimens.csv --touches 40",  # played, it is never late, on a busy machine either
)
HALF = """const text = (id) => document.getElementById(id).textContent, share = parseFloat(document.getElementById("held").style.strokeDasharray);
return text("verb") === "Hold" && Number(text("readingof").split(" ").at(-1)) >= arguments[0] && share > 50 && share < 85
  && document.getElementById("line").dataset.level === "quiet";"""
"""Whether more than half of this touch, or of a later one, is done, and nothing is wrong."""


def take(page: Browser, path: Path) -> None:
    """Take a picture."""
    page.drawn()
    page.driver.save_screenshot(str(path))
    shrink(path, 128)


def shrink(path: Path, colours: int = 256) -> None:
    """Give a picture few colours, until it is small; it looks the same."""
    with Image.open(path) as picture:
        whole = picture.convert("RGB")
    whole.quantize(colours).save(path, optimize=True)
    if path.stat().st_size > MOST_BYTES:
        shrink(path, colours // 2)


def session(page: Browser, folder: Path) -> None:
    """Measure ten specimens: light, on a phone, and dark while they calibrate."""
    with Live(
        "--record", "run.csv", "--calibration", "probe.toml", source="ten-specimens.csv?speed=1"
    ) as live:
        page.driver.get(live.address)
        page.until(lambda: page.text("verb") in ("Touch", "Wait", "Hold"))
        page.choose("signals", "off")  # no flash in a picture
        page.press("p")
        fill = "document.getElementById(arguments[0]).value = arguments[1]"
        for name, text in {"list": PLAN, "title": "ten specimens"}.items():
            page.run(fill, name, text)
        page.all("#plan button.strong")[0].click()
        for name, size, theme, key, touch in (("light", "desk", "light", "", 10), ("phone", "phone", "light", "", 12), ("dark", "desk", "dark", "3k", 25)):  # fmt: skip
            page.size(size)
            page.theme(theme)
            page.press(*key)
            page.until(lambda touch=touch: page.run(HALF, touch), SESSION_S)
            take(page, folder / f"live-{name}.png")
        page.press("1")
        page.until(
            lambda: page.text("verb") == "Done" and "report ready" in page.text("says"), SESSION_S
        )
        take(page, folder / "live-done.png")
        live.end()


def recorded(page: Browser, folder: Path) -> None:
    """Open the recording, with both cursors."""
    with Live("--calibration", "probe.toml", source="run.csv") as live:
        page.driver.get(live.address)
        page.until(lambda: page.text("word") == "40")
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
    with tempfile.TemporaryDirectory() as work, chdir(work), browser(IMAGES) as page:
        for line in COMMANDS:
            subprocess.run(
                f"{sys.executable} -m palpate {line}", shell=True, check=True, capture_output=True
            )
        session(page, IMAGES)
        recorded(page, IMAGES)
        printed(page, IMAGES)
    for picture in (ROOT / "bench" / "results").glob("*.png"):
        if picture.stat().st_size > MOST_BYTES:
            shrink(picture)
