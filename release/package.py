"""The release of the package: what it needs, its source distribution, and whether its files are complete.

    python -m release.package check TAG [FILE...]     says what is missing; with FILEs, all files of a release
    python -m release.package source FOLDER [ADDRESS] makes the source distribution of the last commit
    python -m release.package files FILE...           says what is wrong in some files

Exit code 1 and a line for each problem. README.md of the source distribution, of which the wheels are built, has full addresses
as links: a package's page has no other files. ADDRESS replaces the one of pyproject.toml in a rehearsal.
"""

import re
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import zipfile
from collections.abc import Iterable
from datetime import date
from email.parser import Parser
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
_LINUX, _OTHER = "manylinux_2_28_{0} musllinux_1_2_{0}", "macosx_x86_64 macosx_arm64 win_amd64"
SYSTEMS = (*_LINUX.format("x86_64").split(), *_LINUX.format("aarch64").split(), *_OTHER.split())
"""Where .github/workflows/release.yml builds: part of a wheel's platform tag."""
NEEDED = (
    "LICENSE",
    "README.md",
    "CITATION.cff",
    "pyproject.toml",
    "tests/data/four-specimens.csv",
    "release/smoke.py",
)
"""Files of a source distribution."""
ALLOWED = re.compile(
    r"palpate/[\w./-]+\.(py|pyi|typed|hpp|cmake|js|css|html|svg|so|pyd|j2)|palpate/lib/cmake/palpate/CMakeLists\.txt"
    r"|palpate-[\d.]+\.dist-info/(METADATA|RECORD|WHEEL|entry_points\.txt|licenses/LICENSE|sboms/[\w.-]+)"
)
STRAY = re.compile(r"(^|/)(tests?|build|__pycache__|\.[^/]+)/")
_FENCED = re.compile(r"^```.*?^```$", re.DOTALL | re.MULTILINE)
_LINK = re.compile(r"\]\((?!#|[a-z][a-z0-9+.-]*:)([^()\s]+)\)", re.IGNORECASE)
_IMAGES = {".gif", ".jpg", ".png", ".svg", ".webp"}


def pyproject(root: Path = ROOT) -> dict[str, Any]:
    """Return what pyproject.toml says."""
    return tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))


def _text(root: Path, name: str, pattern: str) -> str | None:
    found = re.search(pattern, (root / name).read_text(encoding="utf-8"), re.MULTILINE)
    return found[1] if found else None


def version(root: Path = ROOT) -> str:
    """Return the version; version.hpp is the only place of it."""
    return _text(root, "cpp/include/palpate/version.hpp", r'PALPATE_VERSION "(.*)"') or ""


def address(root: Path = ROOT) -> str:
    """Return the address of the repository; ValueError: there is none yet, or none that a reader can open."""
    source = pyproject(root)["project"].get("urls", {}).get("Source", "")
    if not re.fullmatch(r"https://[^\s/]+/\S+", source) or "example." in source:
        raise ValueError(
            f"pyproject.toml, [project.urls]: Source is {source!r}, allowed: https://HOST/PATH of the repository"
        )
    return str(source).rstrip("/")


def problems(tag: str, root: Path = ROOT, today: date | None = None) -> list[str]:
    """Return what is to be done in the source before `tag` can be released, in sentences."""
    found, now = [], version(root)
    try:
        address(root)
    except ValueError as error:
        found.append(str(error))
    if tag != f"v{now}":
        found.append(
            f"the tag is {tag!r}, the version is {now} (cpp/include/palpate/version.hpp); allowed: v{now}"
        )
    if (cited := _text(root, "CITATION.cff", r'^version: "?([^"\n]*)')) != now:
        found.append(
            f"CITATION.cff: version is {cited}, in version.hpp it is {now}; write the same"
        )
    released = _text(root, "CHANGELOG.md", rf"^## \[{re.escape(now)}\] - (\d{{4}}-\d\d-\d\d)$")
    cited = _text(root, "CITATION.cff", r'^date-released: "?([^"\n]*)')
    if not released:
        found.append(
            f'CHANGELOG.md: there is no heading "## [{now}] - {today or date.today()}"; rename "## [Unreleased]"'
        )
    elif cited != released:
        found.append(
            f"CITATION.cff: date-released is {cited}, in CHANGELOG.md it is {released}; write the same"
        )
    return found


def absolute(text: str, source: str, ref: str, folder: Path) -> str:
    """Return Markdown with each relative link and image as an address of the repository; blocks of code stay as they are.

    Raises ValueError for a link to a file or a folder that is not there.
    """

    def linked(match: re.Match[str]) -> str:
        path = match[1].partition("#")[0]
        if not (folder / path).exists():
            raise ValueError(f"README.md links to {path}, which is not there; correct the link")
        kind = (
            "raw"
            if Path(path).suffix in _IMAGES
            else "tree"
            if (folder / path).is_dir()
            else "blob"
        )
        return f"]({source}/{kind}/{ref}/{match[1]})"

    blocks = _FENCED.findall(text)
    between = [_LINK.sub(linked, part) for part in _FENCED.split(text)]
    return "".join(part + block for part, block in zip(between, [*blocks, ""], strict=True))


