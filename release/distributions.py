"""Judges what would be uploaded: which wheels there are, what is in them, and where the links of their page lead.

`python -m release.distributions FILE...` judges some; release/check.py asks for all of them.
"""

import re
import sys
import tarfile
import zipfile
from collections.abc import Iterable
from email.parser import Parser
from pathlib import Path

from markdown_it import MarkdownIt
from packaging.utils import parse_wheel_filename

from release.project import pyproject, version

# Where .github/workflows/release.yml builds: part of the wheel's platform tag.
SYSTEMS = (
    "manylinux_2_28_x86_64",
    "manylinux_2_28_aarch64",
    "musllinux_1_2_x86_64",
    "musllinux_1_2_aarch64",
    "macosx_x86_64",
    "macosx_arm64",
    "win_amd64",
)
_ALLOWED = re.compile(
    r"palpate/[\w./-]+\.(py|pyi|typed|hpp|cmake|js|css|html|svg|so|pyd)|palpate/lib/cmake/palpate/CMakeLists\.txt"
    r"|palpate-[\d.]+\.dist-info/(METADATA|RECORD|WHEEL|entry_points\.txt|licenses/LICENSE|sboms/[\w.-]+)"
)
_STRAY = re.compile(r"(^|/)(tests?|build|__pycache__|\.[^/]+)/")


def expected() -> set[tuple[str, str]]:
    """Return interpreter and system of every wheel of a release."""
    pythons = [name.partition("-")[0] for name in pyproject()["tool"]["cibuildwheel"]["build"]]
    return {(python, system) for python in pythons for system in SYSTEMS}


def targets(wheel: str) -> set[tuple[str, str]]:
    """Return those of the expected ones that a file name stands for."""
    tags = parse_wheel_filename(wheel)[3]
    plain = {(tag.interpreter, re.sub(r"^(macosx)_\d+_\d+_", r"\1_", tag.platform)) for tag in tags}
    return plain & expected()


def relative_links(markdown: str) -> list[str]:
    """Return links and images that lead nowhere on a package's page."""
    tokens = [child for token in MarkdownIt().parse(markdown) for child in token.children or ()]
    found = [str(token.attrs[name]) for token in tokens for name in ("href", "src") if name in token.attrs]
    return [target for target in found if not re.match(r"#|[a-z][a-z0-9+.-]*:", target, re.IGNORECASE)]


def problems_of_metadata(name: str, text: str) -> list[str]:
    """Return what is wrong with METADATA or PKG-INFO."""
    data = Parser().parsestr(text)
    found = [
        f"{name}: its page would have the relative link {link}" for link in relative_links(str(data.get_payload()))
    ]
    if data["Version"] != version():
        found.append(f"{name}: version {data['Version']}, expected {version()}")
    if not any(url.startswith("Source, ") for url in data.get_all("Project-URL", [])):
        found.append(f"{name}: no address of the source; see [project.urls] in pyproject.toml")
    return found


def problems_of_wheel(path: Path) -> list[str]:
    """Return what is wrong in a wheel."""
    with zipfile.ZipFile(path) as wheel:
        names = wheel.namelist()
        [metadata] = [name for name in names if name.endswith(".dist-info/METADATA")]
        found = problems_of_metadata(path.name, wheel.read(metadata).decode())
    found += [f"{path.name}: stray file {n}" for n in names if not _ALLOWED.fullmatch(n) or _STRAY.search(n)]
    if len([name for name in names if re.fullmatch(r"palpate/_core\.[^/]*(so|pyd)", name)]) != 1:
        found.append(f"{path.name}: expected one extension palpate/_core")
    if not any(name.endswith("licenses/LICENSE") for name in names):
        found.append(f"{path.name}: no LICENSE")
    return found


def problems_of_source(path: Path) -> list[str]:
    """Return what is wrong in a source distribution."""
    with tarfile.open(path) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
        file = archive.extractfile(f"{path.name.removesuffix('.tar.gz')}/PKG-INFO")
        assert file
        found = problems_of_metadata(path.name, file.read().decode())
    needed = (
        "LICENSE",
        "README.md",
        "CITATION.cff",
        "pyproject.toml",
        "tests/data/four-specimens.csv",
        "release/smoke.py",
    )
    found += [f"{path.name}: {name} is missing" for name in needed if name not in names]
    return found + [f"{path.name}: stray file {name}" for name in sorted(names) if re.match(r"\.(ci|git|venv)/", name)]


def problems_of(files: Iterable[Path], complete: bool = True) -> list[str]:
    """Return what is wrong with the files of a release; `complete`: every wheel has to be there."""
    found: list[str] = []
    built: set[tuple[str, str]] = set()
    sources = 0
    for path in sorted(files):
        if path.suffix == ".whl":
            found += problems_of_wheel(path)
            built |= targets(path.name)
        else:
            found += problems_of_source(path)
            sources += 1
    if complete:
        found += [f"no wheel for {python} on {system}" for python, system in sorted(expected() - built)]
        found += [] if sources == 1 else [f"{sources} source distributions, expected 1"]
    return found


if __name__ == "__main__":
    sys.exit("\n".join(problems_of(map(Path, sys.argv[1:]), complete=False)) or 0)
