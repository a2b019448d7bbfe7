"""The C++ reference: every public name of the headers has a page, and nothing of it is undocumented."""

import os
import re
import subprocess
import sys
from pathlib import Path

import palpate
import pytest
from project import ROOT, need

EXTENSIONS = ROOT / "docs" / "extensions"
HEADERS = Path(palpate.get_include()) / "palpate"
CONF = """import sys
sys.path.insert(0, {extensions!r})
project, root_doc, html_theme = "palpate", "cpp", "furo"
extensions = ["myst_parser", "cpp_reference"]
nitpick_ignore_regex = [("cpp:.*", ".*")]
"""
GUIDE = """# Guide

`HandheldTracker<float>`, `palpate::Rls`, `embedded::GatedRls`, `nothing`

```{toctree}
cpp/index
```
"""
# At namespace scope, as the headers are written: not indented.
_CLASS = re.compile(r"^(?:class|struct|enum class|enum) (\w+)\b(?! *<)[^;]*?\{", re.MULTILINE)
_ALIAS = re.compile(r"^using (\w+) =", re.MULTILINE)


def build(folder: Path, path: str) -> subprocess.CompletedProcess[str]:
    """Build a site of the guide and the reference; PATH says which programs there are."""
    source = folder / "source"
    source.mkdir()
    (source / "conf.py").write_text(CONF.format(extensions=str(EXTENSIONS)))
    (source / "cpp.md").write_text(GUIDE)
    command: list[str | Path] = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-n", source, folder / "site"]
    environment = {**os.environ, "PATH": path}
    return subprocess.run(command, capture_output=True, encoding="utf-8", env=environment, check=False)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    need("doxygen")
    folder = tmp_path_factory.mktemp("reference")
    done = build(folder, os.environ["PATH"])
    assert (done.returncode, done.stderr) == (0, "")
    return folder / "site"


def public_names() -> set[str]:
    """Return the classes and aliases of the headers, below palpate, without the parts that the reference leaves out."""
    text = (EXTENSIONS / "Doxyfile").read_text() + (EXTENSIONS / "cpp_reference.py").read_text()
    left_out = re.findall(r"\*/(\w+\.hpp)", text)
    parts = {*re.findall(r"palpate::(\w+)", text), *re.findall(r'"(\w+)"', text.split("PARTS = ")[1].split("\n")[0])}
    found = set()
    for header in HEADERS.rglob("*.hpp"):
        if header.name not in left_out:
            body = header.read_text(encoding="utf-8").split("namespace palpate", 1)[-1]
            body = re.sub(r"namespace detail \{.*?\}  // namespace detail", "", body, flags=re.DOTALL)
            below = "embedded." if header.stem == "embedded" else ""
            found |= {below + name for name in (*_CLASS.findall(body), *_ALIAS.findall(body)) if name not in parts}
    return found


def test_every_public_name_has_a_page(site: Path) -> None:
    pages = {path.stem for path in (site / "cpp").glob("*.html")} - {"index", "functions"}
    names = public_names()
    assert {"Rls", "HandheldTracker", "Reach", "Ring", "embedded.GatedRls"} <= names
    assert pages == names


def test_breathe_found_what_each_page_is_about(site: Path) -> None:
    """It puts a warning on the page, and in no log, where it finds nothing."""
    for path in (site / "cpp").glob("*.html"):
        text = path.read_text(encoding="utf-8")
        assert "admonition warning" not in text, path.name
        if path.stem not in ("index", "functions"):
            name = '[^"]*'.join(path.stem.split("."))  # in a mangled name, with the lengths of its parts
            assert re.search(rf'<dt class="sig sig-object cpp" id="[^"]*{name}', text), path.name
            assert re.search(r"#include</span>.*&lt;palpate/", text), path.name
    functions = (site / "cpp" / "functions.html").read_text(encoding="utf-8")
    assert {"product", "square_root", "policy_in", "ticks_per_second"} <= set(
        re.findall(r">(\w+)</span></span>", functions)
    )


def test_a_name_on_the_guide_is_a_link(site: Path) -> None:
    guide = (site / "cpp.html").read_text(encoding="utf-8").split("<article", 1)[1]
    for page in ("HandheldTracker", "Rls", "embedded.GatedRls"):
        assert re.search(rf'<a [^>]*href="cpp/{re.escape(page)}\.html"[^>]*><code', guide), page
    assert not re.search(r"<a [^>]*><code[^>]*><span[^>]*>nothing", guide)


def test_private_bases_are_not_shown(site: Path) -> None:
    """Doxygen takes the default of a template parameter for the base of that name."""
    for path in (site / "cpp").glob("*.html"):
        assert "private" not in re.sub("<[^>]*>", "", path.read_text(encoding="utf-8").split("<article")[1]), path.name


def test_functions_that_share_a_comment_are_functions_like_the_others(site: Path) -> None:
    for path in (site / "cpp").glob("*.html"):
        assert "unnamed" not in path.read_text(encoding="utf-8").lower(), path.name


def test_without_doxygen_the_page_says_so(tmp_path: Path) -> None:
    done = build(tmp_path, str(tmp_path))
    assert (done.returncode, done.stderr) == (0, "")
    assert "built without doxygen" in done.stdout
    assert [path.name for path in (tmp_path / "site" / "cpp").iterdir()] == ["index.html"]
    assert "built without doxygen" in (tmp_path / "site" / "cpp" / "index.html").read_text(encoding="utf-8")


def test_a_comment_that_is_missing_is_an_error(tmp_path: Path) -> None:
    doxygen = need("doxygen")
    (tmp_path / "one.hpp").write_text(
        "/// Room.\nnamespace palpate {\n/// Has.\nstruct Has {\n  int undocumented;\n};\n}\n"
    )
    more = f'\nINPUT = "{tmp_path}"\nOUTPUT_DIRECTORY = "{tmp_path}"\n'
    text = (EXTENSIONS / "Doxyfile").read_text() + more
    done = subprocess.run([doxygen, "-"], input=text, capture_output=True, encoding="utf-8", check=False)
    assert done.returncode != 0
    assert "Member undocumented" in done.stderr
