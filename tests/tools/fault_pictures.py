"""Pictures of Measure in each fault, as they are, and as an eye of 20/30 sees them from 2 m: look at them.

python tests/tools/fault_pictures.py FOLDER      writes NAME.png and NAME-far.png for each case of `CASES`, and prints what is in them.
"""

import signal
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import page_looks
from faulty_tables import jumped
from live_browser import Browser, browser
from live_server import SOURCE, Live
from page_data import state
from page_states import Canned, opened

KIND = "return palpate.known.state.line?.what"
SHORTED = ",".join(f"excitation-shorted:2@{4 + 0.3 * k:.1f}" for k in range(6))
FORCED = "return document.getElementById('tare').dataset.do === 'tare anyway'"


def shot(page: Browser, folder: Path, name: str) -> None:
    """Take a picture, and the one from 2 m."""
    page.drawn()
    path = folder / f"{name}.png"
    page.driver.save_screenshot(str(path))
    page_looks.blurred(path).save(folder / f"{name}-far.png")
    shown = {one: page.text(one) for one in ("verb", "reason", "remedyhow", "value", "between")}
    print(name, {one: text for one, text in shown.items() if text})


def wait_for(*kinds: str) -> Callable[[Browser, Live], None]:
    """Return a step that waits for one of these kinds of the status line."""
    return lambda page, _: page.until(lambda: page.run(KIND) in kinds)


def tare_in_contact(page: Browser, _: Live) -> None:
    """Press Tare, and Tare anyway, while the probe is pressed."""
    page.until(lambda: page.text("verb") == "Hold")
    page.press("t")
    page.until(lambda: page.run(FORCED))
    page.press("t")
    page.until(lambda: page.run(KIND) == "baseline")


def kill(page: Browser, live: Live) -> None:
    """Kill the server."""
    page.until(lambda: page.text("verb") == "Hold")
    live.end(signal.SIGKILL)
    page.until(lambda: page.text("verb") == "Offline")


CASES: dict[str, tuple[str, Callable[[Browser, Live], None]]] = {
    "unplugged": (f"{SOURCE}&fault=unplug:30@4", wait_for("unplugged")),
    "saturated": (f"{SOURCE}&fault=overload:5@4", wait_for("saturated")),
    "wire-off": (f"{SOURCE}&idle=20&fault=wire-off:2@4", wait_for("wiring")),
    "outliers": (f"{SOURCE}&fault={SHORTED}", wait_for("left out", "done", "after")),
    "slept": (f"{SOURCE}&fault=sleep:3600@6", wait_for("gap")),
    "tare-in-contact": (SOURCE, tare_in_contact),
    "killed-server": (SOURCE, kill),
}


def main(folder: Path) -> None:
    """Take all pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as work, browser(folder) as page:
        cases = dict(CASES)
        cases["jumped"] = (f"{jumped(Path(work))}?speed=1", wait_for("news"))
        for name, (source, step) in cases.items():
            with Live(source=source) as live:
                page.driver.get(live.address)
                page.until(lambda: page.text("verb"))
                step(page, live)
                shot(page, folder, name)
        for name in (
            "slow",
            "flagged",
            "contact",
            "idle",
        ):  # no fault of this computer can be ordered
            with Canned(state(name)) as server:
                opened(page, server, name, depth="measure")
                shot(page, folder, name)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
