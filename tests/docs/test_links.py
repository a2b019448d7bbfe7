"""Every page reads the same in the repository and on the site: plain Markdown, whose links lead somewhere."""

import re
from pathlib import Path
from urllib.parse import unquote

import pytest
from project import ROOT

from docs.generator.markdown import headings

FOLDERS = (".", "docs", "docs/reference", "bench", "release/arduino")
PAGES = [path for folder in FOLDERS for path in sorted((ROOT / folder).glob("*.md"))]
each = pytest.mark.parametrize(
    "path", [pytest.param(path, id=str(path.relative_to(ROOT))) for path in PAGES]
)
UNLISTED = {"index.md", "source.md"}
"""The page of the navigation; the map of the source, which only CONTRIBUTING.md needs."""
_CODE = re.compile(r"^ *(```+).*?^ *\1$|``.+?``|`[^`\n]+`", re.DOTALL | re.MULTILINE)
_LINK = re.compile(r"\]\((?![a-z]+:)([^()\s]+)\)")
_DIRECTIVE = re.compile(r"^ *```+\{.*|^:::.*|\{[a-z:+-]+\}`[^`]+`|^\.\. \w+::.*", re.MULTILINE)


def links(path: Path) -> list[str]:
    """Return the links of a page to other files and to its own headings."""
    return _LINK.findall(_CODE.sub("", path.read_text(encoding="utf-8")))


def broken(path: Path) -> list[str]:
    """Return the links of a page that lead nowhere."""
    found = []
    for link in links(path):
        name, _, anchor = unquote(link).partition("#")
        target = (path.parent / name) if name else path
        if not target.exists():
            found.append(link)
        elif anchor and target.suffix == ".md":
            places = [place for _, place in headings(target.read_text(encoding="utf-8"))]
            if anchor not in places:
                found.append(link)
    return found


@each
def test_every_link_leads_somewhere(path: Path) -> None:
    assert broken(path) == []


@each
def test_no_page_has_a_directive(path: Path) -> None:
    found = [match[0] for match in _DIRECTIVE.finditer(path.read_text(encoding="utf-8"))]
    assert found == []


def test_every_page_is_in_the_navigation() -> None:
    listed = set(links(ROOT / "docs" / "index.md"))
    pages = {path.name for path in (ROOT / "docs").glob("*.md")} - UNLISTED
    pages |= {f"reference/{path.name}" for path in (ROOT / "docs" / "reference").glob("*.md")}
    assert pages - listed == set()


def test_what_is_wrong_is_found(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# One `b`\n[a](#one-b) [b](#two) [c](gone.md) `[d](no.md)` [e](https://x.y)\n")
    assert broken(page) == ["#two", "gone.md"]
    for text in ("```{index} a\n```", "see {term}`ratio`", ".. autosummary::"):
        assert _DIRECTIVE.search(text), text
    assert not _DIRECTIVE.search("```python\n{a}\n```")
