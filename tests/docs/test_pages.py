"""The pages of docs/: they build without a warning, every link leads somewhere, and every block of code is run."""

import doctest
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import click
import pytest
from bs4 import BeautifulSoup
from palpate.ad7746.evalkit.udev import UDEV_RULE
from palpate.cli.main import COMMANDS, palpate_command
from project import ROOT, compiles, need

DOCS = ROOT / "docs"
PAGES = sorted(DOCS.glob("*.md"))
LANGUAGES = {"python", "pycon", "console", "sh", "cpp", "toml", "text"}
_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_OUTPUT = doctest.OutputChecker()


def blocks(page: Path) -> list[tuple[str, str]]:
    """Return language and text of each block, in order."""
    return _BLOCK.findall(page.read_text(encoding="utf-8"))


def of(*languages: str) -> list[Any]:
    """Return the pages that have such blocks."""
    return [
        pytest.param(page, id=page.stem)
        for page in PAGES
        if {n for n, _ in blocks(page)} & set(languages)
    ]


class Page:
    """What a page refers to, and what may be referred to in it."""

    def __init__(self, path: Path) -> None:
        every = BeautifulSoup(path.read_text(encoding="utf-8"), "html.parser").find_all(True)
        self.ids = {
            str(tag[name]) for tag in every for name in ("id", "name") if tag.has_attr(name)
        }
        self.links = [
            str(tag[name]) for tag in every for name in ("src", "href", "data") if tag.get(name)
        ]


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[Path, Page]:
    return {path: Page(path) for path in site.rglob("*.html")}


def test_every_link_leads_somewhere(pages: dict[Path, Page]) -> None:
    checked = 0
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or link == "#":
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            assert target.is_file(), f"{path.name}: {link}"
            if parts.fragment and target in pages:
                assert unquote(parts.fragment) in pages[target].ids, f"{path.name}: {link}"
            checked += 1
    assert checked > 100


def test_the_site_has_its_navigation_and_the_page_for_a_browser(pages: dict[Path, Page]) -> None:
    [index] = [page for path, page in pages.items() if path.name == "index.html"]
    assert {"reference/commands.html", "live.html", "try.html"} <= set(index.links)
    [shown] = [page for path, page in pages.items() if path.name == "try.html"]
    made = any(path.name == "palpate-try.html" for path in pages)
    assert ("palpate-try.html" in shown.links) == made


def test_the_languages_are_those_that_are_tested() -> None:
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        opened = re.findall(r"^ *```\{?([\w-]+)", text, re.MULTILINE)
        assert len(opened) == len(blocks(page)) + text.count("```{"), page.name
        assert {name for name, _ in blocks(page)} <= LANGUAGES, page.name


@pytest.mark.parametrize("page", of("python", "pycon", "console"))
def test_a_page_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {"__name__": page.stem}
    for language, text in blocks(page):
        if language == "python":
            exec(compile(text, page.name, "exec"), names)  # noqa: S102 (what the test is for)
        elif language == "pycon":
            check_session(text, names, page.name)
        elif language == "console":
            check_console(text, tmp_path)


def check_session(text: str, names: dict[str, Any], name: str) -> None:
    """Run a Python session, compare what is printed."""
    test = doctest.DocTestParser().get_doctest(text, names, name, None, 0)
    assert test.examples
    report: list[str] = []
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    assert runner.run(test, out=report.append, clear_globs=False).failed == 0, "".join(report)
    names.update(test.globs)


def check_console(text: str, folder: Path) -> None:
    """Run the lines after a dollar, compare what is shown below each; all have to end with 0."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    for command, shown in re.findall(r"^\$ (.*)\n((?:(?!\$ ).*\n)*)", text, re.MULTILINE):
        done = subprocess.run(
            [need("bash"), "-euo", "pipefail", "-c", command],
            capture_output=True, encoding="utf-8", cwd=folder, env={**os.environ, "PATH": path}, check=False,
        )  # fmt: skip
        assert done.returncode == 0, (command, done.stdout, done.stderr)
        if shown:
            assert _OUTPUT.check_output(shown, done.stdout, doctest.ELLIPSIS), (
                f"{command}\n{done.stdout}"
            )


def test_how_it_works_is_short() -> None:
    """Its constants are on the page of the numbers."""
    assert len((DOCS / "how.md").read_text(encoding="utf-8").split()) <= 2000


def test_the_page_has_the_udev_rule_of_the_driver() -> None:
    assert UDEV_RULE in (DOCS / "kit.md").read_text(encoding="utf-8")


# they must not
@pytest.mark.parametrize("page", [page for page in of("cpp") if page.id != "compiler_errors"])
@pytest.mark.parametrize("compiler", ["c++", "clang++"])
def test_cpp_compiles(page: Path, compiler: str, tmp_path: Path) -> None:
    for text in (text for language, text in blocks(page) if language == "cpp"):
        compiles(
            compiler,
            text if "#include" in text else f"#include <palpate/palpate.hpp>\n{text}",
            tmp_path,
        )


def test_toml_is_what_palpate_reads(tmp_path: Path) -> None:
    from palpate.cli.config import configurable_parameters, read_tables

    for text in [text for page in PAGES for language, text in blocks(page) if language == "toml"]:
        path = tmp_path / "palpate.toml"
        path.write_text(text)
        for name, table in read_tables(path, COMMANDS).items():
            command = palpate_command.get_command(click.Context(palpate_command), name)
            assert command is not None
            assert set(table) <= set(configurable_parameters(command)) | (
                {"logger"} if name == "import" else set()
            )
