"""The package of docs/sources.md: it is built and installed as a user would, its own tests pass, and the commands know it."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from project import ROOT, need_package

PACKAGE = ROOT / "docs" / "examples" / "palpate-fdc1004"


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Install the package in a folder; return the environment in which Python finds it."""
    need_package("hatchling")
    folder = tmp_path_factory.mktemp("installed")
    pip = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-index",
        "--no-deps",
        "--no-build-isolation",
    ]
    subprocess.run([*pip, "--target", str(folder), str(PACKAGE)], check=True)
    return {**os.environ, "PYTHONPATH": str(folder)}


def run(environment: dict[str, str], *words: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run a module of Python."""
    command = [sys.executable, "-m", *words]
    return subprocess.run(
        command, env=environment, capture_output=True, encoding="utf-8", cwd=cwd, check=False
    )


def test_its_own_tests(installed: dict[str, str], tmp_path: Path) -> None:
    options = ["-q", "-n0", "-W", "error", "-p", "no:cacheprovider", "--rootdir", str(tmp_path)]
    done = run(installed, "pytest", *options, str(PACKAGE / "tests"), cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_recording_and_its_replay(installed: dict[str, str], tmp_path: Path) -> None:
    """The replay computes the capacitances from the codes, wider than 24 bits: the touch has the same numbers."""
    words = ("record", "fdc1004:fake?rate=400", "-o", "run.csv", "--touches", "1", "--json")
    done = run(installed, "palpate", *words, cwd=tmp_path)
    assert done.returncode in (0, 5), done.stderr
    rows = (tmp_path / "run.csv").read_text().splitlines()[1:]
    assert max(int(row.split(",")[3]) for row in rows) > 2**24
    device = json.loads((tmp_path / "run.json").read_text())["device"]
    assert device["codes"] == {"zero": 2**23, "per_pF": 2**19, "largest": 67567615}
    again = run(installed, "palpate", "replay", "run.csv", "--json", cwd=tmp_path)
    live, replayed = (json.loads(each.stdout)["touches"] for each in (done, again))
    assert live[0]["ratio"] == replayed[0]["ratio"] == pytest.approx(2.5, rel=0.05)
    assert run(installed, "palpate", "check", "run.csv", cwd=tmp_path).returncode == 0


def test_the_commands_list_it(installed: dict[str, str], tmp_path: Path) -> None:
    listed = run(installed, "palpate", "devices", "--json", cwd=tmp_path)
    assert {"uri": "fdc1004:fake", "what": "a simulated FDC1004"} in json.loads(listed.stdout)[
        "devices"
    ]
    doctor = run(installed, "palpate", "doctor", cwd=tmp_path)
    assert "ok  source fdc1004: of package palpate-fdc1004" in doctor.stdout
    refused = run(
        installed, "palpate", "record", "fdc1004:fake?rate=7", "-o", "run.csv", cwd=tmp_path
    )
    assert refused.returncode == 2
    assert "rate: got '7', allowed: 100, 200, 400" in refused.stderr
