"""The page of docs/try in headless Chromium: made, opened as a file, given files and a serial port.

python tests/tools/try_page.py FOLDER      the page, and its screenshots: light, dark, phone, a recording, a refusal, a port
"""

import base64
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import palpate
from live_browser import Browser, browser
from numpy.typing import NDArray
from page_states import SIZES, sized
from palpate.live.feed import FIELDS
from project import ROOT, need

LONG_MS = 26.0
"""From line to line, as the recording of the tests has it."""
TOOLS = ("clang++", "wasm-ld", "esbuild")
NAMES = ("t", "hard", "soft", "ratio", "error", "statistic")
"""Columns of the page, in the order of `FIELDS`."""

DROP = """
const [files] = arguments, carried = new DataTransfer();
for (const [name, content] of files) carried.items.add(new File([Uint8Array.from(atob(content), (c) => c.charCodeAt(0))], name));
document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: carried, bubbles: true, cancelable: true }));
"""
PORT = """
Object.defineProperty(Navigator.prototype, "serial", { configurable: true, get: () => fake.serial });
const fake = (globalThis.fake = {
  opened: null, closed: false, chosen: true, now: 1000,
  serial: { requestPort: async () => { if (!fake.chosen) throw new DOMException("No port selected by the user.", "NotFoundError"); return fake.port; } },
  port: {
    readable: null,
    getInfo: () => ({ usbVendorId: 0x2341, usbProductId: 0x43 }),
    async open(options) { if (fake.busy) throw new DOMException("Failed to open serial port.", "NetworkError"); fake.opened = options; fake.closed = false; fake.stream(); },
    async close() { if (fake.closed || !this.readable) throw new DOMException("The port is already closed.", "InvalidStateError"); fake.closed = true; this.readable = null; },
  },
  stream() { fake.port.readable = new ReadableStream({ start: (control) => (fake.control = control) }); },
  send(text) { fake.control.enqueue(new TextEncoder().encode(text)); },
  break(name) { const { control } = fake; fake.stream(); control.error(new DOMException("of the line", name)); },
  lose() { const { control } = fake; fake.port.readable = null; control.error(new DOMException("The device has been lost.", "NetworkError")); },
});
performance.now = () => fake.now; // a line arrives when the test says so
"""
FEED = """
const [lines, step, done] = arguments;
(async () => {
  for (const [number, line] of lines.entries()) {
    fake.now += step;
    fake.send(line);
    for (let k = 0; k < 30; k++) await null; // the page takes it
    if (number % 50 === 49) await new Promise((next) => setTimeout(next)); // and draws
  }
})().then(done);
"""
COLUMN = """
const { store } = palpate, of = arguments[0], values = of === "flags" ? store.flags : store.columns[of];
const bytes = new Uint8Array(values.buffer, 0, store.used * values.BYTES_PER_ELEMENT);
let text = "";
for (let k = 0; k < bytes.length; k += 4096) text += String.fromCharCode(...bytes.subarray(k, k + 4096));
return btoa(text);
"""


def made(folder: Path) -> Path:
    """Make the page in a folder."""
    for tool in TOOLS:
        need(tool)
    out = folder / "palpate-try.html"
    command = [sys.executable, str(ROOT / "docs" / "try" / "bundle.py"), str(out)]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", check=False)
    assert done.returncode == 0, done.stderr
    return out


def labelled(path: Path) -> list[str]:
    """Return the readings of a recording as a microcontroller would send them."""
    got = palpate.read(path)
    columns = zip(1e3 * got.t_hard_s, 1e3 * got.t_soft_s, got.hard, got.soft, strict=True)
    return [
        f"t_hard_ms:{a:.0f},t_soft_ms:{b:.0f},hard:{hard:.7f} pF,soft:{soft:.7f} pF" for a, b, hard, soft in columns
    ]


