"""The built site, for all tests of it."""

import subprocess
import sys
from pathlib import Path

import pytest
from project import ROOT, made_once


def build_site(folder: Path) -> None:
    """Build the site, without a complaint of Sphinx."""
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-n", "-q"]
    done = subprocess.run(
        [*command, str(ROOT / "docs"), str(folder)],
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made_once(tmp_path_factory, "site", build_site)
