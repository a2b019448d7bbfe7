"""The C++ reference: every public name of the headers has a place, and nothing of it is undocumented."""

import re
import subprocess
from pathlib import Path

import palpate
import pytest
from project import ROOT, need
from sphinx.util.inventory import InventoryFile

EXTENSIONS = ROOT / "docs" / "extensions"
HEADERS = Path(palpate.get_include()) / "palpate"
# At namespace scope, as the headers are written: not indented.
_NAME = re.compile(
    r"^(?:(?:class|struct|enum class|enum) (\w+)\b(?! *<)[^;]*?\{|using (\w+) =)", re.MULTILINE
)


@pytest.fixture(autouse=True)
def doxygen() -> str:
    return need("doxygen")


def public_names() -> set[str]:
    """Return the classes and aliases of the headers, without the parts that the reference leaves out."""
    text = (EXTENSIONS / "Doxyfile").read_text() + (EXTENSIONS / "cpp_reference.py").read_text()
    parts = {
        *re.findall(r"palpate::(\w+)", text),
        *re.findall(r'"(\w+)"', text.split("PARTS = ")[1].split("\n")[0]),
    }
    found = set()
    for header in HEADERS.rglob("*.hpp"):
        if header.name not in re.findall(r"\*/(\w+\.hpp)", text):
            body = header.read_text(encoding="utf-8").split("namespace palpate", 1)[-1]
            body = re.sub(
                r"namespace detail \{.*?\}  // namespace detail", "", body, flags=re.DOTALL
            )
            own = header.stem in ("design", "embedded")
            below = f"palpate::{header.stem}::" if own else "palpate::"
            found |= {below + (a or b) for a, b in _NAME.findall(body) if (a or b) not in parts}
    return found


def test_every_public_name_has_a_place(site: Path) -> None:
    known = InventoryFile.loads((site / "objects.inv").read_bytes(), uri="").data
    shown = {name for kind, names in known.items() if kind.startswith("cpp:") for name in names}
    assert {"palpate::Rls", "palpate::embedded::PaperRls", "palpate::square_root"} <= shown
    assert public_names() - shown == set()


def test_the_pages_show_no_warning_and_nothing_private(site: Path) -> None:
    """Breathe puts a warning on the page, and in no log, where it finds nothing."""
    for path in (site / "cpp").glob("*.html"):
        text = re.sub("<[^>]*>", "", path.read_text(encoding="utf-8").split("<article")[1])
        assert not re.search("warning|unnamed|private", text, re.IGNORECASE), path.name
    assert 'href="cpp/tracker.html#' in (site / "cpp.html").read_text(encoding="utf-8")


def test_a_comment_that_is_missing_is_an_error(doxygen: str, tmp_path: Path) -> None:
    (tmp_path / "one.hpp").write_text(
        "/// Room.\nnamespace palpate {\n/// Has.\nstruct Has {\n  int bare;\n};\n}\n"
    )
    text = (
        EXTENSIONS / "Doxyfile"
    ).read_text() + f'\nINPUT = "{tmp_path}"\nOUTPUT_DIRECTORY = "{tmp_path}"\n'
    done = subprocess.run(
        [doxygen, "-"], input=text, capture_output=True, encoding="utf-8", check=False
    )
    assert done.returncode != 0
    assert "Member bare" in done.stderr
