"""The picture of a report for docs: its first page on paper.

python tests/tools/report_picture.py FOLDER      writes report.png
"""

import sys
import tempfile
from pathlib import Path

from live_browser import browser
from palpate import report
from report_session import calibrated, specimens

PAPER = (794, 1123)  # A4 at 96 pixels an inch


def main() -> int:
    """Take it."""
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name, browser(folder, PAPER) as page:
        work = Path(name)
        probe, moduli = calibrated(work), work / "ten" / "moduli.csv"
        written = report.write(
            work / "r.html", [*specimens(work), work / "gel" / "gel.csv"], probe, moduli=moduli,
            title="ten specimens, one gel", operator="A. Bee", notes=["left hand"],
        )  # fmt: skip
        page.driver.get(written.path.as_uri())
        page.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
        page.driver.execute_script("document.body.style.padding = '60px'")  # the margins of the sheet
        page.driver.execute_cdp_cmd("Emulation.setScrollbarsHidden", {"hidden": True})
        size = {"width": PAPER[0], "height": PAPER[1], "deviceScaleFactor": 1, "mobile": False}
        page.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        page.shoot(folder / "report.png")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
