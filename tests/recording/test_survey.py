"""The counts of a block: in one pass by the core where there is nothing to count, and as numpy counts any other."""

import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from effort import draws, random_of
from numpy.typing import NDArray
from palpate import _core
from palpate.recording.survey import Survey
from palpate.samples import Block, blank
from recording_bench import record

ROWS = 1_200_000
MEMORY = 48 << 20
"""Beyond what the imports take; the rows' arrays alone would be 67 MB."""


def blocks(seed: int) -> list[Block]:
    """Return blocks that follow each other, most of them with one thing that is not ordinary, or none."""
    rng = np.random.default_rng(seed)
    rows = blank(int(rng.integers(3, 30)))
    rows["seq"] = np.arange(len(rows)) + 5
    rows["t_hard_ns"] = np.cumsum(rng.integers(0, 3, len(rows))) * 26_000_000
    for name in ("hard", "soft"):
        rows[name], rows[f"{name}_raw"] = rng.uniform(-1, 1, len(rows)), rng.integers(-1, 50, len(rows))
    others: list[tuple[str, NDArray[Any]]] = [
        ("seq", np.array([0, 7, 2**62, 2**63 - 1])),
        ("t_hard_ns", np.array([-1, 2**63 - 1, -(2**63)])),
        ("status", np.array([1, 2, 4, 8])),
        ("hard", np.array([np.nan, np.inf])),
        ("soft", np.array([np.nan, -np.inf])),
        ("hard_raw", np.array([50, 51])),
        ("soft_raw", np.array([50, 51])),
        ("status", np.array([0])),
    ]
    name, values = others[seed % len(others)]
    rows[int(rng.integers(len(rows)))][name] = rng.choice(values)
    return np.split(rows, np.sort(rng.integers(0, len(rows), 3)))


def surveyed(parts: list[Block], marked: frozenset[int]) -> dict[str, object]:
    survey = Survey(largest_code=50, marked=marked)
    for part in parts:
        survey.add(part)
    return asdict(survey)


def test_the_core_counts_as_numpy_does(monkeypatch: pytest.MonkeyPatch) -> None:
    rng, ordinary, count = random_of("surveys"), 0, draws(400)
    for _ in range(count):
        parts = blocks(rng.randrange(10**9))
        marked = frozenset({9} if rng.random() < 0.1 else ())
        found = surveyed(parts, marked)
        ordinary += all(_core.ordinary(part, 50) is not None for part in parts if len(part))
        with monkeypatch.context() as patch:
            patch.setattr(Survey, "_is_ordinary", lambda *_: False)
            assert found == surveyed(parts, marked)
    assert 0.05 * count < ordinary < 0.7 * count


def test_long_files_need_little_memory(tmp_path: Path) -> None:
    path = tmp_path / "long.csv"
    record(path, [])
    with path.open("a") as file:
        for first in range(0, ROWS, 100_000):
            file.write(
                "".join(f"{i},{i}.000000001,{i}.5,8388608,8388608,0,0,-1,0\n" for i in range(first, first + 100_000))
            )
    code = f"""
import resource, palpate, palpate.recording.verification, palpate.sources.files
palpate.Tracker().process([0.0], [0.0], [0.0], [0.0])
with open("/proc/self/statm") as file:
    size = int(file.read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (size + {MEMORY}, size + {MEMORY}))
report = palpate.check({str(path)!r})
assert report.survey.rows == {ROWS} and report.survey.lost == 0, report
assert palpate.touches(palpate.open({str(path)!r})) == []
try:
    palpate.read({str(path)!r})
except MemoryError:
    print("the limit holds")
"""

    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.stdout, done.returncode) == ("the limit holds\n", 0), done.stderr
