"""The benches run, and docs/speed.md shows what they wrote. No time is tested: the machine is shared."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from kept import kept_folder
from project import ROOT, need


def bench(*arguments: str) -> str:
    done = subprocess.run([sys.executable, *arguments], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_speed_measures_and_prints(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}:{need('c++').rpartition('/')[0]}", prepend=":")
    need("cmake")
    out = tmp_path / "speed.json"
    with kept_folder("speed", need("c++")) as build:
        text = bench("-m", "bench.speed", "--rounds", "3", "--out", str(out), "--build", str(build))
    figures = json.loads(out.read_text())
    for name in ("AdaptiveRls", "bank of 64", "ring, round trip", "Python update", "Python ring, 250"):
        assert 0 < figures[name]["min"] <= figures[name]["median"]
        assert name in text
    errors = {name: value for name, value in figures.items() if name.startswith("error, ")}
    assert len(errors) >= 8
    assert all(0 < error < 1e-4 for error in errors.values()), errors
    assert "AdaptiveRls / the paper's form literally" in text


def test_the_page_shows_the_last_results() -> None:
    assert bench("-m", "bench.speed", "--table").strip() in (ROOT / "docs" / "speed.md").read_text(encoding="utf-8")
