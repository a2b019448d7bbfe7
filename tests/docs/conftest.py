"""The built site, for all tests of it."""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from project import ROOT, made_once

BESIDE = ("SECURITY.md", "CONTRIBUTING.md", "CHANGELOG.md", "CITATION.cff")
"""What the pages show of the folder above theirs, and the pictures in bench/, and the examples in cpp/."""


def build_site(folder: Path) -> None:
    """Build the site, without a complaint of Sphinx.

    From a copy of its sources: autosummary writes the pages of the API into the folder.
    """
    with tempfile.TemporaryDirectory() as name:
        source = Path(name)
        shutil.copytree(ROOT / "docs", source / "docs", ignore=shutil.ignore_patterns("api"))
        for shown in ("bench", "cpp"):
            (source / shown).symlink_to(ROOT / shown)
        for beside in BESIDE:
            shutil.copy(ROOT / beside, source)
        command = [
            sys.executable,
            "-m",
            "sphinx",
            "-W",
            "--keep-going",
            "-n",
            "-q",
            str(source / "docs"),
            str(folder),
        ]
        done = subprocess.run(command, capture_output=True, encoding="utf-8", check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made_once(tmp_path_factory, "site", build_site)
