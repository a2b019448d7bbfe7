"""Every page of the site in headless Chromium: what it asks for, what is cut, what is too wide, what cannot be read."""

from pathlib import Path

import pytest
from effort import NIGHTLY
from project import need_package
from site_browser import CHECKS, SIZES, Site

EACH = 1 if NIGHTLY else 10
"""Of the pages of the API, which are made alike, every tenth; at night all."""
READ = ("how", "api/palpate.Tracker", *(("cli", "live", "search", "genindex", "index") if NIGHTLY else ()))
"""Pages that axe-core looks at, which takes some seconds each."""

WRONG = """<p style="width: 500px">wide</p><img src="nothing.png">
<p style="width: 3em; overflow: hidden; white-space: nowrap">hypersensitive</p>"""
CLIPS = "<style>.math-wrapper { padding: 0 } math { font-family: serif }</style>"
"""As the theme has it, on a system without a font for formulas."""


def pages(folder: Path) -> list[str]:
    """Return the pages to open."""
    written = sorted(path.name for path in folder.glob("*.html"))
    return written + sorted(f"api/{path.name}" for path in (folder / "api").glob("*.html"))[::EACH]


def test_each_page_is_whole_at_a_desk_and_on_a_phone(opened: Site) -> None:
    """Nothing is asked for elsewhere, nothing fails; nothing is cut; only tables, code and formulas scroll sideways."""
    inside, formulas = opened.folder.resolve().as_uri(), 0
    wrong: list[tuple[object, ...]] = []
    for page in pages(opened.folder):
        opened.open(page)
        said, asked = opened.heard()
        wrong += [(page, "console", line) for line in said]
        wrong += [(page, "asks for", each) for each in asked if not each.startswith((inside, "data:", "blob:"))]
        assert asked
        has_formulas = opened.run("return document.querySelectorAll('.math-wrapper').length > 0")
        formulas += has_formulas
        for name, size in SIZES.items():
            opened.sized(*size)
            wrong += [(page, name, check, found) for check, script in CHECKS.items() for found in opened.run(script)]
            if has_formulas and opened.hides_formulas():
                wrong.append((page, name, "a formula is cut"))
    assert wrong == []
    assert formulas >= 3


def test_what_the_checks_find(opened: Site) -> None:
    """Each check finds a page that is made wrong."""
    opened.sized(*SIZES["phone"])
    opened.open("how.html")
    assert [opened.run(script) for script in CHECKS.values()] == [[], [], []]
    opened.run(f"document.querySelector('article').insertAdjacentHTML('beforeend', `{WRONG}`)")
    for script in CHECKS.values():
        assert opened.run(script)
    opened.open("how.html")
    assert not opened.hides_formulas()
    opened.run(f"document.head.insertAdjacentHTML('beforeend', `{CLIPS}`)")
    assert opened.hides_formulas()


def test_formulas_have_their_font(opened: Site, site: Path) -> None:
    """Every character of every formula is in the font: another font would have other heights, or none of the braces."""
    need_package("fontTools")
    from fontTools.ttLib import TTFont
    from formula_font import characters

    font = TTFont(site / "_static" / "formulas.woff")
    used = characters(path.read_text(encoding="utf-8") for path in site.rglob("*.html"))
    assert "\N{MATHEMATICAL ITALIC SMALL R}" in used
    assert {c for c in used if ord(c) not in font.getBestCmap()} == set()
    assert "MATH" in font
    opened.open("how.html")
    loaded = "return document.fonts.ready.then((all) => [...all].map((face) => [face.family, face.status]))"
    assert opened.run(loaded) == [["palpate formulas", "loaded"]]


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_everyone_can_read_it(opened: Site, scheme: str) -> None:
    need_package("axe_core_python")
    opened.sized(*SIZES["desk"])
    opened.coloured(scheme)
    for page in READ:
        opened.open(f"{page}.html")
        assert opened.audit() == [], page
    dark = opened.run("return getComputedStyle(document.body).backgroundColor") == "rgb(19, 20, 22)"
    assert dark == (scheme == "dark")
