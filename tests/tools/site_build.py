"""The site of docs/, built once for all tests."""

import shutil
import subprocess
import sys
import time
from pathlib import Path

from project import ROOT

BESIDE = ("SECURITY.md", "CONTRIBUTING.md", "CHANGELOG.md", "CITATION.cff")
"""What the pages show of the folder above theirs, and the pictures in bench/."""


def built(root: Path) -> tuple[Path, str]:
    """Return the site, and what Sphinx complained about.

    All workers of a test run share it: the first builds, the others wait. It is built from a copy: autosummary writes the
    pages of the API beside the others.
    """
    folder, said = root / "site", root / "said"
    try:
        folder.mkdir()
    except FileExistsError:
        while not said.exists():
            time.sleep(0.2)
        return folder, said.read_text(encoding="utf-8")
    complaints = "the build was given up"
    try:
        complaints = _build(root / "source", folder)
    finally:
        said.with_suffix(".part").write_text(complaints, encoding="utf-8")
        said.with_suffix(".part").rename(said)
    return folder, complaints


def _build(source: Path, folder: Path) -> str:
    shutil.copytree(ROOT / "docs", source / "docs", ignore=shutil.ignore_patterns("api"))
    (source / "bench").symlink_to(ROOT / "bench")
    for name in BESIDE:
        shutil.copy(ROOT / name, source)
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-n", "-q", str(source / "docs"), str(folder)]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", check=False)
    return done.stderr or ("" if done.returncode == 0 else f"exit {done.returncode}")
