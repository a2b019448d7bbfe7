"""Killed while it records: no row that was acknowledged is lost, and the file says what happened."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import palpate
import pytest
from conftest import ROOT
from palpate import check, read
from palpate.recording.foreign import recorded
from palpate.recording.own_file import Recorded
from palpate.recording.sidecar import load

MOMENTS, AT_ONCE = 50, 10
LASTING_S = 1.0


def kill_at_random(folder: Path, seed: int) -> None:
    """Start children, kill each at a moment of its own, and see that all are dead."""
    command = [sys.executable, str(ROOT / "tests" / "killed_child.py"), str(folder), str(AT_ONCE)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout
        children = [int(word) for word in parent.stdout.readline().split()]
        moments, begun = random.Random(seed), time.monotonic()
        for moment, child in sorted((moments.uniform(0, LASTING_S), child) for child in children):
            time.sleep(max(0.0, begun + moment - time.monotonic()))
            os.kill(child, signal.SIGKILL)
    assert len(children) == AT_ONCE


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no SIGKILL on this system")
def test_killed_at_random_moments_while_recording(tmp_path: Path) -> None:
    rows, begun, torn = 0, 0, 0
    for seed in range(MOMENTS // AT_ONCE):
        folder = tmp_path / str(seed)
        folder.mkdir()
        kill_at_random(folder, seed)
        for number in range(AT_ONCE):
            path = folder / f"{number}.csv"
            acknowledged = (folder / f"{number}.acknowledged").read_text().split("\n")[-2:-1]
            if not path.exists():
                assert acknowledged == []
                continue
            begun += 1
            rows += look_at(path, int(acknowledged[0]) if acknowledged else 0)
            torn += not path.read_bytes().endswith(b"\n")
    assert begun > MOMENTS / 2
    assert rows > 1000


def look_at(path: Path, acknowledged: int) -> int:
    """Check a killed recording, repair it, check it again; return its rows."""
    report = check(path)
    rows = report.survey.rows
    assert rows >= acknowledged
    assert not report.running
    assert report.survey.gaps == report.survey.disordered == report.survey.miscoded == 0
    assert not report.clean
    if load(path):
        assert report.faults[0].startswith("no end in the sidecar")
        assert len(read(path).hard) == rows
        assert isinstance(recorded(path), Recorded)
        palpate.touches(recorded(path))
        repaired = check(path, repair=True)
        assert repaired.faults == ()
        assert (repaired.survey.rows, repaired.repaired) == (rows, True)
    return rows