class Trial:
    """The page in a browser.

    Parameters
    ----------
    page : Browser
    path : pathlib.Path
        Of the page.
    """

    def __init__(self, page: Browser, path: Path) -> None:
        self.page, self.address = page, path.as_uri()
        self.script = page.driver.execute_script

    def open(self, *, port: bool = False, script: str = "") -> None:
        """Open it, with a fake serial port or another script before its own, and wait for the simulated touches."""
        given = {"source": PORT if port else script}
        added = self.page.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", given)
        self.page.driver.get("about:blank")  # a page that measures asks before it is left
        self.page.driver.get(self.address)
        self.page.driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", added)
        self.page.until(lambda: self.page.text("word") == "Demo" and self.count > 0)

    @property
    def count(self) -> int:
        """Touches in the table."""
        return int(self.script("return document.querySelectorAll('#rows tr[data-touch]').length"))

    def drop(self, *paths: Path, **named: bytes) -> None:
        """Drop files; or contents, by name: run_csv=b"..."."""
        files = {path.name: path.read_bytes() for path in paths}
        files |= {name.replace("_", "."): content for name, content in named.items()}
        self.script(DROP, [[name, base64.b64encode(content).decode()] for name, content in files.items()])

    def refusal(self) -> str:
        """Wait for the sentence over the page, and close it."""
        self.page.until(lambda: self.script("return document.getElementById('said').open"))
        title, text = self.page.text("saidtitle"), self.page.text("saidtext")
        self.script("document.getElementById('said').close()")
        return f"{title}: {text}"

    def press(self, name: str) -> None:
        """Press a button."""
        self.script("document.getElementById(arguments[0]).click()", name)

    def feed(self, lines: list[str], step_ms: float) -> None:
        """Let lines arrive at the port, one in each so many ms of the page's clock."""
        self.page.driver.set_script_timeout(60)
        self.page.driver.execute_async_script(FEED, [f"{line}\n" for line in lines], step_ms)

    def wait(self, word: str) -> None:
        """Let the page's clock run until it says a word."""

        def said() -> bool:
            self.script("fake.now += 300")
            return self.page.text("word") == word

        self.page.until(said)

    def drawn(self) -> Any:
        """Return what was drawn."""
        wait = "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(done));"
        self.page.driver.execute_async_script(wait)
        return self.script("return palpate.charts.geometry()")

    def column(self, name: str) -> NDArray[Any]:
        """Return a column of the rows that are shown."""
        kind = "u1" if name == "flags" else "<f8"
        return np.frombuffer(base64.b64decode(self.script(COLUMN, name)), kind)

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return all columns, by the names of `palpate.live.feed`."""
        return {field: self.column(name) for field, name in zip((*FIELDS, "flags"), (*NAMES, "flags"), strict=True)}


def shots(trial: Trial, folder: Path) -> None:
    """Take the screenshots."""
    recording = ROOT / "tests" / "data" / "four-specimens.csv"

    def shoot(name: str, size: str = "desk", theme: str = "light", down: int = 0) -> None:
        sized(trial.page, *SIZES[size])
        trial.page.theme(theme)
        trial.script("scrollTo(0, arguments[0])", down)
        trial.drawn()
        trial.page.shoot(folder / f"try-{name}.png")

    trial.open(port=True)
    shoot("light")
    shoot("dark", theme="dark")
    shoot("phone", "phone", "dark")
    shoot("phone-end", "phone", down=9999)
    shoot("tablet", "tablet")
    trial.drop(recording)
    trial.page.until(lambda: trial.page.text("word") == "File")
    shoot("file")
    trial.drop(table_csv=b"time,left,right\n0,1,2\n")
    trial.page.until(lambda: trial.script("return document.getElementById('said').open"))
    shoot("refused")
    trial.refusal()
    trial.press("connect")
    trial.page.until(lambda: trial.script("return Boolean(fake.opened)"))
    trial.feed(labelled(recording)[:600], LONG_MS)
    trial.page.until(lambda: trial.count > 0)
    shoot("port")
    trial.script("fake.lose()")
    trial.page.until(lambda: "The port is gone." in trial.page.text("says"))
    shoot("lost")


def main() -> int:
    """Make the page and the screenshots."""
    folder = Path(sys.argv[1]).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    path = made(folder)
    with browser(folder) as page:
        shots(Trial(page, path), folder)
    print(f"{path}: {path.stat().st_size:,} bytes")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
