"""The page for a browser alone, in Chromium, as a file: what it shows, opens and refuses; no request leaves it."""

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
from selenium.webdriver.common.keys import Keys

FILES = {path.name: path.read_bytes() for path in (FOUR, FOUR.with_suffix(".json"))}

DROP = """
const [files] = arguments, carried = new DataTransfer();
for (const [name, content] of files) carried.items.add(new File([Uint8Array.from(atob(content), (c) => c.charCodeAt(0))], name));
document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: carried, bubbles: true, cancelable: true }));
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make the page."""
    for tool in ("clang++", "wasm-ld", "esbuild"):
        need(tool)
    path = tmp_path_factory.mktemp("try") / "palpate-try.html"
    path.write_bytes(bundle.page())
    return path


def test_styles_that_the_page_has_no_place_for_are_left_out() -> None:
    style = (
        "#a,.b.c,:is(#x) d{e:1}#x,#a .gone{f:2}@media (g:1){#x h{i:3}#a{j:4}}@import url(k.css);"
    )
    kept = bundle.without_unused(style, '<p id="a" class="b c">', "")
    assert kept == "#a,.b.c,:is(#x) d{e:1}@media (g:1){#a{j:4}}@import url(k.css);"
    nested = '<div id="a"><div></div></div><div id="b"></div>'
    assert bundle.part_of(nested, "div", "a") == '<div id="a"><div></div></div>'


@pytest.fixture
def page(chromium: Browser, file: Path) -> Iterator[Browser]:
    """Return the page; nothing in it may have failed, and it may have requested nothing."""
    opened(chromium, file)
    yield chromium
    assert chromium.complaints() == []
    assert chromium.requests() <= {file.as_uri(), "about:blank"}
    assert chromium.run("return [localStorage.length, sessionStorage.length, document.cookie]") == [
        0,
        0,
        "",
    ]


def opened(chromium: Browser, file: Path) -> None:
    """Open the page, and wait for the simulated touches."""
    chromium.reset()
    added = chromium.driver.execute_cdp_cmd(
        "Page.addScriptToEvaluateOnNewDocument",
        {"source": "localStorage.clear()"},  # all files are one origin
    )
    chromium.driver.get(file.as_uri())
    chromium.driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", added)
    chromium.until(lambda: chromium.text("page") == "Touch 2 of 2")


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


def test_it_is_small_and_the_same_sources_give_the_same_bytes(file: Path) -> None:
    assert file.stat().st_size < bundle.MOST_BYTES
    assert bundle.page() == file.read_bytes()


def test_the_simulated_touches_are_drawn(page: Browser) -> None:
    """The columns that the page has left out of its recording are those that the checksum wants."""
    assert page.text("says").startswith("● This is a simulation.")
    rows = page.run("return palpate.known.touches.rows")
    assert page.text("value") == number_format.number(rows[-1]["ratio"], rows[-1]["uncertainty"])
    page.press("3")
    assert page.text("number") == number_format.number(rows[-1]["ratio"], rows[-1]["uncertainty"])
    page.drawn()
    assert page.run("return palpate.charts.overview.points") > 50
    assert page.run("return palpate.charts.detail.points") > 200


def test_a_recording_is_shown_with_the_numbers_of_palpate(page: Browser) -> None:
    drop(page, FILES)
    page.until(lambda: page.text("page") == "Touch 4 of 4")
    touches = palpate.touches(FOUR)
    assert ratios(page) == [touch.ratio for touch in touches]
    assert "A recording: complete, clean end, 1411 rows, 0 missing." in page.text("says")
    for touch in touches[::-1]:
        known = palpate.Uncertainty.of(touch).uncertainty
        assert page.text("value") == number_format.number(touch.ratio, known)
        low, high = (
            number_format.number(touch.ratio + sign * 1.96 * known, known) for sign in (-1, 1)
        )
        assert page.text("between") == f"between {low} and {high}"
        page.press(Keys.ARROW_LEFT)
    assert page.text("page") == f"Touch 1 of {len(touches)}"
    page.press("2")
    assert page.text("storytitle") == "Touch 1"
    assert f"{touches[0].samples} pairs in" in page.text("storyfacts")
    assert page.text("storyresult").endswith(
        number_format.plus_minus(touches[0].ratio, palpate.Uncertainty.of(touches[0]).uncertainty)
    )
    page.press("1")
    assert page.run("return palpate.store.used") == 1411
    drop(page, {"run.csv": FILES[FOUR.name][:-9], "run.json": FILES["four-specimens.json"]})
    assert "run.csv is not as it was" in refusal(page)
    assert ratios(page) == [touch.ratio for touch in touches]


def test_no_request_could_be_made(chromium: Browser, file: Path) -> None:
    opened(chromium, file)
    ask = "fetch(arguments[0]).then(() => arguments[1]('allowed'), () => arguments[1]('refused'))"
    assert chromium.driver.execute_async_script(ask, file.as_uri()) == "refused"
    assert any("Content Security Policy" in text for text in chromium.complaints())


@pytest.mark.parametrize("size", ["desk", "phone"])
def test_looks(page: Browser, size: str) -> None:
    page.size(size)
    for theme, key in (("light", "1"), ("dark", "2"), ("light", "3"), ("dark", "3")):
        page.theme(theme)
        page.press(key)
        page.drawn()
        checks = page_looks.CHECKS | ({"small": page_looks.SMALL} if size == "phone" else {})
        assert {
            what: found for what, script in checks.items() if (found := page.run(script))
        } == {}, (theme, key)
        assert page_looks.audit(page.driver) == []
