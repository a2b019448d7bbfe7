"""The page for a browser alone, in Chromium, as a file: what it shows, opens, refuses and measures; no request leaves it."""

import base64
from collections.abc import Iterator
from pathlib import Path

import bundle
import page_looks
import palpate
import pytest
from live_browser import Browser
from palpate import number_format
from project import FOUR, need

FILES = {path.name: path.read_bytes() for path in (FOUR, FOUR.with_suffix(".json"))}
LONG_MS = 26.0
"""From line to line, as the recording has it."""

DROP = """
const [files] = arguments, carried = new DataTransfer();
for (const [name, content] of files) carried.items.add(new File([Uint8Array.from(atob(content), (c) => c.charCodeAt(0))], name));
document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: carried, bubbles: true, cancelable: true }));
"""
PORT = """
Object.defineProperty(Navigator.prototype, "serial", { configurable: true, get: () => fake.serial });
const fake = (globalThis.fake = {
  opened: null, now: 1000,
  serial: { requestPort: async () => fake.port },
  port: {
    readable: null,
    getInfo: () => ({ usbVendorId: 0x2341, usbProductId: 0x43 }),
    async open(options) { fake.opened = options; fake.stream(); },
    async close() { this.readable = null; },
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
    fake.send(`${line}\\n`);
    for (let k = 0; k < 30; k++) await null; // the page takes it
    if (number % 50 === 49) await new Promise((next) => setTimeout(next)); // and draws
  }
})().then(done);
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make the page."""
    for tool in ("clang++", "wasm-ld", "esbuild"):
        need(tool)
    path = tmp_path_factory.mktemp("try") / "palpate-try.html"
    path.write_bytes(bundle.page())
    return path


@pytest.fixture
def page(chromium: Browser, file: Path) -> Iterator[Browser]:
    """Return the page with a fake serial port; nothing may have failed in it, and nothing may have been asked for."""
    opened(chromium, file, PORT)
    yield chromium
    assert chromium.complaints() == []
    assert chromium.requests() <= {file.as_uri(), "about:blank"}
    assert chromium.run("return [localStorage.length, sessionStorage.length, document.cookie]") == [
        0,
        0,
        "",
    ]


def opened(chromium: Browser, file: Path, script: str) -> None:
    """Open the page, with a script before its own, and wait for the simulated touches."""
    chromium.reset()
    added = chromium.driver.execute_cdp_cmd(
        "Page.addScriptToEvaluateOnNewDocument",
        {"source": f"localStorage.clear(); {script}"},  # all files are one origin
    )
    chromium.driver.get(file.as_uri())
    chromium.driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", added)
    chromium.until(lambda: chromium.text("word") == "Demo")


def drop(page: Browser, files: dict[str, bytes]) -> None:
    page.run(DROP, [[name, base64.b64encode(content).decode()] for name, content in files.items()])


def refusal(page: Browser) -> str:
    """Wait for the sentence over the page, and close it."""
    page.until(lambda: page.run("return document.getElementById('said').open"))
    said = f"{page.text('saidtitle')}: {page.text('saidtext')}"
    page.run("document.getElementById('said').close()")
    return said


def ratios(page: Browser) -> list[float]:
    return list(page.run("return palpate.known.touches.rows.map(({ ratio }) => ratio)"))


def feed(page: Browser, lines: list[str]) -> None:
    page.driver.execute_async_script(FEED, lines, LONG_MS)


def test_it_is_small_and_the_same_sources_give_the_same_bytes(file: Path) -> None:
    assert file.stat().st_size < bundle.MOST_BYTES
    assert bundle.page() == file.read_bytes()


def test_the_simulated_touches_are_drawn(page: Browser) -> None:
    assert page.text("says").startswith("● This is a simulation.")
    rows = page.run("return palpate.known.touches.rows")
    assert page.text("number") == number_format.number(rows[-1]["ratio"], rows[-1]["uncertainty"])
    page.drawn()
    assert page.run("return palpate.charts.overview.points") > 50
    assert page.run("return palpate.charts.detail.points") > 200


def test_a_recording_is_shown_with_the_numbers_of_palpate(page: Browser) -> None:
    drop(page, FILES)
    page.until(lambda: page.text("sub") == FOUR.name)
    touches = palpate.touches(FOUR)
    assert ratios(page) == [touch.ratio for touch in touches]
    assert "A recording: complete, clean end, 1411 rows, 0 missing." in page.text("says")
    assert page.text("number") == number_format.number(
        touches[-1].ratio, palpate.Uncertainty.of(touches[-1]).uncertainty
    )
    assert page.run("return palpate.store.used") == 1411
    drop(page, {"run.csv": FILES[FOUR.name][:-9], "run.json": FILES["four-specimens.json"]})
    assert "run.csv is not as it was" in refusal(page)
    assert ratios(page) == [touch.ratio for touch in touches]


def test_a_port_is_measured_live_until_it_is_gone(page: Browser) -> None:
    got = palpate.read(FOUR)
    columns = zip(1e3 * got.t_hard_s, 1e3 * got.t_soft_s, got.hard, got.soft, strict=True)
    lines = [f"t_hard_ms:{a:.0f},t_soft_ms:{b:.0f},hard_pF:{hard:.7f},soft_pF:{soft:.7f}" for a, b, hard, soft in columns]  # fmt: skip
    page.click("connect")
    page.until(lambda: page.run("return fake.opened") == {"baudRate": 115200, "bufferSize": 65536})
    feed(page, ["rst:0x1 (POWERON_RESET)", *lines[:200]])
    page.until(lambda: page.text("word") == "Hold")
    page.click("tare")
    assert "Lift the probe" in page.text("answer")
    feed(page, lines[200:])
    expected = [touch.ratio for touch in palpate.touches(FOUR)]
    page.until(lambda: len(ratios(page)) == len(expected))
    assert ratios(page) == pytest.approx(expected, rel=1e-3)
    drop(page, FILES)  # not while a port is open
    assert "Disconnect it first" in refusal(page)
    page.run("fake.break('FramingError')")
    page.until(lambda: "FramingError" in page.text("answer"))
    page.run("fake.now += 4000")
    page.until(lambda: page.text("says").startswith("✕ No data."))
    page.run("fake.lose()")
    page.until(lambda: page.text("says").startswith("✕ The port is gone."))
    page.until(lambda: "Connect" in page.text("connect"))
    assert "stays here" in page.text("says")


def test_a_browser_without_serial_ports_says_so_and_no_request_could_be_made(
    chromium: Browser, file: Path
) -> None:
    opened(chromium, file, "delete Navigator.prototype.serial")
    assert not chromium["connect"].is_enabled()
    assert "no access to serial ports" in chromium.text("noport")
    ask = "fetch(arguments[0]).then(() => arguments[1]('allowed'), () => arguments[1]('refused'))"
    assert chromium.driver.execute_async_script(ask, file.as_uri()) == "refused"
    assert any("Content Security Policy" in text for text in chromium.complaints())


@pytest.mark.parametrize("size", ["desk", "phone"])
def test_looks(page: Browser, size: str) -> None:
    page.size(size)
    for theme in ("light", "dark"):
        page.theme(theme)
        checks = page_looks.CHECKS | ({"small": page_looks.SMALL} if size == "phone" else {})
        assert {
            what: found for what, script in checks.items() if (found := page.run(script))
        } == {}, theme
    assert page_looks.audit(page.driver) == []
