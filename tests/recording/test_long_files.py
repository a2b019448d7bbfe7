"""A recording of any length: read in parts, with the same result however it is cut."""

import subprocess
import sys
from pathlib import Path

import pytest
from palpate import Sample, Status, check
from recording_bench import record, sample

ROWS = 1_200_000
MEMORY = 48 << 20
"""Beyond what the imports take; the rows' arrays alone would be 67 MB."""


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


def test_the_survey_is_the_same_however_the_file_is_cut(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from palpate.recording import own_file

    rows: list[Sample] = [sample(i, status=Status.LOST if i % 11 == 3 else 0) for i in range(0, 600, 2)]
    path = record(tmp_path / "run.csv", rows)
    whole = check(path)
    assert whole.survey.lost == 299
    for chunk in (1, 7, 100, 1000):
        monkeypatch.setattr(own_file, "_CHUNK", chunk)
        assert check(path) == whole
