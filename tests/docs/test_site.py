"""Every page of the site in headless Chromium: what it asks for, what is too wide, what cannot be read."""

from collections.abc import Iterator
from pathlib import Path
from urllib.parse import quote

import page_looks
import pytest
from effort import NIGHTLY
from live_browser import Browser

EACH = 1 if NIGHTLY else 4
"""Of the generated pages, which are made alike, every fourth; at night all."""
READ = (
    "how",
    "reference/settings",
    *(("cli", "live", "search", "index") if NIGHTLY else ()),
)
"""Pages that axe-core looks at, which takes some seconds each."""

SIDEWAYS = """
const inner = (e) => {
  for (let p = e.parentElement; !p.matches(".content, body"); p = p.parentElement)
    if (getComputedStyle(p).overflowX !== "visible") return true;
  return false;
};
const beyond = (e) => e.getBoundingClientRect().right > document.documentElement.clientWidth + 1;
return [...document.querySelectorAll(".main *")]
  .filter((e) => e.checkVisibility() && !e.closest("aside") && beyond(e) && !inner(e))
  .map((e) => `${e.tagName} ${e.className}: ${e.textContent.trim().slice(0, 40)}`);"""
"""What is wider than the window, and in no box that scrolls: the theme lets the whole text scroll sideways then."""

BARE = "return [...document.images].filter((e) => !e.complete || !e.naturalWidth || !e.alt).map((e) => e.src);"
"""Pictures that are not there, or say nothing to who cannot see them."""

CHECKS = {"sideways": SIDEWAYS, "bare": BARE}


@pytest.fixture
def opened(chromium: Browser) -> Iterator[Browser]:
    chromium.reset()
    yield chromium
    chromium.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def go(opened: Browser, site: Path, page: str) -> None:
    """Open a page, given by its path in the folder, with a query or an anchor."""
    opened.driver.get(f"{site.resolve().as_uri()}/{page}")


def pages(folder: Path) -> list[str]:
    """Return the pages to open."""
    written = sorted(path.name for path in folder.glob("*.html"))
    return (
        written
        + sorted(f"reference/{path.name}" for path in (folder / "reference").glob("*.html"))[::EACH]
    )


def test_each_page_is_whole_at_a_desk_and_on_a_phone(opened: Browser, site: Path) -> None:
    """Nothing is asked for elsewhere, nothing fails; only tables, code and formulas scroll sideways."""
    inside = site.resolve().as_uri()
    wrong: list[tuple[object, ...]] = []
    for page in pages(site):
        go(opened, site, page)
        asked = opened.requests() - {"about:blank"}
        assert asked
        wrong += [(page, "console", line) for line in opened.complaints()]
        wrong += [
            (page, "asks for", each) for each in asked if not each.startswith((inside, "blob:"))
        ]
        for name in ("desk", "phone"):
            opened.size(name)
            wrong += [
                (page, name, check, found)
                for check, script in CHECKS.items()
                for found in opened.run(script)
            ]
    assert wrong == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_everyone_can_read_it(opened: Browser, site: Path, scheme: str) -> None:
    wanted = {"features": [{"name": "prefers-color-scheme", "value": scheme}]}
    opened.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", wanted)
    for page in READ:
        go(opened, site, f"{page}.html")
        assert page_looks.audit(opened.driver) == [], page
    dark = opened.run("return getComputedStyle(document.body).backgroundColor") == "rgb(19, 20, 22)"
    assert dark == (scheme == "dark")


WORDS = {"stiffness": "glossary", "microcontroller": "embedded", "permission denied": "kit", "CUSUM": "glossary", "Excel": "import",
         "calibration": "researcher", "Windows": "kit", "licence": "citing"}  # fmt: skip
"""What is typed, and a page that has to be among the first five results."""
FOUND = "return [...document.querySelectorAll('#search-results ul.search li > a')].map((a) => a.getAttribute('href'));"
ENDED = "return /finished|did not match/.test(document.querySelector('#search-results .search-summary')?.textContent);"


def found(opened: Browser, site: Path, words: str) -> list[str]:
    """Return the pages that the search shows for what is typed into its field, the best first."""
    go(opened, site, f"search.html?q={quote(words)}")
    opened.until(lambda: opened.run(ENDED))
    pages = [href.split("?")[0].split("#")[0].removesuffix(".html") for href in opened.run(FOUND)]
    return list(dict.fromkeys(pages))[:5]


def test_the_search_finds_what_people_type(opened: Browser, site: Path) -> None:
    assert {
        words: pages
        for words, page in WORDS.items()
        if page not in (pages := found(opened, site, words))
    } == {}
    assert found(opened, site, "flugelhorn") == []
