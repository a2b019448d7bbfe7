"""A long recording is counted block by block."""

import subprocess
import sys
from pathlib import Path

from recording_bench import record

ROWS = 1_200_000
MEMORY = 48 << 20
"""Beyond what the imports take; the rows' arrays alone would be 67 MB."""


def test_long_files_need_little_memory(tmp_path: Path) -> None:
    path = tmp_path / "long.csv"
    record(path, [])
    with path.open("a") as file:
        for first in range(0, ROWS, 100_000):
            file.write(
                "".join(
                    f"{i},{i}.000000001,{i}.5,8388608,8388608,0,0,-1,0\n"
                    for i in range(first, first + 100_000)
                )
            )
    code = f"""
import resource, palpate, palpate.recording.verification, palpate.sources.playback
palpate.Tracker().process([0.0], [0.0], [0.0], [0.0])
with open("/proc/self/statm") as file:
    size = int(file.read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (size + {MEMORY}, size + {MEMORY}))
report = palpate.check({str(path)!r})
assert report.survey.rows == {ROWS} and report.survey.lost == 0, report
assert palpate.touches(palpate.recorded({str(path)!r})) == []
try:
    palpate.read({str(path)!r})
except MemoryError:
    print("the limit holds")
"""

    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.stdout, done.returncode) == ("the limit holds\n", 0), done.stderr