def make_source(folder: str, rehearsal: str = "") -> None:
    """Make the source distribution of the last commit in a folder."""
    source = rehearsal or address()
    with tempfile.TemporaryDirectory() as name:
        archive = subprocess.run(
            ["git", "archive", "HEAD"], cwd=ROOT, stdout=subprocess.PIPE, check=True
        )
        subprocess.run(["tar", "-x", "-C", name], input=archive.stdout, check=True)
        readme, project = Path(name) / "README.md", Path(name) / "pyproject.toml"
        readme.write_text(
            absolute(readme.read_text("utf-8"), source, f"v{version()}", Path(name)),
            encoding="utf-8",
        )
        if rehearsal:
            urls = f'[project.urls]\nSource = "{source}"\n'
            project.write_text(
                project.read_text("utf-8").replace("[project.urls]\n", urls), encoding="utf-8"
            )
        subprocess.run(
            [sys.executable, "-m", "build", "--sdist", "--outdir", Path(folder).resolve(), name],
            check=True,
        )


def expected() -> set[tuple[str, str]]:
    """Return interpreter and system of every wheel of a release."""
    pythons = [name.partition("-")[0] for name in pyproject()["tool"]["cibuildwheel"]["build"]]
    return {(python, system) for python in pythons for system in SYSTEMS}


def targets(wheel: str) -> set[tuple[str, str]]:
    """Return those of the expected ones that a file name stands for."""
    python, _, platforms = wheel.removesuffix(".whl").split("-")[2:]
    plain = {re.sub(r"^(macosx)_\d+_\d+_", r"\1_", platform) for platform in platforms.split(".")}
    return {(python, platform) for platform in plain} & expected()


def _problems_of_metadata(text: str) -> list[str]:
    data = Parser().parsestr(text)
    links = _LINK.findall(_FENCED.sub("", str(data.get_payload())))
    found = [f"its page would have the relative link {link}" for link in links]
    if data["Version"] != version():
        found.append(f"version {data['Version']}, expected {version()}")
    if not any(url.startswith("Source, ") for url in data.get_all("Project-URL", [])):
        found.append("no address of the source; see [project.urls] in pyproject.toml")
    return found


def problems_of_wheel(path: Path) -> list[str]:
    """Return what is wrong in a wheel."""
    with zipfile.ZipFile(path) as wheel:
        names = [
            name for name in wheel.namelist() if not name.endswith("/")
        ]  # auditwheel writes folders, too
        [metadata] = [name for name in names if name.endswith(".dist-info/METADATA")]
        found = _problems_of_metadata(wheel.read(metadata).decode())
    found += [
        f"stray file {name}" for name in names if not ALLOWED.fullmatch(name) or STRAY.search(name)
    ]
    if len([name for name in names if re.fullmatch(r"palpate/_core\.[^/]*(so|pyd)", name)]) != 1:
        found.append("expected one extension palpate/_core")
    return found + (
        [] if any(name.endswith("licenses/LICENSE") for name in names) else ["no LICENSE"]
    )


def problems_of_source(path: Path) -> list[str]:
    """Return what is wrong in a source distribution."""
    with tarfile.open(path) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
        file = archive.extractfile(f"{path.name.removesuffix('.tar.gz')}/PKG-INFO")
        found = _problems_of_metadata(file.read().decode() if file else "")
    found += [f"{name} is missing" for name in NEEDED if name not in names]
    return found + [
        f"stray file {name}" for name in sorted(names) if re.match(r"\.(ci|git|venv)/", name)
    ]


def problems_of(files: Iterable[Path], complete: bool = True) -> list[str]:
    """Return what is wrong with the files of a release; `complete`: every wheel has to be there."""
    wheels = sorted(path for path in files if path.suffix == ".whl")
    sources = sorted(set(files) - set(wheels))
    found = [f"{path.name}: {problem}" for path in wheels for problem in problems_of_wheel(path)]
    found += [f"{path.name}: {problem}" for path in sources for problem in problems_of_source(path)]
    if complete:
        built = set[tuple[str, str]]().union(*(targets(path.name) for path in wheels))
        found += [
            f"no wheel for {python} on {system}" for python, system in sorted(expected() - built)
        ]
        found += [] if len(sources) == 1 else [f"{len(sources)} source distributions, expected 1"]
    return found


def main(command: str, *arguments: str) -> None:
    """Run a command."""
    if command == "source":
        make_source(*arguments)
        return
    found = problems(arguments[0]) if command == "check" else []
    files = [Path(file) for file in (arguments[1:] if command == "check" else arguments)]
    found += problems_of(files, complete=command == "check") if files else []
    sys.exit("\n".join(found) or 0)


if __name__ == "__main__":
    if len(sys.argv) < 3 or sys.argv[1] not in ("check", "source", "files"):
        sys.exit(__doc__)
    main(*sys.argv[1:])
