"""Hostile files of 1 MB, to every parser: its documented error, little time and little memory."""

import json
import os
import subprocess
import sys

import pytest
from effort import ALL, NIGHTLY
from project import ROOT
from tally import Tally

STEP = 1 if NIGHTLY else 20 if ALL else 60


def test_hostile_files_end_as_documented(tally: Tally) -> None:
    """The limits are those of a busy machine; what grows faster than the file is far beyond them."""
    pytest.importorskip("resource")
    if not sys.platform.startswith("linux"):
        pytest.skip("memory of a process is read from /proc")
    program = [sys.executable, str(ROOT / "tests" / "tools" / "hostile_files.py"), str(STEP)]
    surroundings = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}  # the children are forked
    done = subprocess.run(program, capture_output=True, text=True, check=False, env=surroundings)
    assert done.returncode == 0, done.stderr
    costs = {(parser, name): cost for parser, files in json.loads(done.stdout).items() for name, cost in files.items()}
    assert not {key: cost for key, cost in costs.items() if cost["error"]}
    slowest, largest = (max(costs, key=lambda key: costs[key][what]) for what in ("seconds", "megabytes"))
    tally.say(
        f"{len(costs)} hostile files: at most {costs[slowest]['seconds']:.1f} s ({': '.join(slowest)}) and "
        f"{costs[largest]['megabytes']:.0f} MB ({': '.join(largest)})"
    )
