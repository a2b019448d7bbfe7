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
SYSTEMS = (
    "manylinux_2_28_x86_64",
    "musllinux_1_2_x86_64",
    "manylinux_2_28_aarch64",
    "musllinux_1_2_aarch64",
    "macosx_x86_64",
    "macosx_arm64",
    "win_amd64",
)
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
    match = re.search(pattern, (root / name).read_text(encoding="utf-8"), re.MULTILINE)
    return match[1] if match else None


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
    """Return what must be done in the source before `tag` can be released, in sentences."""
    found = []
    now = version(root)
    try:
        address(root)
    except ValueError as error:
        found.append(str(error))
    if tag != f"v{now}":
        found.append(
            f"the tag is {tag!r}, the version is {now} (cpp/include/palpate/version.hpp); allowed: v{now}"
        )
    cited_version = _text(root, "CITATION.cff", r'^version: "?([^"\n]*)')
    if cited_version != now:
        found.append(
            f"CITATION.cff: version is {cited_version}, in version.hpp it is {now}; write the same"
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
        kind = "blob"
        if Path(path).suffix in _IMAGES:
            kind = "raw"
        elif (folder / path).is_dir():
            kind = "tree"
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
        readme = Path(name) / "README.md"
        page = absolute(readme.read_text("utf-8"), source, f"v{version()}", Path(name))
        readme.write_text(page, encoding="utf-8")
        if rehearsal:
            project = Path(name) / "pyproject.toml"
            urls = f'[project.urls]\nSource = "{source}"\n'
            text = project.read_text("utf-8").replace("[project.urls]\n", urls)
            project.write_text(text, encoding="utf-8")
        build = [sys.executable, "-m", "build", "--sdist"]
        subprocess.run([*build, "--outdir", Path(folder).resolve(), name], check=True)


def expected() -> set[tuple[str, str]]:
    """Return interpreter and system of every wheel of a release."""
    pythons = [name.partition("-")[0] for name in pyproject()["tool"]["cibuildwheel"]["build"]]
    return {(python, system) for python in pythons for system in SYSTEMS}


def targets(wheel: str) -> set[tuple[str, str]]:
    """Return the interpreter and systems of a wheel, by its file name, as far as they are expected."""
    python, _, platforms = wheel.removesuffix(".whl").split("-")[2:]
    plain = re.sub(r"(macosx)_\d+_\d+_", r"\1_", platforms)
    return {(python, platform) for platform in plain.split(".")} & expected()


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
    found = []
    extensions = 0
    licences = 0
    with zipfile.ZipFile(path) as wheel:
        for name in wheel.namelist():
            if name.endswith("/"):
                continue  # auditwheel writes folders, too
            if name.endswith(".dist-info/METADATA"):
                found += _problems_of_metadata(wheel.read(name).decode())
            if STRAY.search(name) or not ALLOWED.fullmatch(name):
                found.append(f"stray file {name}")
            if re.fullmatch(r"palpate/_core\.[^/]*(so|pyd)", name):
                extensions += 1
            if name.endswith("licenses/LICENSE"):
                licences += 1
    if extensions != 1:
        found.append("expected one extension palpate/_core")
    if not licences:
        found.append("no LICENSE")
    return found


def problems_of_source(path: Path) -> list[str]:
    """Return what is wrong in a source distribution."""
    with tarfile.open(path) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
        file = archive.extractfile(f"{path.name.removesuffix('.tar.gz')}/PKG-INFO")
        found = _problems_of_metadata(file.read().decode() if file else "")
    for name in NEEDED:
        if name not in names:
            found.append(f"{name} is missing")
    for name in sorted(names):
        if re.match(r"\.(ci|git|venv)/", name):
            found.append(f"stray file {name}")
    return found


def problems_of_download(path: Path) -> list[str]:
    """Return what is wrong in a file that no package index has: the headers, the page, the sums."""
    if path.name == "SHA256SUMS":
        return []
    if path.name == "palpate-try.html":
        page = path.read_text(encoding="utf-8")
        if "<title>palpate" not in page or "<script src" in page:
            return ["not the page for a browser alone; make it with python -m release.make"]
        return []
    if path.name == f"palpate-cpp-{version()}.zip":
        with zipfile.ZipFile(path) as archive:
            if f"palpate-{version()}/palpate_one.hpp" not in archive.namelist():
                return ["palpate_one.hpp is missing"]
        return []
    return ["not a file of a release"]


def problems_of(files: Iterable[Path], complete: bool = True) -> list[str]:
    """Return what is wrong with the files of a release; `complete`: every wheel has to be there."""
    found = []
    missing = expected()
    sources = 0
    for path in sorted(files, key=lambda path: (path.suffix != ".whl", path)):
        if path.suffix == ".whl":
            problems_here = problems_of_wheel(path)
            missing -= targets(path.name)
        elif path.name.endswith(".tar.gz"):
            problems_here = problems_of_source(path)
            sources += 1
        else:
            problems_here = problems_of_download(path)
        found += [f"{path.name}: {problem}" for problem in problems_here]
    if complete:
        found += [f"no wheel for {python} on {system}" for python, system in sorted(missing)]
        if sources != 1:
            found.append(f"{sources} source distributions, expected 1")
    return found


def main(command: str, *arguments: str) -> None:
    """Run a command."""
    if command == "source":
        make_source(*arguments)
        return
    found = []
    files = list(map(Path, arguments))
    if command == "check":
        found += problems(arguments[0])
        del files[0]
    if files:
        found += problems_of(files, complete=command == "check")
    sys.exit("\n".join(found) or 0)


if __name__ == "__main__":
    if len(sys.argv) < 3 or sys.argv[1] not in ("check", "source", "files"):
        sys.exit(__doc__)
    main(*sys.argv[1:])
